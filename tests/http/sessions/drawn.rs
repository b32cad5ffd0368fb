//! Answers as pictures.

use crate::application::{TestApplication, expect, expect_detail, expect_problem};
use crate::pictures;
use crate::requests::forms::form;
use crate::sessions::targets::{BOXES, open_with};
use image::RgbImage;
use reqwest::{Method, Response, StatusCode};
use serde_json::Value;

async fn drawn(app: &TestApplication, id: &str, query: &[(&str, &str)], t: u32) -> Response {
    let request = app.frames_request(id, query);
    let request = request.header("accept", "image/png, */*;q=0.1");
    request.body(pictures::png(t)).send().await.unwrap()
}

/// The answer in the header, and the picture.
async fn picture(response: Response) -> (Value, RgbImage) {
    assert_eq!(response.status(), StatusCode::OK);
    assert_eq!(response.headers()["content-type"], "image/png");
    let answer = serde_json::from_slice(response.headers()["answer"].as_bytes()).unwrap();
    let bytes = response.bytes().await.unwrap();
    (answer, image::load_from_memory(&bytes).unwrap().to_rgb8())
}

fn is_green([red, green, blue]: [u8; 3]) -> bool {
    green > 180 && red < 90 && blue < 110
}

/// How many pixels in the middle of the box's upper edge are green.
fn green_at_the_edge(picture: &RgbImage, target: &Value) -> usize {
    let side = |name: &str| target[name].as_f64().unwrap();
    let (x, y) = (side("x").round() as u32, side("y").round() as u32);
    let across = x + 2..x + side("width") as u32 - 2;
    across
        .filter(|x| is_green(picture.get_pixel(*x, y).0))
        .count()
}

fn changed(picture: &RgbImage, t: u32) -> usize {
    let plain = pictures::scene(t);
    let pairs = picture.pixels().zip(plain.pixels());
    let far =
        |(a, b): &(&image::Rgb<u8>, &image::Luma<u8>)| a.0.iter().any(|v| v.abs_diff(b.0[0]) > 2);
    pairs.filter(far).count()
}

#[tokio::test]
async fn the_picture_has_the_box_and_the_particles_and_the_header_the_answer() {
    let app = TestApplication::start().await;
    let (id, twin) = (app.open().await, app.open().await);
    for t in 1..=3 {
        let (answer, picture) = picture(drawn(&app, &id, &[], t).await).await;
        assert_eq!(picture.dimensions(), (pictures::WIDTH, pictures::HEIGHT));
        let plain = app.post_frame(&twin, pictures::png(t)).await;
        assert_eq!(answer, expect(plain, StatusCode::OK).await);
        assert!(
            green_at_the_edge(&picture, &answer["box"]) >= 10,
            "{answer}"
        );
    }
    // A frame that is sent again gets the stored answer, which has no particles to draw.
    let number = [("frame", "3")];
    let again = drawn(&app, &id, &number, 3).await;
    assert_eq!(again.headers()["replayed"], "true");
    let (_, again) = picture(again).await;
    let (_, with_particles) = picture(drawn(&app, &id, &[], 4).await).await;
    assert!(changed(&with_particles, 4) > changed(&again, 3) + 20);
    assert!(changed(&again, 3) > 60, "a box of 16 x 12 and a score");
    // Far from the box nothing is drawn.
    assert_eq!(
        again.get_pixel(90, 68).0,
        [pictures::scene(3).get_pixel(90, 68).0[0]; 3]
    );
}

#[tokio::test]
async fn draw_in_the_query_asks_for_a_picture_too() {
    let (app, id) = TestApplication::with_session().await;
    for draw in ["", "true"] {
        let request = app.frames_request(&id, &[("draw", draw)]);
        let response = request.body(pictures::png(1)).send().await.unwrap();
        picture(response).await;
    }
    let request = app.frames_request(&id, &[("draw", "false")]);
    let response = request.body(pictures::png(1)).send().await.unwrap();
    assert_eq!(expect(response, StatusCode::OK).await["frame"], 3);
}

#[tokio::test]
async fn each_of_several_targets_has_its_box() {
    let app = TestApplication::start().await;
    let id = open_with(&app, BOXES).await;
    let (answer, picture) = picture(drawn(&app, &id, &[], 1).await).await;
    for k in [0, 2] {
        let target = &answer["targets"][k];
        assert_eq!(target["status"], "tracking", "{answer}");
        assert!(green_at_the_edge(&picture, &target["box"]) >= 6, "{answer}");
    }
}

#[tokio::test]
async fn what_cannot_be_drawn_is_not_tracked() {
    let (app, id) = TestApplication::with_session().await;
    let path = format!("/sessions/{id}/frames");
    let request = app.request(Method::POST, &path, &[("draw", "true")]);
    let several = form([1, 2].map(pictures::png));
    let several = request.multipart(several).send().await.unwrap();
    expect_detail(several, "malformed-request", &["one frame"]).await;
    let request = app.request(Method::POST, &path, &[("draw", "true")]);
    let bad = request.body("no image").send().await.unwrap();
    expect_problem(bad, "unsupported-image").await;
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_large_frame_is_drawn_smaller_with_its_box_in_place() {
    let app = TestApplication::start().await;
    let frame = pictures::png_of(4096, 512);
    let query = [("box", "2000,200,160,120"), ("seed", "7")];
    let created = app.create(frame.clone(), &query).await;
    let created = expect(created, StatusCode::CREATED).await;
    let path = format!("/sessions/{}/frames", created["id"].as_str().unwrap());
    let request = app.request(Method::POST, &path, &[("draw", "true")]);
    let (answer, picture) = picture(request.body(frame).send().await.unwrap()).await;
    assert_eq!(picture.dimensions(), (2048, 256));
    let target = &answer["box"];
    let half = |name: &str| target[name].as_f64().unwrap() / 2.0;
    let (x, y) = (half("x") + half("width") / 2.0, half("y"));
    let [red, green, blue] = picture.get_pixel(x as u32, y.round() as u32 + 1).0;
    assert!(
        red.abs_diff(green).max(green.abs_diff(blue)) > 60,
        "a gray picture: {answer}"
    );
}

#[tokio::test]
async fn a_frame_of_another_size_is_refused_before_it_is_decoded() {
    // If the service decoded this file, the problem would be the damage.
    let mut damaged = pictures::png_of(64, 48);
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0xFF;
    // Made before the session, which would expire meanwhile on a busy machine.
    let frames = [crate::helpers::heavy::bomb(), damaged];
    let (app, id) = TestApplication::with_session().await;
    let path = format!("/sessions/{id}/frames");
    for frame in frames {
        let request = app
            .request(Method::POST, &path, &[("draw", "")])
            .body(frame);
        expect_problem(request.send().await.unwrap(), "frame-size-mismatch").await;
    }
    assert_eq!(app.frames_of(&id).await, 1);
}
