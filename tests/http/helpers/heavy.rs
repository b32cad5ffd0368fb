//! Requests that keep a worker busy: many frames for sessions with the most expensive parameters.

use crate::application::{BOX, TestApplication};
use crate::helpers::raw::RawConnection;
use crate::pictures;
use crate::requests::forms::form;
use bagtrack_testing::within::within;
use image::{GrayImage, ImageFormat, Luma};
use reqwest::multipart::Form;
use reqwest::{Method, RequestBuilder, StatusCode};
use tokio::task::JoinSet;

pub use bagtrack_testing::picture_files::bomb;

/// How many frames in one request take the worker some seconds.
pub const FRAMES: usize = 200;

/// The most expensive parameters.
pub const PARAMS: &str = r#"{"particles": 260, "patch_width": 64, "patch_height": 64, "bag_size": 32,
    "update_every": 1, "history": 10, "basis_dim": 6}"#;

/// A picture of 40 megapixels.
pub fn large(value: u8) -> Vec<u8> {
    let picture = GrayImage::from_fn(8000, 5000, |x, y| {
        Luma([value + ((x / 80) ^ (y / 50)) as u8 % 90])
    });
    pictures::encode(picture, ImageFormat::Png)
}

/// Opens a session whose frames take long; gives its path.
pub async fn open(app: &TestApplication) -> String {
    let query = [("box", BOX), ("preset", "paper"), ("parameters", PARAMS)];
    loop {
        let response = app.create(pictures::png(0), &query).await;
        match response.status() {
            StatusCode::CREATED => {
                return response.headers()["location"].to_str().unwrap().to_owned();
            }
            // On a busy machine, opening may take longer than the test's limit for requests: try again.
            StatusCode::SERVICE_UNAVAILABLE => {}
            other => panic!("{other} to an opening"),
        }
    }
}

/// A request with this number of frames for the session at this path.
pub fn post(app: &TestApplication, session: &str, frames: usize) -> RequestBuilder {
    let request = app.request(Method::POST, &format!("{session}/frames"), &[]);
    request.multipart(same_frames(frames))
}

fn same_frames(count: usize) -> Form {
    form(vec![pictures::png(1); count])
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
        // Refused if the other request below has the place when this one arrives: try again.
        while let Ok(_answered) = client
            .post(&url)
            .multipart(same_frames(FRAMES))
            .send()
            .await
        {}
    });
    let full = async { while app.get(&format!("{session}/snapshot")).await.status() != 503 {} };
    within(full, "the queue is full").await;
    busy
}

/// Sends a request to this path over a raw connection.
pub async fn send_raw(app: &TestApplication, path: &str, request: RequestBuilder) -> RawConnection {
    let mut request = request.build().unwrap();
    let body = request.body_mut().take().expect("it has a body");
    let body = http_body_util::BodyExt::collect(body).await.unwrap();
    let body = body.to_bytes();
    let media_type = request.headers()["content-type"].to_str().unwrap();
    let length = body.len();
    let head = format!(
        "POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: {media_type}\r\nContent-Length: {length}\r\n\r\n"
    );
    let mut client = RawConnection::open(app.address).await;
    client.send(head).await;
    client.send(body).await;
    client
}
