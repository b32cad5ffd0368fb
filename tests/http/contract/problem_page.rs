//! The `type` of each problem leads to a page with its causes and its cure.

use crate::application::{BOX, TestApplication};
use crate::pictures;
use bagtrack::http::ProblemKind;
use reqwest::{Response, StatusCode};
use serde_json::Value;

/// The section of the page that an address leads to.
fn section<'a>(page: &'a str, anchor: &str) -> &'a str {
    let start = page.split_once(&format!("<section id=\"{anchor}\">"));
    let (_, rest) = start.unwrap_or_else(|| panic!("no section {anchor}"));
    rest.split_once("</section>").unwrap().0
}

#[tokio::test]
async fn every_kind_has_its_section_with_status_cause_and_cure() {
    let app = TestApplication::start().await;
    let response = app.get("/docs/problems").await;
    assert_eq!(response.status(), StatusCode::OK);
    assert_eq!(
        response.headers()["content-type"],
        "text/html; charset=utf-8"
    );
    let page = response.text().await.unwrap();
    for kind in ProblemKind::ALL {
        let section = section(&page, kind.slug());
        let status = kind.status().to_string();
        for text in [kind.title(), &status, "What to do:"] {
            assert!(section.contains(text), "{text}: {section}");
        }
        let paragraphs = section.matches("<p>").count();
        assert_eq!(paragraphs, 3, "{section}");
        assert!(page.contains(&format!("href=\"#{}\"", kind.slug())));
    }
    assert_eq!(page.matches("<section ").count(), ProblemKind::ALL.len());
}

/// Opens the type of a problem as a browser does: relative to the address of the answer.
async fn open_type(app: &TestApplication, response: Response) {
    let url = response.url().clone();
    let status = response.status();
    let problem: Value = response.json().await.unwrap();
    let kind = url.join(problem["type"].as_str().unwrap()).unwrap();
    let page = app.client.get(kind.clone()).send().await.unwrap();
    assert_eq!(page.status(), StatusCode::OK, "{kind}");
    let page = page.text().await.unwrap();
    let section = section(&page, kind.fragment().unwrap());
    assert!(section.contains(problem["title"].as_str().unwrap()));
    assert!(section.contains(status.as_str()));
}

#[tokio::test]
async fn the_type_of_a_problem_opens_also_below_a_base_path() {
    for base in ["", "/video/tracker"] {
        let app = TestApplication::start_with(|config| config.base_path = base.parse().unwrap());
        let app = app.await;
        let at = |path: &str| format!("{base}{path}");
        open_type(&app, app.get(&at("/nothing")).await).await;
        let refused = app.request(reqwest::Method::POST, &at("/sessions"), &[("box", BOX)]);
        let refused = refused.body(b"no image".to_vec()).send().await.unwrap();
        open_type(&app, refused).await;
        let missing = app.request(reqwest::Method::POST, &at("/sessions"), &[]);
        let missing = missing.body(pictures::png(0)).send().await.unwrap();
        let kind = missing.text().await.unwrap();
        assert!(
            kind.contains(&format!("\"{base}/docs/problems#missing-box\"")),
            "{kind}"
        );
    }
}
