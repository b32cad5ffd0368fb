//! Requests that keep a worker busy: many frames, for sessions with the most expensive parameters there are.

use crate::application::{BOX, TestApplication};
use crate::pictures;
use reqwest::multipart::{Form, Part};
use reqwest::{Method, RequestBuilder, StatusCode};
use std::time::Duration;
use tokio::task::JoinSet;

/// Frames of one request that take the worker some seconds.
pub const FRAMES: usize = 200;

const PARAMS: &str = r#"{"particles": 260, "patch_width": 64, "patch_height": 64, "bag_size": 32,
    "update_every": 1, "history": 10, "basis_dim": 6}"#;

/// Opens a session whose frames take long; gives its path.
pub async fn open(app: &TestApplication) -> String {
    let query = [("box", BOX), ("preset", "paper"), ("params", PARAMS)];
    loop {
        let response = app.create(pictures::png(0), &query).await;
        // A busy machine may take longer for it than the time that a test gives its requests.
        if response.status() == StatusCode::CREATED {
            return response.headers()["location"].to_str().unwrap().to_owned();
        }
    }
}

/// The request with so many frames for this session.
pub fn post(app: &TestApplication, session: &str, frames: usize) -> RequestBuilder {
    let request = app.request(Method::POST, &format!("{session}/frames"), &[]);
    request.multipart(form(frames))
}

fn form(frames: usize) -> Form {
    let part = || Part::bytes(pictures::png(1)).file_name("frame.png");
    (0..frames).fold(Form::new(), |form, _| form.part("frame", part()))
}

/// Keeps the only place in the queue taken until the returned value is dropped.
pub async fn fill_queue(app: &TestApplication) -> JoinSet<()> {
    let session = open(app).await;
    let mut busy = JoinSet::new();
    let (client, url) = (
        app.client.clone(),
        format!("http://{}{session}/frames", app.address),
    );
    busy.spawn(async move {
        // The place may be the other request's below when this one comes.
        while let Ok(_answered) = client.post(&url).multipart(form(FRAMES)).send().await {}
    });
    let full = async { while app.get(&format!("{session}/snapshot")).await.status() != 503 {} };
    tokio::time::timeout(Duration::from_secs(60), full)
        .await
        .unwrap();
    busy
}

/// Keeps more requests waiting for the only worker than it gets through in the time that a request may take, until
/// the returned value is dropped.
pub async fn flood(app: &TestApplication) -> JoinSet<()> {
    let mut sessions = Vec::new();
    for _ in 0..80 {
        sessions.push(open(app).await);
    }
    let mut busy = JoinSet::new();
    for session in &sessions {
        let url = format!("http://{}{session}/frames", app.address);
        let client = app.client.clone();
        busy.spawn(async move {
            while let Ok(_answered) = client.post(&url).body(pictures::png(1)).send().await {}
        });
    }
    let late =
        async { while app.get(&format!("{}/snapshot", sessions[0])).await.status() != 503 {} };
    tokio::time::timeout(Duration::from_secs(60), late)
        .await
        .unwrap();
    busy
}

/// The bytes of a request's body.
pub async fn encoded(mut request: reqwest::Request) -> bytes::Bytes {
    let body = request.body_mut().take().expect("it has a body");
    http_body_util::BodyExt::collect(body)
        .await
        .unwrap()
        .to_bytes()
}
