//! The page at `/`, and the sample clips that it shows. `tests/page` tests it in a browser.

use crate::application::{TestApplication, expect, expect_problem};
use reqwest::StatusCode;
use std::collections::{BTreeSet, VecDeque};

/// The paths below `/page/` that the text of a file names, each with whether it is loaded together with the file.
fn named(path: &str, text: &str) -> Vec<(String, bool)> {
    let folder = &path[..=path.rfind('/').unwrap()];
    let texts: Vec<&str> = text.split(['"', '\'']).collect();
    let paths = texts.windows(2).filter_map(|pair| {
        let [before, text] = pair else { return None };
        let own = text
            .strip_prefix("./")
            .map(|file| format!("{folder}{file}"));
        let path = own.or(text.starts_with("page/").then(|| format!("/{text}")))?;
        // WebAssembly modules name their imports by such a path, which is no file to load.
        let path = Some(path).filter(|path| !path.ends_with("_bg.js"))?;
        let is_later = before.ends_with("import(") || before.ends_with("URL(");
        (path.ends_with(".js") || path.ends_with(".css")).then_some((path, !is_later))
    });
    paths.collect()
}

#[tokio::test]
async fn every_file_that_the_page_names_is_served_and_all_are_small() {
    let app = TestApplication::start().await;
    let mut open = VecDeque::from([("/".to_owned(), true)]);
    let (mut seen, mut at_once, mut later) = (BTreeSet::new(), 0, 0);
    while let Some((path, is_at_once)) = open.pop_front() {
        if !seen.insert(path.clone()) {
            continue;
        }
        let response = app.get(&path).await;
        assert_eq!(response.status(), StatusCode::OK, "{path}");
        let text = response.text().await.unwrap();
        // The modules are loaded when something is tracked in the page, or a file is opened.
        let bytes = if path.contains("/wasm/") {
            0
        } else {
            text.len()
        };
        *(if is_at_once { &mut at_once } else { &mut later }) += bytes;
        for (path, is_with_it) in named(&path, &text) {
            match is_at_once && is_with_it {
                true => open.push_front((path, true)),
                false => open.push_back((path, false)),
            }
        }
    }
    assert_eq!(seen.len(), 73, "{seen:?}");
    assert!(at_once < 180_000, "{at_once}");
    assert!(later < 210_000, "{later}");
    expect_problem(app.get("/page/none.js").await, "route-not-found").await;
}

#[tokio::test]
async fn the_sample_clip_can_be_tracked() {
    let app = TestApplication::start().await;
    let clip = expect(app.get("/sample/card/clip.json").await, StatusCode::OK).await;
    let truth = clip["truth"].as_array().unwrap();
    assert_eq!(truth.len(), 150);
    let frame = async |index: usize| {
        let response = app.get(&format!("/sample/card/{index}.jpg")).await;
        assert_eq!(response.headers()["content-type"], "image/jpeg");
        assert!(
            response.headers()["cache-control"]
                .to_str()
                .unwrap()
                .contains("max-age")
        );
        response.bytes().await.unwrap().to_vec()
    };
    let values = |index: usize| -> Vec<f64> {
        let row = truth[index].as_array().unwrap();
        row.iter().map(|value| value.as_f64().unwrap()).collect()
    };
    let first: Vec<String> = values(0)[..4].iter().map(f64::to_string).collect();
    let created = app
        .create(frame(0).await, &[("box", &first.join(","))])
        .await;
    let created = expect(created, StatusCode::CREATED).await;
    assert_eq!(created["image"]["width"], clip["width"]);
    let id = created["id"].as_str().unwrap();
    for index in 1..20 {
        let answer = app.post_frame(id, frame(index).await).await;
        let answer = expect(answer, StatusCode::OK).await;
        let off = answer["box"]["x"].as_f64().unwrap() - values(index)[0];
        assert!(off.abs() < 5.0, "frame {index}: {off}");
    }
    assert_eq!(frame(3).await, frame(3).await);
    for path in [
        "/sample/card/150.jpg",
        "/sample/card/-1.jpg",
        "/sample/card/1.png",
        "/sample/none/1.jpg",
        "/sample/none/clip.json",
    ] {
        expect_problem(app.get(path).await, "route-not-found").await;
    }
}
