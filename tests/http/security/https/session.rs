//! Sessions over TLS.

use super::certificates::{Authority, kinds};
use super::client::{Client, trusting};
use crate::application::TestApplication;
use bagtrack_testing::picture_files as pictures;
use futures_util::{SinkExt, StreamExt};
use image::{DynamicImage, ImageFormat};
use serde_json::Value;
use std::net::SocketAddr;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::Message;

const FRAMES: usize = 8;

/// Frames with a picture that moves to the left.
fn frames() -> Vec<Vec<u8>> {
    let wide = pictures::color(400, 240);
    let frame = |step: usize| {
        let part = image::imageops::crop_imm(&wide, 4 * step as u32, 0, 320, 240).to_image();
        pictures::encode(&DynamicImage::ImageRgb8(part), ImageFormat::Png)
    };
    (0..=FRAMES).map(frame).collect()
}

/// Opens a session over this connection and posts the frames.
async fn track<S: AsyncRead + AsyncWrite + Unpin>(client: &mut Client<S>) -> (String, Vec<Value>) {
    let frames = frames();
    let created = client
        .call("POST", "/sessions?box=60,50,60,50&seed=7", &frames[0])
        .await;
    assert_eq!(created.status(), "201", "{}", created.head);
    let location = created.header("location").unwrap().to_owned();
    let mut answers = Vec::new();
    for frame in &frames[1..] {
        let answer = client
            .call("POST", &format!("{location}/frames"), frame)
            .await;
        assert_eq!(answer.status(), "200", "{}", answer.head);
        let answer = answer.json();
        answers.push(answer["answers"].get(0).unwrap_or(&answer).clone());
    }
    (location, answers)
}

async fn plain_answers() -> Vec<Value> {
    let plain = TestApplication::start().await;
    let mut client = Client(TcpStream::connect(plain.address).await.unwrap());
    let (_, answers) = track(&mut client).await;
    assert!(plain.end().await);
    answers
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_session_has_the_boxes_that_it_has_without_tls_whatever_the_key_is() {
    let (authority, expected) = (Authority::new(), plain_answers().await);
    assert_eq!(expected.len(), FRAMES);
    for (kind, algorithm) in kinds() {
        let files = authority.issue(algorithm);
        let service = files.service(|_| ()).await;
        for offered in [&["h2", "http/1.1"][..], &[]] {
            let connector = trusting(&authority.root, offered);
            let mut client = Client::open(&connector, service.address).await;
            let agreed = client.0.get_ref().1.alpn_protocol();
            let expected_protocol = (!offered.is_empty()).then_some(&b"http/1.1"[..]);
            assert_eq!(agreed, expected_protocol, "{kind}");
            let (_, answers) = track(&mut client).await;
            assert_eq!(answers, expected, "{kind}");
        }
        assert!(service.end().await);
    }
}

/// The answers to the frames over the stream of a session.
async fn stream_answers(authority: &Authority, address: SocketAddr, id: &str) -> Vec<Value> {
    let client = Client::open(&trusting(&authority.root, &[]), address).await;
    let url = format!("wss://localhost:{}{id}/stream", address.port());
    let (mut socket, _) = client_async(url, client.0).await.unwrap();
    let mut answers = Vec::new();
    for frame in &frames()[1..] {
        socket.send(Message::binary(frame.clone())).await.unwrap();
    }
    while answers.len() < FRAMES {
        let message = socket.next().await.unwrap().unwrap();
        if let Message::Text(text) = message {
            let value: Value = serde_json::from_str(&text).unwrap();
            if value.get("box").is_some() {
                answers.push(value);
            }
        }
    }
    answers
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_goes_over_tls() {
    let authority = Authority::new();
    let files = authority.issue(kinds()[0].1);
    let service = files.service(|_| ()).await;
    let mut client = Client::open(&trusting(&authority.root, &[]), service.address).await;
    let first = &frames()[0];
    let created = client
        .call("POST", "/sessions?box=60,50,60,50&seed=7", first)
        .await;
    let location = created.header("location").unwrap();
    let answers = stream_answers(&authority, service.address, location).await;
    for (answer, expected) in answers.iter().zip(plain_answers().await) {
        assert_eq!(answer["box"], expected["box"]);
    }
    assert!(service.end().await);
}

#[tokio::test]
async fn who_speaks_plain_http_is_sent_to_https() {
    let authority = Authority::new();
    let files = authority.issue(kinds()[0].1);
    let service = files.service(|_| ()).await;
    let mut client = Client(TcpStream::connect(service.address).await.unwrap());
    let answer = client.call("GET", "/docs/?a=b", b"").await;
    assert_eq!(answer.status(), "307", "{}", answer.head);
    assert_eq!(
        answer.header("location"),
        Some("https://localhost:8443/docs/?a=b")
    );
    assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
    // The client has sent its frame, and maybe its key, unencrypted: the answer must not be a success.
    let answer = client
        .call("POST", "/sessions?box=60,50,60,50", &frames()[0])
        .await;
    assert_eq!(answer.status(), "400", "{}", answer.head);
    let problem = answer.json();
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("https"), "{problem}");
    let metrics = client.call("GET", "/metrics", b"").await;
    assert_eq!(metrics.status(), "307");
    assert!(service.end().await);
}

#[tokio::test]
async fn who_does_not_know_the_issuer_says_so_and_the_service_goes_on() {
    let (authority, stranger) = (Authority::new(), Authority::new());
    let files = authority.issue(kinds()[0].1);
    let service = files.service(|_| ()).await;
    let refused = Client::try_open(&trusting(&stranger.root, &[]), service.address).await;
    let message = refused.err().expect("another root").to_string();
    assert!(message.contains("invalid peer certificate"), "{message}");
    let only_h2 = Client::try_open(&trusting(&authority.root, &["h2"]), service.address).await;
    assert!(only_h2.is_err(), "there is no HTTP/2");
    let mut client = Client::open(&trusting(&authority.root, &[]), service.address).await;
    assert_eq!(client.call("GET", "/healthz", b"").await.status(), "200");
    assert!(service.end().await);
}
