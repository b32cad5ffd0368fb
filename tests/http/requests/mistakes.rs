//! Likely mistakes, and the cure that their problems name.

use crate::application::{BOX, TestApplication, expect, expect_detail};
use crate::pictures;
use crate::stream_client::StreamClient;
use base64::prelude::{BASE64_STANDARD, Engine};
use reqwest::multipart::{Form, Part};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

#[tokio::test]
async fn a_file_under_another_name_is_told_to_be_called_frame() {
    let (app, id) = TestApplication::with_session().await;
    for path in ["/sessions".to_owned(), format!("/sessions/{id}/frames")] {
        for name in ["image", "file", "images[]", "picture", "bild"] {
            let part = Part::bytes(pictures::png(0)).file_name("first.png");
            let form = Form::new().part(name, part);
            let request = app.request(Method::POST, &path, &[]).multipart(form);
            let refused = request.send().await.unwrap();
            let texts = [&format!("`{name}`"), "`frame`", "-F frame=@"];
            expect_detail(refused, "missing-frame", &texts).await;
        }
        for name in ["image", "file", "images[]", "data"] {
            let body = json!({ name: BASE64_STANDARD.encode(pictures::png(0)) });
            let request = app.request(Method::POST, &path, &[]).json(&body);
            let refused = request.send().await.unwrap();
            let texts = [&format!("`{name}`"), "`frame`"];
            expect_detail(refused, "missing-frame", &texts).await;
        }
    }
    // A setting may be uploaded as a file, too.
    let settings = Part::bytes(br#"{"alpha": 0.25}"#.to_vec()).file_name("parameters.json");
    let frame = Part::bytes(pictures::png(0)).file_name("first.png");
    let form = Form::new()
        .part("parameters", settings)
        .part("frame", frame);
    let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
    let opened = request.multipart(form).send().await.unwrap();
    assert_eq!(opened.status(), StatusCode::CREATED);
}

#[tokio::test]
async fn a_box_under_another_name_or_in_another_place_is_led_to_its_own() {
    let (app, id) = TestApplication::with_session().await;
    let frames = format!("/sessions/{id}/frames");
    for (path, name, texts) in [
        ("/sessions", "bbox", ["`bbox`", "`box=x,y,width,height`"]),
        ("/track", "x", ["`x`", "`box=x,y,width,height`"]),
        (
            &frames,
            "box",
            ["POST /sessions", "PUT /sessions/{id}/target"],
        ),
        (
            &frames,
            "boxes",
            ["POST /sessions", "PUT /sessions/{id}/target"],
        ),
    ] {
        let frame = Part::bytes(pictures::png(1)).file_name("frame.png");
        let form = Form::new().part("frame", frame).text(name, BOX);
        let request = app.request(Method::POST, path, &[]).multipart(form);
        let refused = request.send().await.unwrap();
        expect_detail(refused, "malformed-request", &texts).await;
    }
    assert_eq!(app.frames_of(&id).await, 1);
}

/// The first bytes of image files as phones make them.
const HEIC: &[u8] = b"\0\0\0\x24ftypheic\0\0\0\0mif1MiHEMiPrmiafMiHBheic\0\0\x0d\x5bmeta\0\0\0\0";
const AVIF: &[u8] = b"\0\0\0\x20ftypavif\0\0\0\0avifmif1miafMA1B\0\0\0\xf2meta\0\0\0\0";

#[tokio::test]
async fn heic_and_avif_are_named_with_the_cure_at_the_opening_and_as_a_frame() {
    let (app, id) = TestApplication::with_session().await;
    for (file, texts) in [
        (HEIC, ["HEIC", "Most Compatible", "JPEG"]),
        (AVIF, ["AVIF", "not read", "JPEG"]),
    ] {
        let opening = app.create(file.to_vec(), &[("box", BOX)]).await;
        expect_detail(opening, "unsupported-image", &texts).await;
        let frame = app.post_frame(&id, file.to_vec()).await;
        expect_detail(frame, "unsupported-image", &texts).await;
        let form = Form::new().part(
            "frame",
            Part::bytes(file.to_vec()).file_name("IMG_0001.HEIC"),
        );
        let request = app.request(Method::POST, "/track", &[("box", BOX)]);
        let track = request.multipart(form).send().await.unwrap();
        expect_detail(track, "unsupported-image", &texts).await;
    }
    assert_eq!(app.frames_of(&id).await, 1);
}

/// Three boxes for 96 x 72: two corners, fractions, and a negative side.
#[tokio::test]
async fn a_box_in_other_units_is_refused_with_the_box_that_is_meant() {
    let (app, id) = TestApplication::with_session().await;
    assert_eq!((pictures::WIDTH, pictures::HEIGHT), (96, 72));
    for (given, texts) in [
        ("70,50,90,65", ["x1,y1,x2,y2", "`box=70,50,20,15`"]),
        ("0.25,0.25,0.5,0.5", ["fractions", "`box=24,18,48,36`"]),
        ("30,30,-10,12", ["negative width", "top left"]),
        ("30,30,10,-12", ["negative height", "top left"]),
    ] {
        let opening = app.create(pictures::png(0), &[("box", given)]).await;
        expect_detail(opening, "invalid-box", &texts).await;
        let correction = app
            .put_target(&id, pictures::png(1), &[("box", given)])
            .await;
        expect_detail(correction, "invalid-box", &texts).await;
        let request = app.request(Method::POST, "/track", &[("box", given)]);
        let track = request.body(pictures::png(0)).send().await.unwrap();
        expect_detail(track, "invalid-box", &texts).await;
        let boxes = format!("{BOX};{given}");
        let several = app.create(pictures::png(0), &[("boxes", &boxes)]).await;
        let texts = [texts[0], texts[1], "Target 1 of 2"];
        expect_detail(several, "invalid-box", &texts).await;
    }
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_box_that_reaches_far_outside_is_tracked_with_a_warning() {
    let app = TestApplication::start().await;
    let far = [("box", "90,20,20,12"), ("seed", "7")];
    let has_warning = |answer: &Value| {
        let warning = answer["warnings"][0].as_str().unwrap_or_default();
        assert!(
            warning.contains("70 % of the box lies outside"),
            "{warning}"
        );
    };
    let created = app.opened(&far).await;
    has_warning(&created);
    let id = created["id"].as_str().unwrap();
    let corrected = app.put_target(id, pictures::png(1), &far[..1]).await;
    has_warning(&expect(corrected, StatusCode::OK).await);
    let request = app.request(Method::POST, "/track", &far);
    let track = request.body(pictures::png(0)).send().await.unwrap();
    has_warning(&expect(track, StatusCode::OK).await);
    let mut stream = StreamClient::open(app.address, id, "").await;
    stream.say(r#"{"box": [90, 20, 20, 12]}"#).await;
    stream.send(pictures::png(2)).await;
    has_warning(&stream.message().await);
    // Without a box beyond the frame there is no warning.
    let plain = app.opened(&[("box", BOX)]).await;
    assert_eq!(plain.get("warnings"), None, "{plain}");
    let answer = app.track(id, 3).await;
    assert_eq!(answer.get("warnings"), None, "{answer}");
    // The numbers may be two corners, or a large box: so a warning.
    let doubtful = [("box", "40,30,58,44")];
    let created = app.opened(&doubtful).await;
    let warning = created["warnings"][0].as_str().unwrap();
    assert!(warning.contains("`box=40,30,18,14`"), "{warning}");
}

#[tokio::test]
async fn several_frames_for_a_call_that_takes_one_are_told_where_the_others_go() {
    let app = TestApplication::start_with(|config| config.max_frames = 3).await;
    let id = app.open().await;
    let frame = |number| Part::bytes(pictures::png(number)).file_name("frame.png");
    let send = async |method: Method, path: &str, count: u32| {
        let form = (0..count).fold(Form::new(), |form, number| {
            form.part("frame", frame(number))
        });
        let query = [("box", BOX)];
        let query = if path == "/frames" { &[] } else { &query[..] };
        let request = app.request(method, path, query);
        request.multipart(form).send().await.unwrap()
    };
    let target = format!("/sessions/{id}/target");
    let alone = [
        "one frame",
        "first one alone",
        "`POST /sessions/{id}/frames`",
    ];
    for (method, path) in [(Method::POST, "/sessions"), (Method::PUT, &target)] {
        let refused = send(method, path, 2).await;
        expect_detail(refused, "too-many-frames", &alone).await;
    }
    let videos = send(Method::POST, "/frames", 2).await;
    expect_detail(videos, "too-many-frames", &["one video"]).await;
    let track = send(Method::POST, "/track", 4).await;
    let rest = ["at most 3 frames", "`--max-frames`", "the rest in another"];
    expect_detail(track, "too-many-frames", &rest).await;
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_url_in_place_of_base64_is_named() {
    let app = TestApplication::start().await;
    for url in [
        "https://example.org/first.jpg",
        "http://10.0.0.1/snapshot.cgi",
        "s3://bucket/1.png",
    ] {
        let body = json!({"frame": url, "box": BOX});
        let request = app.request(Method::POST, "/sessions", &[]).json(&body);
        let refused = request.send().await.unwrap();
        let texts = ["URL", "not fetched", "base64"];
        expect_detail(refused, "malformed-request", &texts).await;
    }
}

#[tokio::test]
async fn a_parameter_of_the_tracker_is_told_its_place() {
    let app = TestApplication::start().await;
    let query = [("box", BOX), ("particles", "300")];
    let opening = app.create(pictures::png(0), &query).await;
    let cure = r#"parameters={"particles":300}"#;
    let texts = ["`particles`", "`parameters`", cure];
    let opening = expect_detail(opening, "malformed-request", &texts).await;
    let body =
        json!({"frame": BASE64_STANDARD.encode(pictures::png(0)), "box": BOX, "particles": 300});
    let request = app.request(Method::POST, "/sessions", &[]).json(&body);
    let by_json = request.send().await.unwrap();
    expect_detail(by_json, "malformed-request", &[&opening]).await;
    let id = app.open().await;
    let request = app.frames_request(&id, &query[1..]);
    let frame = request.body(pictures::png(1)).send().await.unwrap();
    expect_detail(frame, "malformed-request", &["when the session is opened"]).await;
}

#[tokio::test]
async fn a_slash_at_the_end_of_a_path_is_named() {
    let app = TestApplication::start().await;
    let request = app.request(Method::POST, "/sessions/", &[("box", BOX)]);
    let refused = request.body(pictures::png(0)).send().await.unwrap();
    expect_detail(refused, "route-not-found", &["slash", "`/sessions`"]).await;
    expect_detail(app.get("/nothing").await, "route-not-found", &["/docs"]).await;
}
