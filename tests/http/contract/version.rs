//! `GET /version`.

use crate::application::{TestApplication, expect, expect_problem};
use bagtrack::http::Secret;
use reqwest::StatusCode;

#[tokio::test]
async fn the_version_is_told_to_everybody() {
    let app = TestApplication::start_with(|config| {
        config.access.api_keys = vec![Secret::from("me:0123456789abcdef")];
    });
    let mut app = app.await;
    app.key = None;
    let version = expect(app.get("/version").await, StatusCode::OK).await;
    assert_eq!(version["name"], "bagtrack");
    assert_eq!(version["version"], env!("CARGO_PKG_VERSION"));
    expect_problem(app.get("/version?of=all").await, "malformed-request").await;
}
