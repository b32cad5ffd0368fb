//! Pages and documents are compressed for those who take it; answers to frames never.

use crate::application::TestApplication;
use crate::pictures;
use flate2::read::GzDecoder;
use reqwest::header::{HeaderMap, HeaderValue};
use reqwest::{Method, Response, StatusCode};
use std::io::Read;

const BUNDLE: &str = "/docs/swagger-ui-bundle.js";

async fn get(app: &TestApplication, path: &str, headers: &[(&'static str, &str)]) -> Response {
    let headers = headers
        .iter()
        .map(|(name, value)| (name.parse().unwrap(), HeaderValue::from_str(value).unwrap()));
    let request = app.request(Method::GET, path, &[]);
    let request = request.headers(HeaderMap::from_iter(headers));
    request.send().await.unwrap()
}

#[tokio::test]
async fn what_the_program_holds_is_compressed_for_clients_that_take_gzip() {
    let app = TestApplication::start().await;
    for (path, share) in [
        ("/openapi.json", 0.25),
        (BUNDLE, 0.4),
        ("/docs/swagger-ui.css", 0.4),
        ("/docs/problems", 0.6),
        ("/", 0.6),
        ("/page/main.js", 0.6),
    ] {
        let plain = get(&app, path, &[]).await;
        assert_eq!(plain.headers().get("content-encoding"), None, "{path}");
        assert_eq!(plain.headers()["vary"], "accept-encoding", "{path}");
        let tag = plain.headers()["etag"].to_str().unwrap().to_owned();
        let kind = plain.headers()["content-type"].clone();
        let plain = plain.bytes().await.unwrap();
        let small = get(&app, path, &[("accept-encoding", "gzip, deflate, br")]).await;
        assert_eq!(small.headers()["content-encoding"], "gzip", "{path}");
        assert_eq!(small.headers()["vary"], "accept-encoding", "{path}");
        assert_eq!(small.headers()["content-type"], kind);
        // Both encodings have the same entity tag, so it must be a weak one.
        assert_eq!(small.headers()["etag"], tag);
        assert!(tag.starts_with("W/\""), "{tag}");
        let small = small.bytes().await.unwrap();
        let most = (plain.len() as f64 * share) as usize;
        assert!(
            small.len() < most,
            "{path}: {} of {}",
            small.len(),
            plain.len()
        );
        let mut unpacked = Vec::new();
        GzDecoder::new(&small[..])
            .read_to_end(&mut unpacked)
            .unwrap();
        assert!(unpacked == plain, "{path}");
        for encoding in ["gzip", "identity"] {
            let headers = [("accept-encoding", encoding), ("if-none-match", &*tag)];
            let known = get(&app, path, &headers).await;
            assert_eq!(known.status(), StatusCode::NOT_MODIFIED, "{path}");
            assert!(known.bytes().await.unwrap().is_empty());
        }
        let other = get(&app, path, &[("if-none-match", "\"0\"")]).await;
        assert_eq!(other.status(), StatusCode::OK, "{path}");
        let refused = get(&app, path, &[("accept-encoding", "gzip;q=0")]).await;
        assert_eq!(refused.headers().get("content-encoding"), None, "{path}");
    }
}

#[tokio::test]
async fn answers_to_frames_are_never_compressed() {
    let (app, id) = TestApplication::with_session().await;
    for accept in ["application/json", "application/x-ndjson", "image/png"] {
        let request = app.frames_request(&id, &[]);
        let request = request
            .header("accept-encoding", "gzip")
            .header("accept", accept);
        let answer = request.body(pictures::png(1)).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK);
        assert_eq!(answer.headers().get("content-encoding"), None, "{accept}");
    }
    let snapshot = get(
        &app,
        &format!("/sessions/{id}/snapshot"),
        &[("accept-encoding", "gzip")],
    )
    .await;
    assert_eq!(snapshot.headers().get("content-encoding"), None);
}
