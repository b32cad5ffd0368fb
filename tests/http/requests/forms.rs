//! The three request forms: the same frames in each give the same answers.

use crate::application::{BOX, TestApplication, expect, expect_detail, expect_problem};
use crate::pictures;
use base64::Engine;
use base64::prelude::{BASE64_STANDARD, BASE64_URL_SAFE};
use reqwest::multipart::{Form, Part};
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};

async fn post_form(app: &TestApplication, method: Method, path: &str, form: Form) -> Response {
    let request = app.request(method, path, &[]);
    request.multipart(form).send().await.unwrap()
}

async fn post_json(app: &TestApplication, method: Method, path: &str, body: &Value) -> Response {
    app.request(method, path, &[])
        .json(body)
        .send()
        .await
        .unwrap()
}

pub fn part(frame: Vec<u8>) -> Part {
    Part::bytes(frame).file_name("frame.png")
}

pub fn form(frames: impl IntoIterator<Item = Vec<u8>>) -> Form {
    let add = |form: Form, frame| form.part("frame", part(frame));
    frames.into_iter().fold(Form::new(), add)
}

fn base64(frame: Vec<u8>) -> String {
    BASE64_STANDARD.encode(frame)
}

async fn id_of(app: &TestApplication, response: Response) -> String {
    let created = expect(response, StatusCode::CREATED).await;
    let id = created["id"].as_str().unwrap().to_owned();
    let view = expect(app.get_session(&id).await, StatusCode::OK).await;
    assert_eq!(view["parameters"]["alpha"], 0.25);
    assert_eq!(view["parameters"]["seed"], 7);
    id
}

#[tokio::test]
async fn the_three_forms_give_the_same_answers() {
    let app = TestApplication::start().await;
    let path = "/sessions";
    let query = [
        ("box", BOX),
        ("preset", "paper"),
        ("seed", "7"),
        ("parameters", r#"{"alpha":0.25}"#),
    ];
    let raw = id_of(&app, app.create(pictures::png(0), &query).await).await;
    let form = Form::new().part("frame", part(pictures::png(0)));
    let form = form
        .text("box", BOX)
        .text("preset", "paper")
        .text("seed", "7");
    let form = form.text("parameters", r#"{"alpha": 0.25}"#);
    let multipart = id_of(&app, post_form(&app, Method::POST, path, form).await).await;
    let body = json!({
        "frame": base64(pictures::png(0)), "box": {"x": 20, "y": 15, "width": 16, "height": 12},
        "preset": "paper", "seed": 7, "parameters": {"alpha": 0.25},
    });
    let as_json = id_of(&app, post_json(&app, Method::POST, path, &body).await).await;

    let frames = |id: &str| format!("/sessions/{id}/frames");
    let a = app.post_frame(&raw, pictures::png(1)).await;
    let form = Form::new().part("frame", part(pictures::png(1)));
    let b = post_form(&app, Method::POST, &frames(&multipart), form).await;
    let body = json!({"frame": base64(pictures::png(1))});
    let c = post_json(&app, Method::POST, &frames(&as_json), &body).await;
    let a = expect(a, StatusCode::OK).await;
    assert_eq!(a["frame"], 1);
    assert_eq!(a, expect(b, StatusCode::OK).await);
    assert_eq!(a, expect(c, StatusCode::OK).await);

    let target = |id: &str| format!("/sessions/{id}/target");
    let a = app
        .put_target(&raw, pictures::png(2), &[("box", "24,17,16,12")])
        .await;
    let form = Form::new().part("frame", part(pictures::png(2)));
    let form = form.text("box", r#"{"x": 24, "y": 17, "width": 16, "height": 12}"#);
    let b = post_form(&app, Method::PUT, &target(&multipart), form).await;
    let body = json!({"frame": base64(pictures::png(2)), "box": "24,17,16,12"});
    let c = post_json(&app, Method::PUT, &target(&as_json), &body).await;
    let a = expect(a, StatusCode::OK).await;
    assert_eq!(a["frame"], 2);
    assert_eq!(a, expect(b, StatusCode::OK).await);
    assert_eq!(a, expect(c, StatusCode::OK).await);

    let mut singly = Vec::new();
    for t in 3..6 {
        singly.push(app.track(&raw, t).await);
    }
    let three = self::form((3..6).map(pictures::png));
    let b = post_form(&app, Method::POST, &frames(&multipart), three).await;
    let body = json!({"frames": (3..6).map(|t| base64(pictures::png(t))).collect::<Vec<_>>()});
    let c = post_json(&app, Method::POST, &frames(&as_json), &body).await;
    let mut answers = singly[2].clone();
    answers["answers"] = singly.into();
    assert_eq!(answers, expect(b, StatusCode::OK).await);
    assert_eq!(answers, expect(c, StatusCode::OK).await);
}

/// A client in Python or JavaScript may write 46.0 for 46, which JSON does not tell apart.
#[tokio::test]
async fn a_float_without_a_fraction_is_a_whole_number() {
    let app = TestApplication::start().await;
    let body = |mut settings: Value| {
        settings["frame"] = base64(pictures::png(0)).into();
        settings["box"] = BOX.into();
        settings["verbose"] = true.into();
        settings
    };
    for (settings, seed) in [
        (json!({"seed": 46.0}), 46),
        (json!({"parameters": {"seed": 47.0}}), 47),
    ] {
        let created = post_json(&app, Method::POST, "/sessions", &body(settings)).await;
        let created = expect(created, StatusCode::CREATED).await;
        assert_eq!(created["parameters"]["seed"], seed);
    }
    let settings = json!({"parameters": {"seed": 46.5}});
    let refused = post_json(&app, Method::POST, "/sessions", &body(settings)).await;
    expect_problem(refused, "invalid-parameter").await;
}

#[tokio::test]
async fn a_raw_body_needs_no_right_content_type() {
    let app = TestApplication::start().await;
    for media_type in [
        "application/x-www-form-urlencoded",
        "image/jpeg",
        "text/plain",
        "nonsense",
    ] {
        let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
        let request = request
            .header("content-type", media_type)
            .body(pictures::png(0));
        let response = request.send().await.unwrap();
        assert_eq!(response.status(), StatusCode::CREATED, "{media_type}");
    }
    // The label that `curl -d '{...}'` sends.
    let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
    let request = request.header("content-type", "application/x-www-form-urlencoded");
    let body = json!({"frame": base64(pictures::png(0))}).to_string();
    let response = request.body(body).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::CREATED);
}

#[tokio::test]
async fn base64_may_be_a_data_url_broken_into_lines_or_unpadded() {
    let app = TestApplication::start().await;
    let plain = base64(pictures::png(0));
    let lines: Vec<&str> = plain
        .as_bytes()
        .chunks(76)
        .map(|line| str::from_utf8(line).unwrap())
        .collect();
    for frame in [
        format!("data:image/png;base64,{plain}"),
        lines.join("\n"),
        plain.trim_end_matches('=').to_owned(),
    ] {
        let body = json!({"frame": frame, "box": BOX});
        let response = post_json(&app, Method::POST, "/sessions", &body).await;
        assert_eq!(response.status(), StatusCode::CREATED);
    }
}

#[tokio::test]
async fn base64_for_urls_is_named() {
    let app = TestApplication::start().await;
    let frame = BASE64_URL_SAFE.encode([0xFF, 0xD8, 0xFF, 0xE0]);
    let body = json!({"frame": frame, "box": BOX});
    let refused = post_json(&app, Method::POST, "/sessions", &body).await;
    expect_detail(refused, "malformed-request", &["for URLs", "`+`"]).await;
}

#[tokio::test]
async fn unknown_and_doubled_names_are_refused_and_the_known_ones_named() {
    let app = TestApplication::start().await;
    let png = pictures::png(0);
    let query = [("bxo", BOX)];
    let by_query = app.create(png.clone(), &query).await;
    let form = Form::new()
        .part("frame", part(png.clone()))
        .text("bxo", BOX);
    let by_form = post_form(&app, Method::POST, "/sessions", form).await;
    let body = json!({"frame": base64(png.clone()), "bxo": BOX});
    let by_json = post_json(&app, Method::POST, "/sessions", &body).await;
    for response in [by_query, by_form, by_json] {
        expect_detail(response, "malformed-request", &["`bxo`", "`box`"]).await;
    }
    let form = Form::new()
        .part("frame", part(png.clone()))
        .text("box", BOX)
        .text("box", BOX);
    let doubled = post_form(&app, Method::POST, "/sessions", form).await;
    expect_detail(doubled, "malformed-request", &["twice"]).await;
}

#[tokio::test]
async fn a_setting_of_the_body_counts_before_that_of_the_query() {
    let app = TestApplication::start().await;
    let query = [("box", "1,2,30,40"), ("seed", "1"), ("verbose", "")];
    let form = || {
        let frame = part(pictures::png(0));
        Form::new().part("frame", frame).text("box", BOX)
    };
    let body = json!({"frame": base64(pictures::png(0)), "box": BOX});
    let request = || app.request(Method::POST, "/sessions", &query);
    for request in [request().multipart(form()), request().json(&body)] {
        let created = expect(request.send().await.unwrap(), StatusCode::CREATED).await;
        assert_eq!(created["box"]["x"], 20.0, "{created}");
        assert_eq!(created["parameters"]["seed"], 1, "{created}");
    }
}

#[tokio::test]
async fn what_cannot_be_read_is_a_problem_in_every_form() {
    let app = TestApplication::start().await;
    let post = |media_type: &str, body: &str| {
        let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
        let request = request
            .header("content-type", media_type)
            .body(body.to_owned());
        async { request.send().await.unwrap() }
    };
    for body in [
        "{",
        "[]",
        "",
        r#"{"frame": 5}"#,
        r#"{"frame": "%%"}"#,
        r#"{"frame": "data:x"}"#,
    ] {
        expect_problem(post("application/json", body).await, "malformed-request").await;
    }
    for (media_type, body) in [
        ("multipart/form-data", "x"),
        ("multipart/form-data; boundary=b", "--b\r\ncut short"),
    ] {
        expect_problem(post(media_type, body).await, "malformed-request").await;
    }
    for query in [
        [("box", "1,2,3")],
        [("seed", "-1")],
        [("preset", "best")],
        [("parameters", "7")],
    ] {
        let response = app.create(pictures::png(0), &query).await;
        expect_problem(response, "malformed-request").await;
    }
    for body in ["{}", r#"{"frame": null}"#, r#"{"frame": ""}"#] {
        expect_problem(post("application/json", body).await, "missing-frame").await;
    }
}

#[tokio::test]
async fn json_with_very_many_values_is_refused_before_it_is_parsed() {
    let (app, id) = TestApplication::with_session().await;
    let fields: Vec<String> = (0..1000).map(|n| format!("\"f{n}\": 1")).collect();
    for (body, slug) in [
        (
            format!("{{\"frames\": [{}\"\"]}}", "\"\",".repeat(1_000_000)),
            "too-many-frames",
        ),
        (format!("{{{}}}", fields.join(",")), "malformed-request"),
    ] {
        let request = app.frames_request(&id, &[]);
        let response = request.body(body).send().await.unwrap();
        expect_problem(response, slug).await;
    }
    let body = json!({"frame": base64(pictures::png(0)), "box": BOX, "parameters": " ".repeat(20_000) + "{}"});
    let response = post_json(&app, Method::POST, "/sessions", &body).await;
    assert_eq!(response.status(), StatusCode::CREATED, "spaces are trimmed");
    let long = format!("{{\"alpha\": 0.5{}}}", "0".repeat(20_000));
    let body = json!({"frame": base64(pictures::png(0)), "box": BOX, "parameters": long});
    let response = post_json(&app, Method::POST, "/sessions", &body).await;
    expect_problem(response, "malformed-request").await;
}

#[tokio::test]
async fn a_bad_frame_in_a_batch_is_named_and_none_is_tracked() {
    let (app, id) = TestApplication::with_session().await;
    let path = format!("/sessions/{id}/frames");
    for (bad, slug) in [
        (b"no image".to_vec(), "unsupported-image"),
        (pictures::png(2)[..200].to_vec(), "frame-damaged"),
        (pictures::png_of(50, 50), "frame-size-mismatch"),
        (Vec::new(), "missing-frame"),
    ] {
        let form = Form::new()
            .part("frame", part(pictures::png(1)))
            .part("frame", part(bad));
        let problem = expect_problem(post_form(&app, Method::POST, &path, form).await, slug).await;
        assert_eq!(problem["index"], 1);
        assert!(
            problem["detail"]
                .as_str()
                .unwrap()
                .starts_with("Frame 2 of 2"),
            "{problem}"
        );
        assert_eq!(app.frames_of(&id).await, 1);
    }
}

#[tokio::test]
async fn a_file_that_curl_sent_as_text_is_recognised() {
    let (app, id) = TestApplication::with_session().await;
    let frame = pictures::png(1);
    let stripped: Vec<u8> = frame
        .iter()
        .copied()
        .filter(|byte| !b"\0\r\n".contains(byte))
        .collect();
    let send = async |body: Vec<u8>| {
        let request = app.frames_request(&id, &[]);
        let request = request.header("content-type", "application/x-www-form-urlencoded");
        request.body(body).send().await.unwrap()
    };
    expect_detail(send(stripped).await, "frame-damaged", &["--data-binary"]).await;
    // The user left out the `@` before the name of the file.
    let name = send(b"clip/img/0001.jpg".to_vec()).await;
    expect_detail(name, "unsupported-image", &["text", "`-F frame=@file`"]).await;
    // Base64 text without its line breaks, as curl sends it, is still complete.
    let text = BASE64_STANDARD.encode(&frame);
    let lines: Vec<&[u8]> = text.as_bytes().chunks(76).collect();
    let url = format!("data:image/png;base64,{text}").into_bytes();
    for text in [lines.concat(), lines.join(&b'\n'), url] {
        let says = ["base64", "`curl --data-binary @file`"];
        expect_detail(send(text).await, "unsupported-image", &says).await;
    }
    // This is how curl labels a whole file.
    expect(send(frame).await, StatusCode::OK).await;
}
