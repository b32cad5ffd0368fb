//! Several targets in snapshots, over a stream, and without a session.

use crate::application::{TestApplication, expect, expect_problem};
use crate::helpers::forged;
use crate::pictures;
use crate::sessions::targets::{BOXES, open_with};
use crate::stream_client::StreamClient;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

async fn unsigned() -> TestApplication {
    TestApplication::start_with(|config| config.access.unsigned_snapshots = true).await
}

#[tokio::test]
async fn all_targets_go_on_elsewhere_bit_for_bit() {
    let (here, there) = (unsigned().await, unsigned().await);
    let id = open_with(&here, BOXES).await;
    for t in 1..6 {
        here.track(&id, t).await;
    }
    let last = expect(here.get_session(&id).await, StatusCode::OK).await["answer"].clone();
    let restored = there.create(here.snapshot(&id).await, &[]).await;
    let restored = expect(restored, StatusCode::CREATED).await;
    assert_eq!(restored["frame"], 5);
    assert_eq!(restored["boxes"][1], last["targets"][1]["box"]);
    let new = restored["id"].as_str().unwrap();
    let again = there.post_numbered(new, 5, pictures::png(5)).await;
    assert_eq!(again.headers()["replayed"], "true");
    assert_eq!(expect(again, StatusCode::OK).await, last);
    for t in 6..16 {
        let (a, b) = (here.track(&id, t).await, there.track(new, t).await);
        assert_eq!(a, b, "frame {t}");
    }
    assert!(here.snapshot(&id).await == there.snapshot(new).await);
}

#[tokio::test]
async fn a_forged_number_of_targets_is_refused() {
    let app = unsigned().await;
    let id = open_with(&app, BOXES).await;
    let snapshot = app.snapshot(&id).await;
    let mut content = forged::content(&snapshot);
    assert_eq!(content[0], 3);
    let same = forged::with_content(&snapshot, &content);
    for count in [0, 1, 2, 4, 16, 17, 127] {
        content[0] = count;
        let other = forged::with_content(&snapshot, &content);
        expect_problem(app.create(other, &[]).await, "invalid-snapshot").await;
    }
    // Has each target twice. All is well formed, but the stored answers have three targets only.
    let (first, rest): (&[u8], _) = postcard::take_from_bytes(&content[1..]).unwrap();
    assert!(!rest.is_empty());
    let first = postcard::to_stdvec(first).unwrap();
    let twice = [&[4][..], &first, &content[1..]].concat();
    let twice = forged::with_content(&snapshot, &twice);
    expect_problem(app.create(twice, &[]).await, "invalid-snapshot").await;
    expect(app.create(same, &[]).await, StatusCode::CREATED).await;
}

#[tokio::test]
async fn a_stream_answers_for_all_targets_and_corrects_one() {
    let app = TestApplication::start().await;
    let (id, posted) = (open_with(&app, BOXES).await, open_with(&app, BOXES).await);
    let mut stream = StreamClient::open(app.address, &id, "").await;
    for t in 1..=2 {
        stream.send(pictures::png(t)).await;
        assert_eq!(stream.message().await, app.track(&posted, t).await);
    }
    stream.say(r#"{"see": true, "target": 1}"#).await;
    stream.send(pictures::png(3)).await;
    let seen = stream.message().await;
    let target = &seen["targets"][1]["box"];
    let center = target["x"].as_f64().unwrap() + target["width"].as_f64().unwrap() / 2.0;
    let likeliest = seen["particles"][0][0].as_f64().unwrap();
    assert!((likeliest - center).abs() < 4.0, "{seen}");
    for said in [
        r#"{"box": [42, 31, 18, 14]}"#,
        r#"{"see": true, "target": 3}"#,
    ] {
        stream.say(said).await;
        stream.send(pictures::png(4)).await;
        let refused = stream.message().await;
        assert_eq!(refused["type"], "/docs/problems#malformed-request");
    }
    stream
        .say(r#"{"box": [42, 31, 18, 14], "target": 1}"#)
        .await;
    stream.send(pictures::png(4)).await;
    let corrected = stream.message().await;
    assert_eq!(corrected["targets"][1]["box"]["x"], 42.0);
    assert_eq!(corrected["frame"], 4);
    stream.close().await;
    // After a broken connection, the stored answers come again.
    let mut stream = StreamClient::open(app.address, &id, "?from=4").await;
    let mut again = stream.message().await;
    assert_eq!(again["replayed"].take(), true);
    again.as_object_mut().unwrap().remove("replayed");
    assert_eq!(again, corrected);
}

#[tokio::test]
async fn several_targets_are_tracked_without_a_session() {
    let app = unsigned().await;
    let id = open_with(&app, BOXES).await;
    let track = async |body: Value| {
        let request = app.request(Method::POST, "/track", &[]).json(&body);
        request.send().await.unwrap()
    };
    let frame = |t: u32| STANDARD.encode(pictures::png(t));
    let first = track(json!({"frame": frame(0), "boxes": BOXES, "seed": 7})).await;
    let mut tracked = expect(first, StatusCode::OK).await;
    for t in 1..4 {
        let snapshot = tracked["snapshot"].clone();
        let next = track(json!({"frame": frame(t), "snapshot": snapshot})).await;
        tracked = expect(next, StatusCode::OK).await;
        assert_eq!(tracked["targets"], app.track(&id, t).await["targets"]);
    }
    let snapshot = tracked["snapshot"].clone();
    let given = json!({"frame": frame(4), "snapshot": snapshot, "box": "42,31,18,14", "target": 1});
    let corrected = expect(track(given).await, StatusCode::OK).await;
    assert_eq!(corrected["targets"][1]["score"], 1.0);
    let unsaid = json!({"frame": frame(4), "snapshot": snapshot, "box": "42,31,18,14"});
    expect_problem(track(unsaid).await, "malformed-request").await;
}
