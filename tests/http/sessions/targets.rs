//! Sessions with several targets.

use crate::application::{BOX, TestApplication, expect, expect_detail, expect_problem};
use crate::pictures;
use crate::requests::forms::part;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use reqwest::multipart::Form;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

/// The target of the scene, and two places behind it.
pub const BOXES: &str = "20,15,16,12;40,30,18,14;6,36,14,14";

/// Opens a session with these boxes, with seed 7.
pub async fn open_with(app: &TestApplication, boxes: &str) -> String {
    let query = [("boxes", boxes), ("seed", "7")];
    let created = app.opened(&query).await;
    created["id"].as_str().unwrap().to_owned()
}

/// The answer of target `k`, as one of a session with a single target.
fn answer_of(answer: &Value, k: usize) -> Value {
    let mut single = answer["targets"][k].clone();
    single["frame"] = answer["frame"].clone();
    single
}

#[tokio::test]
async fn all_targets_are_tracked_and_the_first_as_if_it_were_alone() {
    let app = TestApplication::start().await;
    let single = app.open().await;
    let query = [("boxes", BOXES), ("seed", "7")];
    let created = app.opened(&query).await;
    assert_eq!(created["boxes"].as_array().unwrap().len(), 3);
    assert_eq!(created["boxes"][2]["x"], 6.0);
    assert_eq!(created["box"], created["boxes"][0]);
    let id = created["id"].as_str().unwrap();
    for t in 1..=12 {
        let alone = app.track(&single, t).await;
        let answer = app.track(id, t).await;
        assert_eq!(answer["frame"], t);
        assert_eq!(answer["targets"].as_array().unwrap().len(), 3);
        assert_eq!(answer_of(&answer, 0), alone);
        assert_ne!(answer_of(&answer, 1), alone);
    }
    // The two places behind stand still; the target of the scene has moved 24 pixels.
    let view = expect(app.get_session(id).await, StatusCode::OK).await;
    assert_eq!(view["frames"], 13);
    let x = |k: usize| view["answer"]["targets"][k]["box"]["x"].as_f64().unwrap();
    assert!((x(0) - 44.0).abs() < 4.0, "{view}");
    assert!((x(2) - 6.0).abs() < 4.0, "{view}");
}

#[tokio::test]
async fn a_list_of_one_box_has_a_list_of_one_answer() {
    let app = TestApplication::start().await;
    let (single, id) = (app.open().await, open_with(&app, BOX).await);
    let answer = app.track(&id, 1).await;
    assert_eq!(answer["targets"].as_array().unwrap().len(), 1);
    assert_eq!(answer_of(&answer, 0), app.track(&single, 1).await);
}

#[tokio::test]
async fn boxes_come_in_the_query_in_a_form_and_in_json() {
    let app = TestApplication::start().await;
    let id = open_with(&app, BOXES).await;
    let expected = app.track(&id, 1).await;
    let form = Form::new()
        .part("frame", part(pictures::png(0)))
        .text("boxes", BOXES)
        .text("seed", "7");
    let form = app.request(Method::POST, "/sessions", &[]).multipart(form);
    let body = json!({
        "frame": STANDARD.encode(pictures::png(0)),
        "boxes": [
            [20, 15, 16, 12],
            {"x": 40, "y": 30, "width": 18, "height": 14},
            "6,36,14,14"
        ],
        "seed": 7
    });
    let made = uuid::Uuid::new_v4();
    let json = app
        .request(Method::PUT, &format!("/sessions/{made}"), &[])
        .json(&body);
    for request in [form, json] {
        let created = expect(request.send().await.unwrap(), StatusCode::CREATED).await;
        let id = created["id"].as_str().unwrap();
        assert_eq!(app.track(id, 1).await, expected);
    }
}

#[tokio::test]
async fn boxes_that_cannot_be_tracked_are_refused_and_named() {
    let app = TestApplication::start().await;
    let create = async |query: &[(&str, &str)]| app.create(pictures::png(0), query).await;
    let many = vec![BOX; 17].join(";");
    for (query, slug, says) in [
        (
            &[("boxes", BOX), ("box", BOX)][..],
            "malformed-request",
            "not both",
        ),
        (
            &[("boxes", many.as_str())],
            "malformed-request",
            "1 to 16 boxes",
        ),
        (&[("boxes", "")], "malformed-request", "1 to 16 boxes"),
        (
            &[("boxes", "20,15,16,12;900,900,4,4")],
            "invalid-box",
            "Target 1 of 2",
        ),
    ] {
        expect_detail(create(query).await, slug, &[says]).await;
    }
    // The memory of a session suffices for sixteen targets with the default parameters, not with very large ones.
    let sixteen = vec![BOX; 16].join(";");
    expect(create(&[("boxes", &sixteen)]).await, StatusCode::CREATED).await;
    let large = r#"{"patch_width": 64, "patch_height": 64, "bag_size": 32, "basis_dim": 6}"#;
    let query = [
        ("boxes", sixteen.as_str()),
        ("preset", "paper"),
        ("parameters", large),
    ];
    expect_detail(create(&query).await, "invalid-parameter", &["16 targets"]).await;
}

#[tokio::test]
async fn a_correction_says_which_target_and_the_others_are_tracked() {
    let app = TestApplication::start().await;
    let (id, other) = (open_with(&app, BOXES).await, open_with(&app, BOXES).await);
    let put = async |query: &[(&str, &str)]| app.put_target(&id, pictures::png(1), query).await;
    for query in [&[("box", BOX)][..], &[("box", BOX), ("target", "3")]] {
        expect_detail(put(query).await, "malformed-request", &["from 0 to 2"]).await;
    }
    let outside = [("box", "900,900,4,4"), ("target", "1")];
    expect_problem(put(&outside).await, "invalid-box").await;
    let query = [("box", "42,31,18,14"), ("target", "1"), ("frame", "1")];
    let corrected = expect(put(&query).await, StatusCode::OK).await;
    let given = json!({"x": 42.0, "y": 31.0, "width": 18.0, "height": 14.0});
    assert_eq!(corrected["targets"][1]["box"], given);
    assert_eq!(corrected["targets"][1]["score"], 1.0);
    let tracked = app.track(&other, 1).await;
    assert_eq!(corrected["targets"][0], tracked["targets"][0]);
    assert_eq!(corrected["targets"][2], tracked["targets"][2]);
}

#[tokio::test]
async fn a_session_counts_once_for_each_target() {
    let app = TestApplication::start_with(|config| config.limits.client_sessions = Some(4)).await;
    let id = open_with(&app, BOXES).await;
    let create = async |boxes| app.create(pictures::png(0), &[("boxes", boxes)]).await;
    expect_problem(create("20,15,16,12;40,30,18,14").await, "quota-exceeded").await;
    app.delete_session(&id).await;
    expect(create("20,15,16,12;40,30,18,14").await, StatusCode::CREATED).await;
    // More targets than a client may ever have: no `quota-exceeded`, since trying again would not help.
    let five = [BOXES, "20,15,16,12;40,30,18,14"].join(";");
    expect_detail(create(&five).await, "invalid-parameter", &["at most 4"]).await;
}

#[tokio::test]
async fn each_target_has_a_bag() {
    let app = TestApplication::start().await;
    let id = open_with(&app, BOXES).await;
    let bag = async |query: &str| app.get(&format!("/sessions/{id}/bag.png{query}")).await;
    let first = bag("").await.bytes().await.unwrap();
    assert_eq!(bag("?target=0").await.bytes().await.unwrap(), first);
    let second = bag("?target=1").await;
    assert_eq!(second.headers()["content-type"], "image/png");
    assert_ne!(second.bytes().await.unwrap(), first);
    for query in ["?target=3", "?target=x", "?other=1"] {
        expect_problem(bag(query).await, "malformed-request").await;
    }
}
