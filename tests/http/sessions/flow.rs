//! A session from its first frame to its end.

use crate::application::{BOX, TestApplication, expect, expect_detail, expect_problem};
use crate::pictures;
use bagtrack_tracker::Rect;
use reqwest::StatusCode;

#[tokio::test]
async fn a_session_from_its_first_frame_to_its_end() {
    let app = TestApplication::start().await;
    let response = app
        .create(
            pictures::png(0),
            &[("box", BOX), ("seed", "7"), ("verbose", "true")],
        )
        .await;
    let location = response.headers()["location"].to_str().unwrap().to_owned();
    let created = expect(response, StatusCode::CREATED).await;
    let id = created["id"].as_str().unwrap();
    assert_eq!(location, format!("/sessions/{id}"));
    assert_eq!(created["frame"], 0);
    let first_box = serde_json::json!({"x": 20.0, "y": 15.0, "width": 16.0, "height": 12.0});
    assert_eq!(created["box"], first_box);
    let size = serde_json::json!({"width": pictures::WIDTH, "height": pictures::HEIGHT});
    assert_eq!(created["image"], size);
    assert_eq!(created["parameters"]["seed"], 7);
    humantime::parse_rfc3339(created["expires_at"].as_str().unwrap()).unwrap();

    let first = app.track(id, 1).await;
    assert_eq!(first["frame"], 1);
    assert!((0.0..=1.0).contains(&first["score"].as_f64().unwrap()));
    assert!(["tracking", "uncertain", "lost"].contains(&first["status"].as_str().unwrap()));

    let view = expect(app.get_session(id).await, StatusCode::OK).await;
    assert_eq!(view["id"], id);
    assert_eq!(view["frames"], 2);
    assert_eq!(view["answer"], first);
    assert_eq!(view["parameters"], created["parameters"]);

    let query = [("box", "24,17,16,12")];
    let response = app.put_target(id, pictures::png(2), &query).await;
    let corrected = expect(response, StatusCode::OK).await;
    assert_eq!(corrected["frame"], 2);
    let given = serde_json::json!({"x": 24.0, "y": 17.0, "width": 16.0, "height": 12.0});
    assert_eq!(corrected["box"], given);

    let deleted = app.delete_session(id).await;
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    expect_problem(app.get_session(id).await, "session-not-found").await;
    expect_problem(app.delete_session(id).await, "session-not-found").await;
}

#[tokio::test]
async fn the_box_follows_the_target() {
    let (app, id) = TestApplication::with_session().await;
    for t in 1..=16 {
        let answer = app.track(&id, t).await;
        let side = |name: &str| answer["box"][name].as_f64().unwrap();
        let answered = Rect::new(side("x"), side("y"), side("width"), side("height"));
        let (x, y) = (20.0 + 2.0 * f64::from(t), 15.0 + f64::from(t));
        let target = Rect::new(x, y, 16.0, 12.0);
        assert!(
            answered.overlap(&target) > 0.6,
            "frame {t}: {answered:?} for {target:?}"
        );
    }
    // The target has left its first box by these frames, so a box that never moves would fail.
    let (first, last) = (
        Rect::new(20.0, 15.0, 16.0, 12.0),
        Rect::new(52.0, 31.0, 16.0, 12.0),
    );
    assert_eq!(first.overlap(&last), 0.0);
}

#[tokio::test]
async fn a_random_seed_is_told() {
    let app = TestApplication::start().await;
    let seed = async || {
        let query = [("box", BOX), ("verbose", "")];
        let created = app.opened(&query).await;
        created["parameters"]["seed"].as_u64().unwrap()
    };
    assert_ne!(seed().await, seed().await);
}

#[tokio::test]
async fn single_parameters_override_the_preset() {
    let app = TestApplication::start().await;
    let params = [("parameters", r#"{"alpha": 0.25, "particles": 50}"#)];
    let verbose = ("verbose", "1");
    let query = [("box", BOX), ("preset", "paper"), verbose, params[0]];
    let created = app.opened(&query).await;
    assert_eq!(created["parameters"]["alpha"], 0.25);
    assert_eq!(created["parameters"]["particles"], 50);
    assert_eq!(created["parameters"]["bag_size"], 10);

    for (params, named) in [
        (r#"{"colour": 1}"#, "`bag_size`"),
        (r#"{"alpha": "high"}"#, "`alpha`"),
        (r#"{"alpha": 7}"#, "alpha"),
    ] {
        let query = [("box", BOX), ("parameters", params)];
        let response = app.create(pictures::png(0), &query).await;
        expect_detail(response, "invalid-parameter", &[named]).await;
    }
}

#[tokio::test]
async fn the_page_the_docs_and_the_health_are_served() {
    let app = TestApplication::start().await;
    let page = app.get("/").await.text().await.unwrap();
    assert!(page.contains("curl") && page.contains("docs/") && page.contains("openapi.json"));
    // `/docs` redirects to `/docs/`, and the client follows.
    let docs = app.get("/docs").await;
    assert_eq!(docs.url().path(), "/docs/");
    let docs = docs.text().await.unwrap();
    for name in [
        "swagger-ui.css",
        "swagger-ui-bundle.js",
        "swagger-initializer.js",
    ] {
        assert!(docs.contains(name));
        let file = app.get(&format!("/docs/{name}")).await;
        assert_eq!(file.status(), StatusCode::OK, "{name}");
    }
    expect_problem(app.get("/docs/none.js").await, "route-not-found").await;
    for path in ["/healthz", "/readyz"] {
        let health = expect(app.get(path).await, StatusCode::OK).await;
        assert_eq!(health["status"], "ok");
    }
}

#[tokio::test]
async fn a_sane_request_id_is_kept_and_another_replaced() {
    let app = TestApplication::start().await;
    let answered_id = async |sent: &str| {
        let request = app.request(reqwest::Method::GET, "/healthz", &[]);
        let response = request.header("x-request-id", sent).send().await.unwrap();
        response.headers()["x-request-id"]
            .to_str()
            .unwrap()
            .to_owned()
    };
    assert_eq!(answered_id("trace-12.3").await, "trace-12.3");
    for sent in ["", "with space", "<script>", &"x".repeat(65)] {
        assert_ne!(answered_id(sent).await, sent);
    }
}
