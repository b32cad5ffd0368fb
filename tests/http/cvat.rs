//! `POST /integrations/cvat`: many shapes in a request, each with a state of its own.

use crate::application::{BOX, TestApplication, expect, expect_problem};
use crate::pictures;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::GrayImage;
use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};

/// A box of another size than that of the target, on the ground.
const OTHER: &str = "60,40,24,20";

async fn call(app: &TestApplication, frame: &[u8], shapes: Value, states: Value) -> Response {
    let body = json!({"image": STANDARD.encode(frame), "shapes": shapes, "states": states});
    let request = app.request(Method::POST, "/integrations/cvat", &[("seed", "7")]);
    request.json(&body).send().await.unwrap()
}

async fn tracked(app: &TestApplication, t: u32, shapes: Value, states: Value) -> Value {
    let answer = call(app, &pictures::png(t), shapes, states).await;
    expect(answer, StatusCode::OK).await
}

/// Left, top, right, bottom of `x,y,width,height`.
fn corners(text: &str) -> Vec<f64> {
    let sides: Vec<f64> = text.split(',').map(|side| side.parse().unwrap()).collect();
    vec![sides[0], sides[1], sides[0] + sides[2], sides[1] + sides[3]]
}

/// The same of the box of an answer, which has two digits after the point.
fn corners_of(answer: &Value) -> Vec<f64> {
    let side = |name: &str| answer["box"][name].as_f64().unwrap();
    let (x, y) = (side("x"), side("y"));
    vec![x, y, x + side("width"), y + side("height")]
}

/// A hundredth of a pixel may be lost with the sum of two rounded numbers.
fn assert_same(shape: &Value, expected: &[f64], what: &str) {
    let shape: Vec<f64> = serde_json::from_value(shape.clone()).unwrap();
    for (got, expected) in shape.iter().zip(expected) {
        assert!((got - expected).abs() < 0.0151, "{what}: {shape:?}");
    }
}

async fn session(app: &TestApplication, first: u32, given: &str) -> String {
    let query = [("box", given), ("seed", "7")];
    let opened = app.create(pictures::png(first), &query).await;
    let opened = expect(opened, StatusCode::CREATED).await;
    opened["id"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn shapes_that_come_and_go_get_the_boxes_of_sessions() {
    let app = TestApplication::start().await;
    let sessions = [session(&app, 0, BOX).await, session(&app, 2, OTHER).await];
    let mut states = tracked(&app, 0, json!([corners(BOX)]), json!([])).await["states"].clone();
    for t in 1..8 {
        // From frame 2 on there is another shape, from frame 6 on only that one.
        let (shapes, first) = match t {
            2 => (json!([null, corners(OTHER)]), 0),
            6 => {
                states = json!([states[1]]);
                (json!([null]), 1)
            }
            _ => (json!([null, null]), usize::from(t > 6)),
        };
        let count = if (2..6).contains(&t) { 2 } else { 1 };
        let shapes = json!(shapes.as_array().unwrap()[..count]);
        let answer = tracked(&app, t, shapes, states).await;
        assert_eq!(answer["shapes"].as_array().unwrap().len(), count);
        for (place, id) in sessions[first..][..count].iter().enumerate() {
            let what = format!("frame {t}, shape {place}");
            if (t, place) == (2, 1) {
                assert_same(&answer["shapes"][1], &corners(OTHER), &what);
                continue;
            }
            let expected = app.post_frame(id, pictures::png(t)).await;
            let expected = expect(expected, StatusCode::OK).await;
            assert_same(&answer["shapes"][place], &corners_of(&expected), &what);
        }
        states = answer["states"].clone();
    }
}

#[tokio::test]
async fn corners_in_any_order_are_the_same_box_and_a_lost_target_has_none() {
    let app = TestApplication::start().await;
    let [left, top, right, bottom] = corners(BOX)[..] else {
        unreachable!("four corners")
    };
    let shapes = json!([[left, top, right, bottom], [right, bottom, left, top]]);
    let first = tracked(&app, 0, shapes, json!([])).await;
    assert_eq!(first["shapes"][0], json!([left, top, right, bottom]));
    assert_eq!(first["shapes"][0], first["shapes"][1]);
    assert_eq!(first["states"][0], first["states"][1]);
    let mut states = json!([first["states"][0]]);
    let mut answer = Value::Null;
    for t in 0..40 {
        let noise = GrayImage::from_fn(pictures::WIDTH, pictures::HEIGHT, |x, y| {
            image::Luma([(x.wrapping_mul(2_654_435_761) ^ (y + t).wrapping_mul(40_503)) as u8])
        });
        let noise = pictures::encode(noise, image::ImageFormat::Png);
        let called = call(&app, &noise, json!([null]), states).await;
        answer = expect(called, StatusCode::OK).await;
        states = answer["states"].clone();
    }
    assert_eq!(answer["shapes"], json!([null]));
}

#[tokio::test]
async fn a_request_that_cannot_be_tracked_is_refused_as_a_whole() {
    let app = TestApplication::start().await;
    let first = tracked(&app, 0, json!([corners(BOX)]), json!([])).await;
    let state = first["states"][0].as_str().unwrap().to_owned();
    let mut changed = STANDARD.decode(&state).unwrap();
    let last = changed.len() - 1;
    changed[last] ^= 1;
    let (frame, larger) = (pictures::png(1), pictures::png_of(200, 100));
    for (what, frame, shapes, states, slug) in [
        (
            "no shape and no state",
            &frame,
            json!([]),
            json!([]),
            "malformed-request",
        ),
        (
            "null alone",
            &frame,
            json!([null]),
            json!([null]),
            "malformed-request",
        ),
        (
            "three numbers",
            &frame,
            json!([[1, 2, 3]]),
            json!([]),
            "malformed-request",
        ),
        (
            "too many",
            &frame,
            json!(vec![corners(BOX); 101]),
            json!([]),
            "malformed-request",
        ),
        (
            "no area",
            &frame,
            json!([[5, 5, 5, 9]]),
            json!([]),
            "invalid-box",
        ),
        (
            "a changed state",
            &frame,
            json!([null, corners(BOX)]),
            json!([STANDARD.encode(&changed)]),
            "invalid-snapshot",
        ),
        (
            "another size",
            &larger,
            json!([null]),
            json!([state]),
            "frame-size-mismatch",
        ),
        (
            "no image",
            &b"GIF".to_vec(),
            json!([corners(BOX)]),
            json!([]),
            "unsupported-image",
        ),
        (
            "an empty image",
            &Vec::new(),
            json!([corners(BOX)]),
            json!([]),
            "malformed-request",
        ),
    ] {
        let answer = call(&app, frame, shapes, states).await;
        assert!(answer.status().is_client_error(), "{what}");
        expect_problem(answer, slug).await;
    }
    // The state is good still.
    tracked(&app, 1, json!([null]), json!([state])).await;
}

#[tokio::test]
async fn a_hundred_shapes_cost_one_decoding() {
    let app = TestApplication::start().await;
    let shapes = json!(vec![corners(BOX); 100]);
    let first = tracked(&app, 0, shapes, json!([])).await;
    assert_eq!(first["states"].as_array().unwrap().len(), 100);
    let page = app.get("/metrics").await.text().await.unwrap();
    let decoded = page
        .lines()
        .find(|line| line.starts_with("bagtrack_frame_decode_seconds_count"));
    assert_eq!(decoded, Some("bagtrack_frame_decode_seconds_count 1"));
}
