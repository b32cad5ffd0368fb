//! Checks at the end of a run, when all callers have gone.

use crate::cluster::{Cluster, REPLICAS};
use crate::journal::Journal;
use crate::replica::{IDLE, Replica};
use axum::body::Body;
use bagtrack_sessions::clock::sleep;
use http::Request;

/// The metrics that are zero when nobody uses a replica.
const IN_USE: [&str; 6] = [
    "bagtrack_sessions",
    "bagtrack_session_bytes",
    "bagtrack_upload_bytes",
    "bagtrack_requests_inside",
    "bagtrack_workers_busy",
    "bagtrack_streams",
];

/// Waits until all sessions have expired, then checks that neither a replica nor the store holds anything for them.
pub async fn all_is_given_back(cluster: &Cluster, journal: &Journal) {
    // Sessions expire after this time, and the sweeper runs four times in it: twice the time suffices.
    sleep(IDLE * 2).await;
    for index in 0..REPLICAS {
        let Some(replica) = cluster.at(index) else {
            journal.fault(format!("replica {index} is not there at the end"));
            continue;
        };
        let metrics = metrics(&replica).await;
        for name in IN_USE {
            match value(&metrics, name) {
                Some(0.0) => {}
                other => journal.fault(format!("{}: {name} is {other:?} at the end", replica.name)),
            }
        }
    }
    if let Some(server) = &cluster.setup().store {
        let keys = server.live_keys();
        let of_sessions = keys.iter().filter(|key| key.contains(":session:"));
        for key in of_sessions {
            journal.fault(format!("the store has {key} at the end"));
        }
    }
}

async fn metrics(replica: &Replica) -> String {
    let mut request = Request::new(Body::empty());
    *request.uri_mut() = http::Uri::from_static("/metrics");
    let host = http::HeaderValue::from_static("localhost");
    request.headers_mut().insert("host", host);
    let (answer, _client) = replica.answer(request);
    let answer = answer.await.expect("it lives");
    String::from_utf8_lossy(answer.body()).into_owned()
}

fn value(metrics: &str, name: &str) -> Option<f64> {
    let lines = metrics.lines();
    let mut values =
        lines.filter_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.parse().ok());
    values.next()
}
