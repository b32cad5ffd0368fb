//! Makes metrics with their names, units and descriptions.

use metrics::{Counter, Gauge, Histogram, Key, KeyName, Label, Level, Metadata, Recorder, Unit};
use metrics_exporter_prometheus::PrometheusRecorder;

/// Where metrics come from; Prometheus does not show it.
pub const METADATA: Metadata<'static> = Metadata::new(module_path!(), Level::INFO, None);

/// Makes and describes metrics.
pub struct Maker<'a>(pub &'a PrometheusRecorder);

impl Maker<'_> {
    /// A counter with labels that never change.
    pub fn counter(&self, name: &'static str, text: &'static str, labels: &[Label]) -> Counter {
        self.describe_counter(name, text);
        self.find_counter(name, labels.to_vec())
    }

    /// A histogram of seconds.
    pub fn seconds(&self, name: &'static str, text: &'static str) -> Histogram {
        self.describe_seconds(name, text);
        self.0
            .register_histogram(&Key::from_static_name(name), &METADATA)
    }

    /// A value of a moment.
    pub fn gauge(&self, name: &'static str, text: &'static str) -> Gauge {
        let described = KeyName::from_const_str(name);
        self.0.describe_gauge(described, None, text.into());
        self.0
            .register_gauge(&Key::from_static_name(name), &METADATA)
    }

    /// A counter with these labels: the one that is there, or a new one.
    pub fn find_counter(&self, name: &'static str, labels: Vec<Label>) -> Counter {
        self.0
            .register_counter(&Key::from_parts(name, labels), &METADATA)
    }

    /// Says what a counter counts.
    pub fn describe_counter(&self, name: &'static str, text: &'static str) {
        let described = KeyName::from_const_str(name);
        self.0.describe_counter(described, None, text.into());
    }

    /// Says what a histogram of seconds measures.
    pub fn describe_seconds(&self, name: &'static str, text: &'static str) {
        let (described, unit) = (KeyName::from_const_str(name), Some(Unit::Seconds));
        self.0.describe_histogram(described, unit, text.into());
    }
}
