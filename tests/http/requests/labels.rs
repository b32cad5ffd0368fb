//! The bytes of a body decide on its type, whatever its `Content-Type` says.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use base64::prelude::{BASE64_STANDARD, Engine};
use image::ImageFormat;
use reqwest::{Method, Response, StatusCode};
use serde_json::json;

async fn post(app: &TestApplication, path: &str, label: &str, body: Vec<u8>) -> Response {
    let request = app.request(Method::POST, path, &[("box", BOX), ("seed", "7")]);
    let request = request.header("content-type", label);
    request.body(body).send().await.unwrap()
}

/// The clients that openapi-generator makes for Go, Java and C# label every body as JSON where a call takes JSON.
#[tokio::test]
async fn an_image_that_is_labelled_as_json_is_an_image() {
    let app = TestApplication::start().await;
    for label in [
        "application/json",
        "application/json; charset=utf-8",
        "Application/JSON",
    ] {
        for format in [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::WebP] {
            let frame = pictures::encode(pictures::scene(0), format);
            let opened = post(&app, "/sessions", label, frame).await;
            assert_eq!(opened.status(), StatusCode::CREATED, "{label} {format:?}");
        }
    }
    let id = app.open().await;
    let request = app.frames_request(&id, &[]);
    let request = request.header("content-type", "application/json");
    let answer = request.body(pictures::png(1)).send().await.unwrap();
    let answer = expect(answer, StatusCode::OK).await;
    let plain = app.post_frame(&app.open().await, pictures::png(1)).await;
    assert_eq!(answer, expect(plain, StatusCode::OK).await);
    let snapshot = app.snapshot(&id).await;
    let request = app.request(Method::POST, "/sessions", &[]);
    let request = request.header("content-type", "application/json");
    let restored = request.body(snapshot).send().await.unwrap();
    assert_eq!(restored.status(), StatusCode::CREATED);
}

#[tokio::test]
async fn json_is_what_begins_with_a_brace_after_blanks_and_a_byte_order_mark() {
    let app = TestApplication::start().await;
    let frame = BASE64_STANDARD.encode(pictures::png(0));
    let body = json!({"frame": frame}).to_string();
    for start in ["", " \r\n\t", "\u{feff}", "\u{feff}\n "] {
        for label in ["application/json", "text/plain", "application/octet-stream"] {
            let body = format!("{start}{body}").into_bytes();
            let opened = post(&app, "/sessions", label, body).await;
            assert_eq!(opened.status(), StatusCode::CREATED, "{start:?} {label}");
        }
    }
}

#[tokio::test]
async fn what_is_labelled_as_json_and_is_neither_is_told_what_it_is() {
    let app = TestApplication::start().await;
    for (body, slug) in [
        (&b"[1, 2]"[..], "malformed-request"),
        (b"frame=1", "malformed-request"),
        (b"", "malformed-request"),
        (b"\xEF\xBB\xBF[]", "malformed-request"),
        (b"GIF89b\x00\x01\x02", "unsupported-image"),
        (b"II*\0\x08\0\0\0", "unsupported-image"),
    ] {
        let refused = post(&app, "/sessions", "application/json", body.to_vec()).await;
        expect_problem(refused, slug).await;
    }
}
