//! The bag as a picture.

use crate::application::{BOX, TestApplication, bound_bodies, expect_problem};
use crate::pictures;
use image::RgbImage;
use reqwest::StatusCode;

async fn sheet(app: &TestApplication, id: &str) -> RgbImage {
    let response = app.get(&format!("/sessions/{id}/bag.png")).await;
    assert_eq!(response.status(), StatusCode::OK);
    assert_eq!(response.headers()["content-type"], "image/png");
    let bytes = response.bytes().await.unwrap();
    image::load_from_memory(&bytes).unwrap().to_rgb8()
}

/// The mean brightness of the left and the right half of the first entry's mean vector.
fn halves(sheet: &RgbImage) -> [f64; 2] {
    [4..36, 36..68].map(|columns| {
        let pixels = columns.flat_map(|x| (4..60).map(move |y| (x, y)));
        let values = pixels.map(|(x, y)| f64::from(sheet.get_pixel(x, y).0[1]));
        values.sum::<f64>() / (32.0 * 56.0)
    })
}

#[tokio::test]
async fn the_sheet_has_a_row_for_each_subspace_and_shows_the_target() {
    let app = TestApplication::start().await;
    let params = r#"{"patch_width": 16, "patch_height": 16, "update_every": 2, "basis_dim": 2}"#;
    let query = [("box", BOX), ("preset", "paper"), ("parameters", params)];
    let created = app.opened(&query).await;
    let id = created["id"].as_str().unwrap();
    let before = sheet(&app, id).await;
    for t in 1..=4 {
        app.track(id, t).await;
    }
    let after = sheet(&app, id).await;
    // Two entries more, each 64 pixels high with a gap of 4.
    assert_eq!(after.height(), before.height() + 2 * 68);
    assert_eq!(before.height(), 4 + 68);
    // The mean vector shows the target: it is brighter in the half in which the scene is.
    let target = pictures::scene(0);
    let bright = |columns: std::ops::Range<u32>| {
        let pixels = columns.flat_map(|x| (15..27).map(move |y| (x, y)));
        pixels
            .map(|(x, y)| f64::from(target.get_pixel(x, y).0[0]))
            .sum::<f64>()
    };
    let (left, right) = (bright(20..28), bright(28..36));
    let [shown_left, shown_right] = halves(&before);
    assert!(
        (shown_left - shown_right).abs() > 3.0,
        "{shown_left} {shown_right}"
    );
    assert_eq!(left > right, shown_left > shown_right);
}

#[tokio::test]
async fn gradient_features_have_two_pictures_a_vector() {
    let (app, id) = TestApplication::with_session().await;
    let sheet = sheet(&app, &id).await;
    let step = sheet.height() - 4;
    assert!(sheet.width() > 2 * step, "{:?}", sheet.dimensions());
}

#[tokio::test]
async fn the_sheet_is_charged_to_the_memory_of_bodies() {
    let app = TestApplication::start_with(|config| bound_bodies(config, 30_000, 40_000)).await;
    let id = app.open().await;
    let refused = app.get(&format!("/sessions/{id}/bag.png")).await;
    expect_problem(refused, "quota-exceeded").await;
    app.track(&id, 1).await;
}
