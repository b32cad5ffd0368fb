//! Sessions over a WebSocket.

use crate::application::{TestApplication, expect};
use crate::helpers::slow_line::SlowLine;
use crate::pictures;
use crate::requests::lines::posted;
use crate::stream_client::{Received, StreamClient};
use bagtrack::http::Secret;
use image::ImageFormat;
use reqwest::StatusCode;
use serde_json::Value;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

pub fn problem_slug(message: &Value) -> &str {
    let kind = message["type"].as_str();
    let kind = kind.unwrap_or_else(|| panic!("{message} is no problem"));
    kind.strip_prefix("/docs/problems#").unwrap()
}

#[tokio::test]
async fn frames_sent_ahead_get_the_answers_of_plain_posts_in_order() {
    let app = TestApplication::start().await;
    let expected = posted(&app, 20).await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    assert_eq!(stream.next, 1);
    for t in 1..=20 {
        if t % 2 == 0 {
            stream.say(format!(r#"{{"frame": {t}}}"#)).await;
        }
        stream.send(pictures::png(t)).await;
    }
    for answer in expected {
        assert_eq!(stream.message().await, answer);
    }
    stream.close().await;
    assert_eq!(app.frames_of(&id).await, 21);
}

#[tokio::test]
async fn a_box_before_a_frame_corrects_the_target() {
    let (app, id) = TestApplication::with_session().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    stream.say(r#"{"box": [22, 16, 16, 12]}"#).await;
    stream.say(r#"{"frame": 1}"#).await;
    stream.send(pictures::png(1)).await;
    stream.send(pictures::png(2)).await;
    let corrected = stream.message().await;
    assert_eq!(corrected["box"]["x"], 22.0);
    assert_eq!(
        (corrected["frame"].as_u64(), corrected["score"].as_f64()),
        (Some(1), Some(1.0))
    );
    assert_eq!(stream.message().await["frame"], 2);
    // A frame sent as text is answered by a problem at once: otherwise the client would wait for an answer forever.
    stream.say(&"A".repeat(5000)).await;
    let as_text = stream.message().await;
    assert_eq!(problem_slug(&as_text), "malformed-request");
    assert!(
        as_text["detail"].as_str().unwrap().contains("binary"),
        "{as_text}"
    );
    // A bad header is a problem even if a good one follows, and so are headers for two targets of one frame.
    for earlier in [r#"{"box": 1}"#, r#"{"see": true, "target": 1}"#] {
        stream.say(earlier).await;
        stream.say(r#"{"box": [22, 16, 16, 12]}"#).await;
        stream.send(pictures::png(3)).await;
        assert_eq!(problem_slug(&stream.message().await), "malformed-request");
    }
}

#[tokio::test]
async fn what_the_tracker_saw_is_told_where_it_is_asked_for() {
    let app = TestApplication::start().await;
    let expected = posted(&app, 2).await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    stream.say(r#"{"see": true}"#).await;
    stream.send(pictures::png(1)).await;
    stream.send(pictures::png(2)).await;
    let mut answer = stream.message().await;
    let particles = answer["particles"].take();
    let particles: Vec<[f64; 4]> = serde_json::from_value(particles).unwrap();
    let votes: Vec<f64> = serde_json::from_value(answer["votes"].take()).unwrap();
    assert!((20..=200).contains(&particles.len()), "{particles:?}");
    assert!(
        particles.is_sorted_by(|a, b| a[3] >= b[3]),
        "likeliest first"
    );
    let sum: f64 = particles.iter().map(|particle| particle[3]).sum();
    assert!((0.5..=1.001).contains(&sum), "{sum}");
    // The likeliest particle is near the middle of the answered box, at (22, 16) with 16 x 12 pixels.
    let [x, y, width, _] = particles[0];
    assert!((x - 30.0).abs() < 3.0 && (y - 22.0).abs() < 3.0 && (width - 16.0).abs() < 3.0);
    assert!((votes.iter().sum::<f64>() - 1.0).abs() < 0.01, "{votes:?}");
    // `see` does not change the answer, and applies to one frame only.
    let answer = answer.as_object_mut().unwrap();
    answer.retain(|name, _| name != "particles" && name != "votes");
    assert_eq!(Value::Object(answer.clone()), expected[0]);
    assert_eq!(stream.message().await, expected[1]);
}

#[tokio::test]
async fn a_refused_frame_gets_its_problem_in_its_place_and_changes_nothing() {
    let app = TestApplication::start().await;
    let expected = posted(&app, 2).await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    stream.send(pictures::png(1)).await;
    stream.send(b"no image".to_vec()).await;
    stream.say(r#"{"frame": 9}"#).await;
    stream.send(pictures::png(2)).await;
    stream.say("{").await;
    stream.send(pictures::png(2)).await;
    stream.send(Vec::new()).await;
    stream.send(pictures::png_of(64, 48)).await;
    stream.send(pictures::png(2)).await;
    assert_eq!(stream.message().await, expected[0]);
    assert_eq!(problem_slug(&stream.message().await), "unsupported-image");
    let early = stream.message().await;
    assert_eq!(problem_slug(&early), "frame-out-of-order");
    assert_eq!(early["expected_frame"], 2);
    assert_eq!(early["instance"], format!("/sessions/{id}/stream"));
    assert_eq!(problem_slug(&stream.message().await), "malformed-request");
    assert_eq!(problem_slug(&stream.message().await), "missing-frame");
    assert_eq!(problem_slug(&stream.message().await), "frame-size-mismatch");
    assert_eq!(stream.message().await, expected[1]);
}

#[tokio::test]
async fn after_a_broken_line_nothing_is_lost_and_nothing_tracked_twice() {
    let app = TestApplication::start().await;
    let expected = posted(&app, 12).await;
    let id = app.open().await;
    let line = SlowLine::to(app.address, Duration::from_millis(20)).await;
    let mut stream = StreamClient::try_open(line.address, &id, "", &[])
        .await
        .unwrap();
    for t in 1..=8 {
        stream.send(pictures::png(t)).await;
    }
    // The connection breaks after two answers, while others are in flight.
    let mut answers = vec![stream.message().await, stream.message().await];
    line.cut();
    while let Received::Message(answer) = stream.receive().await {
        answers.push(answer);
    }
    let from = answers.len() as u64 + 1;
    let query = format!("?from={from}");
    let mut stream = StreamClient::open(app.address, &id, &query).await;
    assert!(stream.next >= from);
    for _ in from..stream.next {
        let mut answer = stream.message().await;
        assert_eq!(answer["replayed"].take(), true);
        answer.as_object_mut().unwrap().remove("replayed");
        answers.push(answer);
    }
    for t in stream.next..=12 {
        stream.send(pictures::png(t as u32)).await;
        answers.push(stream.message().await);
    }
    assert_eq!(answers, expected);
    assert_eq!(app.frames_of(&id).await, 13);

    // `from` must name a stored answer. A refused stream does not end the present one.
    for (query, next) in [("?from=14", 13), ("?from=99", 13)] {
        let refused = StreamClient::try_open(app.address, &id, query, &[]).await;
        let response = refused.err().expect("a refusal");
        assert_eq!(response.status(), StatusCode::CONFLICT);
        let problem: Value = serde_json::from_slice(response.body().as_ref().unwrap()).unwrap();
        assert_eq!(problem["expected_frame"], next);
    }
    stream.send(pictures::png(13)).await;
    assert_eq!(stream.message().await["frame"], 13);
}

#[tokio::test]
async fn a_newer_stream_ends_the_older_one() {
    let (app, id) = TestApplication::with_session().await;
    let mut old = StreamClient::open(app.address, &id, "").await;
    old.send(pictures::png(1)).await;
    assert_eq!(old.message().await["frame"], 1);
    let mut new = StreamClient::open(app.address, &id, "?from=2").await;
    assert_eq!(new.next, 2);
    assert_eq!(old.close_code().await, 4409);
    new.send(pictures::png(2)).await;
    assert_eq!(new.message().await["frame"], 2);
}

#[tokio::test]
async fn the_newest_frame_wins_where_that_is_asked_for() {
    // One worker, and frames that take it some time.
    let app = TestApplication::start_with(|config| config.workers = Some(1)).await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "?drop").await;
    let frames: Vec<Vec<u8>> = (1..=60).map(pictures::png).collect();
    for frame in frames {
        stream.send(frame).await;
    }
    let (mut answered, mut skipped) = (0, 0);
    while answered + skipped < 60 {
        let answer = stream.message().await;
        answered += 1;
        assert_eq!(answer["frame"], answered);
        skipped += answer["skipped"].as_u64().unwrap_or(0);
    }
    assert_eq!(answered + skipped, 60);
    assert_eq!(app.frames_of(&id).await, answered + 1);
    // Live streams refuse numbers, which would be wrong after the first skipped frame.
    stream.say(r#"{"frame": 1}"#).await;
    stream.send(pictures::png(1)).await;
    assert_eq!(problem_slug(&stream.message().await), "malformed-request");
}

#[tokio::test]
async fn a_page_opens_a_stream_with_its_token_as_a_protocol() {
    let app = TestApplication::start_with(|config| {
        config.access.api_keys = vec![Secret::from("me:0123456789abcdef")];
        config.cors_origins = vec!["https://page.example".to_owned()];
    });
    let app = app.await;
    let (id, other) = (app.open().await, app.open().await);
    let token = app.made_token(&id, &[("seconds", "100")]).await;
    let token = token["token"].as_str().unwrap();
    let offer = format!("bagtrack, {token}");
    let open = async |id: &str, headers: &[(&'static str, &str)]| {
        let opened = StreamClient::try_open(app.address, id, "", headers).await;
        opened.map_err(|response| response.status().as_u16())
    };
    let protocol = ("sec-websocket-protocol", offer.as_str());
    let mut stream = open(&id, &[protocol, ("origin", "https://page.example")])
        .await
        .unwrap();
    stream.send(pictures::png(1)).await;
    assert_eq!(stream.message().await["frame"], 1);

    let refused = async |id: &str, headers: &[(&'static str, &str)]| open(id, headers).await.err();
    assert_eq!(refused(&id, &[]).await, Some(401));
    assert_eq!(
        refused(&other, &[protocol]).await,
        Some(404),
        "another session"
    );
    let key = ("sec-websocket-protocol", "bagtrack, 0123456789abcdef");
    assert_eq!(
        refused(&id, &[key]).await,
        Some(401),
        "a key is no protocol"
    );
    let elsewhere = ("origin", "https://elsewhere.example");
    assert_eq!(refused(&id, &[protocol, elsewhere]).await, Some(403));

    // The stream ends with the token.
    app.clock.advance(Duration::from_secs(101));
    stream.send(pictures::png(2)).await;
    assert_eq!(problem_slug(&stream.message().await), "unauthorized");
    assert_eq!(stream.close_code().await, 4401);
}

#[tokio::test]
async fn a_stream_ends_with_its_session() {
    let app = TestApplication::start().await;
    let (id, other) = (app.open().await, app.open().await);
    let mut deleted = StreamClient::open(app.address, &id, "").await;
    let mut expired = StreamClient::open(app.address, &other, "").await;
    app.delete_session(&id).await;
    deleted.send(pictures::png(1)).await;
    assert_eq!(problem_slug(&deleted.message().await), "session-not-found");
    assert_eq!(deleted.close_code().await, 4404);
    app.clock.advance(Duration::from_secs(600));
    expired.send(pictures::png(1)).await;
    assert_eq!(problem_slug(&expired.message().await), "session-expired");
    assert_eq!(expired.close_code().await, 4410);
}

#[tokio::test]
async fn an_idle_stream_is_pinged_and_a_silent_one_closed() {
    let ping = Duration::from_millis(300);
    let app = TestApplication::start_with(|config| config.limits.ping_interval = ping).await;
    let id = app.open().await;
    let silent = StreamClient::open(app.address, &id, "").await;
    let bytes = silent.ignore_pings().await;
    // An unmasked ping without content.
    assert!(bytes.starts_with(&[0x89, 0]), "{bytes:?}");
    // A stream that sends nothing sees its session end at the next ping.
    let mut idle = StreamClient::open(app.address, &id, "").await;
    app.clock.advance(Duration::from_secs(600));
    assert_eq!(problem_slug(&idle.message().await), "session-expired");
}

#[tokio::test]
async fn a_stream_has_the_quotas_and_limits_of_posts() {
    let app = TestApplication::start_with(|config| config.limits.client_frame_rate = 100).await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    // More than the 100 frames that may come at once, the first one included: the rest is delayed by the rate limit.
    let started = Instant::now();
    for t in 1..=130 {
        stream.send(pictures::png(t % 20)).await;
    }
    for t in 1..=130 {
        assert_eq!(stream.message().await["frame"], t);
    }
    assert!(started.elapsed() > Duration::from_millis(250));
    drop(stream);

    let (app, id) = TestApplication::with_session().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    stream.send(vec![0; 400 << 10]).await;
    let refused = stream.message().await;
    assert_eq!(problem_slug(&refused), "malformed-request", "{refused}");
    assert_eq!(stream.close_code().await, 4400);
    assert_eq!(app.frames_of(&id).await, 1);
}

#[tokio::test]
async fn a_service_that_ends_answers_what_has_come_and_closes_its_streams() {
    let mut app = TestApplication::start().await;
    let id = app.open().await;
    let mut stream = StreamClient::open(app.address, &id, "").await;
    stream.send(pictures::png(1)).await;
    assert_eq!(stream.message().await["frame"], 1);
    app.shut_down();
    assert_eq!(stream.close_code().await, 1001);
    assert!(app.ended().await);
}

/// A textured scene of 640 x 480 pixels, as a camera of a phone would send it.
fn large_jpeg(t: u32) -> Vec<u8> {
    let picture = image::GrayImage::from_fn(640, 480, |x, y| {
        let (dx, dy) = (x.wrapping_sub(200 + 2 * t), y.wrapping_sub(150 + t));
        image::Luma([if dx < 80 && dy < 60 {
            150 + ((dx / 5 * 25) ^ (dy / 5 * 9)) as u8 % 100
        } else {
            40 + ((x / 4 * 3) ^ (y / 4 * 7)) as u8 % 60
        }])
    });
    pictures::encode(picture, ImageFormat::Jpeg)
}

/// Tries several times: a busy machine may delay the far line by chance, but a stream that waits for each answer is
/// always late.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_does_not_wait_a_round_trip_for_each_frame() {
    const FRAMES: u32 = 100;
    const ROUND_TRIP: Duration = Duration::from_millis(80);
    let app = TestApplication::start().await;
    let line = SlowLine::to(app.address, ROUND_TRIP / 2).await;
    let mut late = Vec::new();
    while late.len() < 3 {
        let near = time_of_frames(&app, app.address, FRAMES).await;
        let far = time_of_frames(&app, line.address, FRAMES).await;
        let rate = f64::from(FRAMES) / far.as_secs_f64();
        println!("{rate:.1} frames/s over a round trip of 80 ms: {far:?}, and {near:?} without it");
        // A stream that waits for each answer takes a hundred round trips longer: eight seconds.
        if far < near + FRAMES * ROUND_TRIP * 3 / 4 {
            return;
        }
        late.push((near, far));
    }
    panic!("{late:?}");
}

/// The time of a stream of large frames through this address, with eight of them in flight.
async fn time_of_frames(app: &TestApplication, address: SocketAddr, count: u32) -> Duration {
    let frames: Vec<Vec<u8>> = (0..20).map(large_jpeg).collect();
    let there_and_back = |i: usize| match (i / 20).is_multiple_of(2) {
        true => i % 20,
        false => 19 - i % 20,
    };
    let created = app
        .create(frames[0].clone(), &[("box", "200,150,80,60")])
        .await;
    let created = expect(created, StatusCode::CREATED).await;
    let id = created["id"].as_str().unwrap();
    let mut stream = StreamClient::try_open(address, id, "", &[]).await.unwrap();
    let started = Instant::now();
    let mut sent = 0;
    for answered in 0..count {
        while sent < count && sent < answered + 8 {
            let frame = frames[there_and_back(sent as usize)].clone();
            stream.send(frame).await;
            sent += 1;
        }
        assert_eq!(stream.message().await["frame"], answered + 1);
    }
    started.elapsed()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_without_a_frame_have_a_rate_and_a_frame_after_them_its_answer() {
    let (app, id) = TestApplication::with_session().await;
    let mut client = StreamClient::open(app.address, &id, "").await;
    // Unmasked by a mask of zeros: `{}` as text, 22,000 times. The client may send 2,000 at once and 10,000 a second.
    let text = [0x81, 0x82, 0, 0, 0, 0, b'{', b'}'];
    let sent = Instant::now();
    for _ in 0..22 {
        client.send_raw(&text.repeat(1_000)).await;
    }
    client.send(pictures::png(1)).await;
    let answer = client.message().await;
    assert_eq!(answer["frame"], 1, "{answer}");
    // Reading them all in one turn of the network thread would take less, and hold up its other connections.
    let took = sent.elapsed();
    assert!(took > Duration::from_millis(1_500), "{took:?}");
    // Pings and empty fragments count like texts.
    let ping = [0x89, 0x80, 0, 0, 0, 0];
    let sent = Instant::now();
    for _ in 0..12 {
        client.send_raw(&ping.repeat(1_000)).await;
    }
    client.send(pictures::png(2)).await;
    assert_eq!(client.message().await["frame"], 2);
    assert!(
        sent.elapsed() > Duration::from_millis(800),
        "{:?}",
        sent.elapsed()
    );
}

/// Sends these bytes of a message ten times a second, until the service says that the message is too slow.
async fn expect_too_slow(mut client: StreamClient, bytes: &[u8]) {
    let problem = loop {
        client.send_raw(bytes).await;
        tokio::select! {
            // If the problem is there when the pause ends, the stream has ended, and nothing more can be sent.
            biased;
            problem = client.message() => break problem,
            () = tokio::time::sleep(Duration::from_millis(100)) => {}
        }
    };
    assert_eq!(problem["type"], "/docs/problems#body-timeout", "{problem}");
    assert_eq!(client.close_code().await, 4408);
}

#[tokio::test]
async fn a_message_has_the_time_of_a_body_however_fast_its_bytes_come() {
    let app = TestApplication::start_with(|config| config.body_timeout = Duration::from_secs(1));
    let app = app.await;
    let id = app.open().await;
    let mut client = StreamClient::open(app.address, &id, "").await;
    // A message of 200 kB, at ten times the least rate.
    client
        .send_raw(&[0x82, 0xFF, 0, 0, 0, 0, 0, 3, 0x0D, 0x40, 0, 0, 0, 0])
        .await;
    expect_too_slow(client, &[0; 4_096]).await;
}

#[tokio::test]
async fn a_message_of_empty_frames_without_end_is_too_slow() {
    let app = TestApplication::start_with(|config| config.body_timeout = Duration::from_secs(1));
    let app = app.await;
    let id = app.open().await;
    let mut client = StreamClient::open(app.address, &id, "").await;
    // A fragmented message of one byte and empty fragments without end, at more than the client's rate of frames. The
    // rate limit delays the fragments, but that must not extend the time of the message.
    client.send_raw(&[0x02, 0x81, 0, 0, 0, 0, 7]).await;
    expect_too_slow(client, &[0x00, 0x80, 0, 0, 0, 0].repeat(2_000)).await;
}
