//! Spans, exported to a collector.

use crate::application::BOX;
use crate::pictures;
use crate::program::Program;
use axum::body::Bytes;
use axum::routing::post;
use reqwest::Client;
use rustix::process::Signal;
use std::sync::{Arc, Mutex};
use tokio::net::TcpListener;

const TRACE: u128 = 0x4bf9_2f35_77b3_4da6_a3ce_929d_0e0e_4736;
const PARENT: u64 = 0x00f0_67aa_0ba9_02b7;

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

// Two threads: one waits for the end of the service, the other runs the collector.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_span_of_a_request_is_exported_as_a_child_of_the_clients() {
    let received: Arc<Mutex<Vec<u8>>> = Arc::default();
    let keep = received.clone();
    let collect = async move |body: Bytes| keep.lock().unwrap().extend_from_slice(&body);
    let collector = axum::Router::new().route("/v1/traces", post(collect));
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    tokio::spawn(async move { axum::serve(listener, collector).await.unwrap() });

    let variables = [("OTEL_EXPORTER_OTLP_ENDPOINT", endpoint.as_str())];
    let service = Program::start(&["--shutdown-delay", "0s"], &variables);
    let (client, url) = (Client::new(), service.url(&format!("/sessions?box={BOX}")));
    let parent = format!("00-{TRACE:032x}-{PARENT:016x}-01");
    let request = client.post(&url).header("traceparent", parent);
    let answer = request.body(pictures::png(0)).send().await.unwrap();
    let answered = answer.headers()["traceparent"].to_str().unwrap().to_owned();
    assert!(
        answered.starts_with(&format!("00-{TRACE:032x}-")),
        "{answered}"
    );
    let span = u64::from_str_radix(&answered[36..52], 16).unwrap();
    // The service does not record a trace that the client has not sampled.
    let unrecorded = "00-aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-00f067aa0ba902b7-00";
    let request = client.post(&url).header("traceparent", unrecorded);
    request.body(pictures::png(0)).send().await.unwrap();
    service.signal(Signal::TERM);
    assert_eq!(service.ends().0, Some(0));

    let received = received.lock().unwrap();
    assert!(contains(&received, &TRACE.to_be_bytes()), "the trace");
    assert!(
        contains(&received, &PARENT.to_be_bytes()),
        "the client's span"
    );
    assert!(
        contains(&received, &span.to_be_bytes()),
        "the span in the answer"
    );
    assert!(contains(&received, b"http.route") && contains(&received, b"/sessions"));
    assert!(!contains(&received, &[0xaa; 16]));
}
