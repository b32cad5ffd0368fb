//! What the service counts and measures, for Prometheus.
//!
//! In: requests, problems, and the work on frames. Out: `GET /metrics`, in the text format.
//!
//! Each [`Metrics`] has a recorder of its own, not the process's, so that several services in one process do not mix.
//! Handles are made at the start; those of requests and problems are looked up by their labels. Labels are routes,
//! methods, statuses and kinds of problems: few of each, whatever clients send.
//!
//! What can go wrong: nobody asks for `/metrics`, and measurements pile up. So the sweeper sums them up from time to
//! time ([`Metrics::upkeep`]).

use bagtrack_api::ProblemKind as Kind;
use bagtrack_sessions::TrackingMetrics;
use metrics::{Counter, Gauge, Histogram, Key, KeyName, Label, Level, Metadata, Recorder, Unit};
use metrics_exporter_prometheus::{Matcher, PrometheusBuilder, PrometheusRecorder};

/// Upper bounds of the histograms' buckets, in seconds, for requests and for waiting.
const REQUEST_SECONDS: [f64; 14] = [
    0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0,
];
/// Upper bounds of the histograms' buckets, in seconds, for the work on one frame.
const FRAME_SECONDS: [f64; 12] = [
    0.00025, 0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064, 0.128, 0.256, 1.0,
];

const REQUESTS: &str = "bagtrack_http_requests_total";
const REQUEST_TIME: &str = "bagtrack_http_request_duration_seconds";
const PROBLEMS: &str = "bagtrack_problems_total";

pub struct Metrics {
    recorder: PrometheusRecorder,
    /// Seconds that a request waited for its session and for a worker.
    pub queue_wait: Histogram,
    /// Bytes of request bodies.
    pub received_bytes: Counter,
    /// Bytes of response bodies.
    pub sent_bytes: Counter,
    /// Idle connections that were closed to make room for others.
    pub shed_connections: Counter,
    pub tracking: TrackingMetrics,
}

impl Metrics {
    /// Metrics that stand at zero.
    pub fn new() -> Self {
        let valid = "the bounds are not empty";
        let full = |name: &str| Matcher::Full(name.to_owned());
        let frame = Matcher::Prefix("bagtrack_frame_".to_owned());
        let recorder = PrometheusBuilder::new()
            .set_buckets_for_metric(full(REQUEST_TIME), &REQUEST_SECONDS)
            .expect(valid)
            .set_buckets_for_metric(full("bagtrack_queue_wait_seconds"), &REQUEST_SECONDS)
            .expect(valid)
            .set_buckets_for_metric(frame, &FRAME_SECONDS)
            .expect(valid)
            .build_recorder();
        let make = Maker(&recorder);
        make.describe_counter(REQUESTS, "Requests answered, by method, route and status.");
        make.describe_seconds(REQUEST_TIME, "Time to the head of the answer, by route.");
        make.describe_counter(PROBLEMS, "Requests refused or failed, by kind of problem.");
        Self {
            queue_wait: make.seconds(
                "bagtrack_queue_wait_seconds",
                "Time that a request waited for its session and for a worker.",
            ),
            received_bytes: make.counter(
                "bagtrack_received_bytes_total",
                "Bytes of request bodies, as they came.",
                &[],
            ),
            sent_bytes: make.counter("bagtrack_sent_bytes_total", "Bytes of answers.", &[]),
            shed_connections: make.counter(
                "bagtrack_connections_shed_total",
                "Idle connections that were closed to make room for others.",
                &[],
            ),
            tracking: tracking(&make),
            recorder,
        }
    }

    pub fn answered(&self, method: &str, route: &str, status: u16, seconds: f64) {
        let make = Maker(&self.recorder);
        let route = Label::new("route", route.to_owned());
        let labels = vec![
            Label::new("method", method.to_owned()),
            route.clone(),
            Label::new("status", status.to_string()),
        ];
        make.find_counter(REQUESTS, labels).increment(1);
        let key = Key::from_parts(REQUEST_TIME, vec![route]);
        let times = self.recorder.register_histogram(&key, &METADATA);
        times.record(seconds);
    }

    pub fn problem(&self, kind: Kind) {
        let labels = vec![Label::from_static_parts("kind", kind.slug())];
        Maker(&self.recorder)
            .find_counter(PROBLEMS, labels)
            .increment(1);
    }

    /// Sets a gauge.
    pub fn set(&self, name: &'static str, description: &'static str, value: f64) {
        Maker(&self.recorder).gauge(name, description).set(value);
    }

    /// Sets the counter of failed calls of the store.
    pub fn store_failures(&self, failures: u64) {
        let failed = Maker(&self.recorder).counter(
            "bagtrack_store_failures_total",
            "Calls that the store did not answer or refused, probes among them.",
            &[],
        );
        failed.absolute(failures);
    }

    /// The text for Prometheus.
    pub fn render(&self) -> String {
        self.recorder.handle().render()
    }

    /// Sums up the measurements since the last call.
    pub fn upkeep(&self) {
        self.recorder.handle().run_upkeep();
    }
}

impl Default for Metrics {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Debug for Metrics {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Metrics")
    }
}

/// Metrics of decoding and tracking that stand at zero.
fn tracking(make: &Maker) -> TrackingMetrics {
    let frames = |status: &'static str| {
        let labels = [Label::from_static_parts("status", status)];
        make.counter(
            "bagtrack_frames_total",
            "Frames answered, by status; once for each target.",
            &labels,
        )
    };
    TrackingMetrics {
        decode: make.seconds("bagtrack_frame_decode_seconds", "Time to decode a frame."),
        step: make.seconds(
            "bagtrack_frame_step_seconds",
            "Processor time to track a target through a frame.",
        ),
        tracking: frames("tracking"),
        uncertain: frames("uncertain"),
        lost: frames("lost"),
        losses: make.counter(
            "bagtrack_targets_lost_total",
            "Times that a target went out of sight.",
            &[],
        ),
    }
}

/// Where metrics come from. The recorder asks for this, and Prometheus does not show it.
const METADATA: Metadata<'static> = Metadata::new(module_path!(), Level::INFO, None);

/// Makes and describes metrics.
struct Maker<'a>(&'a PrometheusRecorder);

impl Maker<'_> {
    /// A counter with labels that never change.
    fn counter(&self, name: &'static str, text: &'static str, labels: &[Label]) -> Counter {
        self.describe_counter(name, text);
        self.find_counter(name, labels.to_vec())
    }

    fn seconds(&self, name: &'static str, text: &'static str) -> Histogram {
        self.describe_seconds(name, text);
        self.0
            .register_histogram(&Key::from_static_name(name), &METADATA)
    }

    fn gauge(&self, name: &'static str, text: &'static str) -> Gauge {
        let described = KeyName::from_const_str(name);
        self.0.describe_gauge(described, None, text.into());
        self.0
            .register_gauge(&Key::from_static_name(name), &METADATA)
    }

    /// The counter with these labels; a new one at their first use.
    fn find_counter(&self, name: &'static str, labels: Vec<Label>) -> Counter {
        self.0
            .register_counter(&Key::from_parts(name, labels), &METADATA)
    }

    fn describe_counter(&self, name: &'static str, text: &'static str) {
        let described = KeyName::from_const_str(name);
        self.0.describe_counter(described, None, text.into());
    }

    /// Says what a histogram of seconds measures.
    fn describe_seconds(&self, name: &'static str, text: &'static str) {
        let (described, unit) = (KeyName::from_const_str(name), Some(Unit::Seconds));
        self.0.describe_histogram(described, unit, text.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bagtrack_sessions::PerTarget;
    use bagtrack_tracker::{Estimate, Rect, Status};
    use std::time::Duration;

    #[test]
    fn each_step_is_measured_for_itself_and_a_loss_is_counted() {
        let metrics = Metrics::new();
        let before = PerTarget::One(Estimate {
            frame: 0,
            target: Rect::new(0.0, 0.0, 1.0, 1.0),
            score: 1.0,
            status: Status::Tracking,
        });
        let steps = [1, 1, 100].map(Duration::from_millis);
        let tracking = &metrics.tracking;
        let lost = before.map(|estimate| Estimate {
            status: Status::Lost,
            ..*estimate
        });
        tracking.tracked(&before, &[before.clone(), lost], &steps);
        let text = metrics.render();
        for line in [
            "bagtrack_frame_step_seconds_bucket{le=\"0.002\"} 2",
            "bagtrack_frame_step_seconds_bucket{le=\"0.064\"} 2",
            "bagtrack_frame_step_seconds_bucket{le=\"0.128\"} 3",
            "bagtrack_frames_total{status=\"lost\"} 1",
            "bagtrack_targets_lost_total 1",
        ] {
            assert!(text.contains(line), "{line}:\n{text}");
        }
    }
}
