//! The service below a path (`--base-path`) of a host that it shares with other services.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use crate::requests::forms::form;
use crate::requests::lines::{LINES, lines};
use bagtrack::http::BasePath;
use reqwest::{Client, Method, StatusCode, redirect};

async fn start() -> TestApplication {
    TestApplication::start_with(|config| config.base_path = "/video/tracker".parse().unwrap()).await
}

#[tokio::test]
async fn a_session_goes_on_where_its_location_says() {
    let app = start().await;
    // With the base path, and as a proxy sends it that has removed the base path.
    for path in ["/video/tracker/sessions", "/sessions"] {
        let request = app.request(Method::POST, path, &[("box", BOX)]);
        let opened = request.body(pictures::png(0)).send().await.unwrap();
        assert_eq!(opened.status(), StatusCode::CREATED, "{path}");
        let location = opened.headers()["location"].to_str().unwrap().to_owned();
        assert!(
            location.starts_with("/video/tracker/sessions/"),
            "{location}"
        );
        let frame = app.request(
            Method::POST,
            &format!("{location}/frames"),
            &[("frame", "1")],
        );
        let answer = frame.body(pictures::png(1)).send().await.unwrap();
        assert_eq!(expect(answer, StatusCode::OK).await["frame"], 1, "{path}");
        let wrong = app.request(
            Method::POST,
            &format!("{location}/frames"),
            &[("frame", "5x")],
        );
        let problem = expect_problem(
            wrong.body(pictures::png(1)).send().await.unwrap(),
            "malformed-request",
        );
        assert_eq!(problem.await["instance"], format!("{location}/frames"));
    }
    let other = expect(
        app.get("/video/trackers/healthz").await,
        StatusCode::NOT_FOUND,
    )
    .await;
    assert_eq!(other["instance"], "/video/tracker/video/trackers/healthz");
}

#[tokio::test]
async fn the_problem_of_a_later_line_names_the_whole_path() {
    let app = start().await;
    let path = format!("/video/tracker/sessions/{}/frames", app.open().await);
    let form = form([pictures::png(1), b"no picture".to_vec()]);
    let request = app.request(Method::POST, &path, &[]);
    let answer = request.header("accept", LINES).multipart(form).send().await;
    let lines = lines(answer.unwrap()).await;
    assert_eq!((&lines[0]["frame"], lines.len()), (&1.into(), 2));
    assert_eq!(lines[1]["instance"], path);
}

#[tokio::test]
async fn the_page_and_the_document_lead_below_the_path() {
    let app = start().await;
    let client = Client::builder()
        .redirect(redirect::Policy::none())
        .build()
        .unwrap();
    for (path, leads_to) in [
        ("/video/tracker", "/video/tracker/"),
        ("/video/tracker/docs", "/video/tracker/docs/"),
    ] {
        let answer = client
            .get(format!("http://{}{path}", app.address))
            .send()
            .await
            .unwrap();
        assert!(
            answer.status().is_redirection(),
            "{path}: {}",
            answer.status()
        );
        assert_eq!(answer.headers()["location"], leads_to);
    }
    let page = app.get("/video/tracker/").await.text().await.unwrap();
    for text in page.split(['"', '\'']) {
        let is_link = text.ends_with(".js") || text.ends_with(".css") || text == "docs/";
        if is_link || text == "openapi.json" {
            assert!(!text.starts_with('/'), "{text}");
            let asset = app.get(&format!("/video/tracker/{text}")).await;
            assert_eq!(asset.status(), StatusCode::OK, "{text}");
        }
    }
    let document = app.get("/video/tracker/openapi.json").await;
    let document = expect(document, StatusCode::OK).await;
    assert_eq!(document["servers"][0]["url"], "/video/tracker");
    let settings = app.get("/video/tracker/docs/swagger-initializer.js").await;
    let settings = settings.text().await.unwrap();
    assert!(settings.contains("\"../openapi.json\""), "{settings}");
}

#[test]
fn a_base_path_has_plain_names() {
    for text in ["/tracker", "/video/tracker/", "/v1.0/a_b-c~d"] {
        let path: BasePath = text.parse().unwrap();
        assert_eq!(path.as_str(), text.trim_end_matches('/'));
    }
    assert_eq!("".parse::<BasePath>().unwrap().as_str(), "");
    for text in ["tracker", "//", "/a//b", "/..", "/a b", "/%2e", "/a?b"] {
        assert!(text.parse::<BasePath>().is_err(), "{text}");
    }
}
