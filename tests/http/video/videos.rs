//! Videos as bodies. Most need ffmpeg.

use crate::application::{
    BOX, TestApplication, behind_a_proxy, expect, expect_detail, expect_problem,
};
use crate::helpers::heavy;
use crate::helpers::video_files::{
    FRAMES, empty_mp4, expect_on_target, made, motion_jpeg, pattern, video,
};
use crate::pictures;
use crate::requests::lines::lines;
use bagtrack_sessions::KEPT_ANSWERS;
use bagtrack_testing::within::within;
use futures_util::future::join_all;
use image::ImageFormat;
use reqwest::{Method, Response, StatusCode};
use std::process::Command;
use std::time::Duration;

async fn post(app: &TestApplication, id: &str, media_type: &str, video: Vec<u8>) -> Response {
    let request = app.frames_request(id, &[]);
    let request = request.header("content-type", media_type);
    request.body(video).send().await.unwrap()
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_video_is_tracked_and_answered_line_by_line() {
    let app = TestApplication::start().await;
    for (media_type, video) in [
        // This MP4 has its index at the end.
        ("video/mp4", video("mp4")),
        ("video/webm", video("webm")),
        ("image/gif", video("gif")),
        ("video/x-motion-jpeg", motion_jpeg()),
        // The label that curl sends by default.
        ("application/x-www-form-urlencoded", video("mp4")),
    ] {
        let id = app.open().await;
        let answers = lines(post(&app, &id, media_type, video).await).await;
        assert_eq!(answers.len(), FRAMES as usize, "{media_type}: {answers:?}");
        for (answer, t) in answers.iter().zip(1..) {
            assert_eq!(answer["frame"], t);
            expect_on_target(answer, t);
        }
        assert_eq!(app.frames_of(&id).await, u64::from(FRAMES) + 1);
    }
}

/// The whole video is sent again, although the answers to its first frames are not stored any more.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_long_video_that_is_sent_again_goes_on() {
    let app = TestApplication::start_with(|config| config.max_frames = 4).await;
    let id = app.open().await;
    let (part, rest) = (motion_jpeg().repeat(3), motion_jpeg());
    let (tracked, all) = (3 * u64::from(FRAMES), 4 * u64::from(FRAMES));
    let whole = [&part[..], &rest].concat();
    let send = async |number: &str, video: &[u8]| {
        let request = app.frames_request(&id, &[("frame", number)]);
        let request = request.header("content-type", "video/x-motion-jpeg");
        request.body(video.to_vec()).send().await.unwrap()
    };
    let told = |answers: &[serde_json::Value]| -> Vec<(u64, bool)> {
        let told = answers.iter();
        told.map(|it| (it["frame"].as_u64().unwrap(), it["replayed"] == true))
            .collect()
    };
    assert_eq!(lines(send("1", &part).await).await.len() as u64, tracked);
    let again = lines(send("1", &whole).await).await;
    let first = tracked + 1 - KEPT_ANSWERS as u64;
    let expected = (first..=all).map(|frame| (frame, frame <= tracked));
    assert_eq!(told(&again), expected.collect::<Vec<_>>());
    assert_eq!(app.frames_of(&id).await, all + 1);

    // A request that ends before the stored answers, or has other frames than they, is refused.
    let problem = expect_problem(send("1", &rest).await, "frame-out-of-order").await;
    assert_eq!(problem["expected_frame"], all + 1);
    let before = pictures::encode(pictures::scene(5), ImageFormat::Jpeg);
    let shifted = [&before[..], &whole].concat();
    expect_problem(send("1", &shifted).await, "frame-differs").await;
    assert_eq!(app.frames_of(&id).await, all + 1);
}

#[tokio::test]
async fn without_ffmpeg_a_video_is_refused_and_the_session_unchanged() {
    for program in ["off", "/nowhere/ffmpeg"] {
        let app = TestApplication::start_with(|config| config.limits.ffmpeg = program.to_owned());
        let app = app.await;
        let id = app.open().await;
        let track = app.request(Method::POST, "/track", &[("box", BOX)]);
        let track = track.header("content-type", "video/mp4").body(empty_mp4());
        let frames = post(&app, &id, "video/mp4", empty_mp4()).await;
        for refused in [frames, track.send().await.unwrap()] {
            expect_detail(refused, "unsupported-image", &["ffmpeg"]).await;
        }
        assert_eq!(app.frames_of(&id).await, 1);
    }
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_video_comes_back_frame_by_frame() {
    let app = TestApplication::start().await;
    for extension in ["mp4", "webm"] {
        let request = app.request(Method::POST, "/frames", &[]);
        let answer = request.body(video(extension)).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{extension}");
        assert_eq!(answer.headers()["content-type"], "video/x-motion-jpeg");
        let bytes = answer.bytes().await.unwrap();
        // The service accepts its own output as a video. In it, the target moves right by 2 pixels a frame.
        let id = app.open().await;
        let answers = lines(post(&app, &id, "video/x-motion-jpeg", bytes.to_vec()).await).await;
        assert_eq!(answers.len(), FRAMES as usize, "{extension}");
        for (answer, t) in answers.iter().zip(1..) {
            expect_on_target(answer, t);
        }
    }
    let request = app.request(Method::POST, "/frames", &[]);
    let refused = request.body(pictures::png(1)).send().await.unwrap();
    expect_detail(refused, "unsupported-image", &["frames of a video"]).await;
    let request = app.request(Method::POST, "/frames", &[]);
    expect_problem(
        request.body(empty_mp4()).send().await.unwrap(),
        "frame-damaged",
    )
    .await;
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_video_of_too_large_pictures_comes_back_as_a_problem() {
    let app = TestApplication::start_with(|config| config.max_frame_pixels = 1000);
    let app = app.await;
    let request = app.request(Method::POST, "/frames", &[]);
    let refused = request
        .body(pattern("mp4", 2, "-vf scale=1280:720 "))
        .send()
        .await
        .unwrap();
    expect_problem(refused, "frame-too-large").await;
}

/// The times in the first comments of concatenated JPEG files, in seconds.
fn times(motion_jpeg: &[u8]) -> Vec<f64> {
    let begins = |window: &[u8]| window == b"\xFF\xD8\xFF\xFE";
    let files = (0..motion_jpeg.len() - 4).filter(|at| begins(&motion_jpeg[*at..at + 4]));
    let comment = |at: usize| {
        let length = u16::from_be_bytes([motion_jpeg[at + 4], motion_jpeg[at + 5]]);
        let comment = str::from_utf8(&motion_jpeg[at + 6..at + 4 + usize::from(length)]).unwrap();
        comment.strip_prefix("time=").unwrap().parse().unwrap()
    };
    files.map(comment).collect()
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn frames_of_a_video_of_a_changing_rate_tell_when_they_are_shown() {
    let app = TestApplication::start().await;
    for extension in ["mp4", "webm"] {
        // Uneven times: the first two of 30 frames a second, then every third.
        let selected = "-vf select=eq(n\\,1)+not(mod(n\\,3)) -vsync vfr ";
        let video = pattern(extension, 5, selected);
        let request = app.request(Method::POST, "/frames", &[]);
        let answer = request.body(video).send().await.unwrap();
        let times = times(&answer.bytes().await.unwrap());
        let expected = [0, 1, 3, 6, 9].map(|frame| f64::from(frame) / 30.0);
        assert_eq!(times.len(), expected.len(), "{extension}: {times:?}");
        // WebM rounds times to milliseconds.
        let apart = times
            .iter()
            .zip(expected)
            .map(|(time, expected)| time - expected);
        assert!(
            apart.into_iter().all(|apart| apart.abs() < 0.001),
            "{extension}: {times:?}"
        );
    }
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn frames_of_a_damaged_video_end_before_the_damage_and_the_answer_is_cut_off() {
    let app = TestApplication::start().await;
    // Before the damage are more pictures than a pipe holds, so that ffmpeg reaches it only after some were read.
    let mut damaged = pattern("webm", 100, "");
    let (start, end) = (damaged.len() * 6 / 10, damaged.len() * 8 / 10);
    damaged[start..end].fill(0);
    let request = app.request(Method::POST, "/frames", &[]);
    let answer = request.body(damaged).send().await.unwrap();
    assert_eq!(answer.status(), 200);
    // The body must be cut off: a complete one would mean that the video has no more pictures.
    let cut_off = answer.bytes().await.unwrap_err();
    assert!(cut_off.is_body() || cut_off.is_decode(), "{cut_off:?}");
}

#[tokio::test]
async fn a_session_is_opened_with_a_picture() {
    let app = TestApplication::start().await;
    let gif = [b"GIF89a".to_vec(), vec![0; 400]].concat();
    let opening = app.create(gif.clone(), &[("box", BOX)]).await;
    expect_detail(opening, "unsupported-image", &["/frames", "picture"]).await;
    let id = app.open().await;
    let request = app.frames_request(&id, &[("draw", "")]);
    let drawn = request.body(gif).send().await.unwrap();
    expect_problem(drawn, "malformed-request").await;
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn what_is_wrong_with_a_video_is_told() {
    let app = TestApplication::start_with(|config| config.limits.max_video_frames = 5).await;
    let id = app.open().await;
    let whole = video("mp4");
    let mut got = lines(post(&app, &id, "video/mp4", whole.clone()).await).await;
    let last = got.pop().unwrap();
    assert_eq!(last["type"], "/docs/problems#too-many-frames");
    assert_eq!(got.len(), 5);
    assert_eq!(app.frames_of(&id).await, 6);
    // Half of the file, without the index at the end.
    let cut = whole[..whole.len() / 2].to_vec();
    let damaged = post(&app, &id, "video/mp4", cut).await;
    expect_detail(damaged, "frame-damaged", &["video"]).await;
    assert_eq!(app.frames_of(&id).await, 6);
    // A playlist is no video, whatever its label says.
    let playlist = b"#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n".to_vec();
    expect_problem(
        post(&app, &id, "video/mp4", playlist).await,
        "unsupported-image",
    )
    .await;

    let created = app.create(pictures::png_of(64, 48), &[("box", BOX)]).await;
    let created = expect(created, reqwest::StatusCode::CREATED).await;
    let other = created["id"].as_str().unwrap();
    expect_problem(
        post(&app, other, "video/mp4", whole).await,
        "frame-size-mismatch",
    )
    .await;
}

/// The last line of ffmpeg, such as "To ignore this, add a trailing '?' to the map", would not help.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn why_a_video_is_not_read_is_told_with_its_cure() {
    const SMALL: &str = "testsrc2=size=320x240:rate=10 -frames:v 10";
    let app = TestApplication::start_with(|config| config.max_frame_pixels = 1 << 20).await;
    let id = app.open().await;
    let whole = video("mp4");
    for (video, slug, words) in [
        (
            made("sound.mp4", "sine=duration=1"),
            "frame-damaged",
            "no pictures",
        ),
        (
            made("clip.mov", &format!("{SMALL} -c:v prores")),
            "unsupported-image",
            "codec",
        ),
        (
            made("clip.mkv", &format!("{SMALL} -c:v ffv1")),
            "unsupported-image",
            "H.264",
        ),
        (
            made("large.mp4", "testsrc2=size=1920x1080 -frames:v 2"),
            "frame-too-large",
            "scale=",
        ),
        // 1,047,552 pixels, just below the limit, although ffmpeg rounds the width up in its buffers.
        (
            made("wide.mp4", "testsrc2=size=1364x768 -frames:v 2"),
            "frame-size-mismatch",
            "1364",
        ),
        (
            whole[..whole.len() / 2].to_vec(),
            "frame-damaged",
            "cut off",
        ),
        (
            made("clip.ts", SMALL),
            "unsupported-image",
            "`ffmpeg -i VIDEO clip.mp4`",
        ),
        (made("clip.avi", SMALL), "unsupported-image", "AVI"),
        (made("clip.flv", SMALL), "unsupported-image", "FLV"),
        (
            b"\x1F\x8B\x08\0\0\0\0\0\0\x03packed".to_vec(),
            "unsupported-image",
            "not packed",
        ),
    ] {
        let refused = post(&app, &id, "", video).await;
        let detail = expect_detail(refused, slug, &[words]).await;
        assert!(
            !detail.contains("frames before"),
            "there are none: {detail}"
        );
    }
    assert_eq!(app.frames_of(&id).await, 1);
}

/// Players show such a cut video, so it is not damaged.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn a_video_that_was_cut_in_an_open_group_of_pictures_is_decoded() {
    let app = TestApplication::start().await;
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.mp4");
    let open = "-c:v libx264 -x264-params open-gop=1:keyint=30:bframes=3";
    let source = "testsrc2=size=320x240:rate=30 -frames:v 150";
    std::fs::write(&whole, made("whole.mp4", &format!("{source} {open}"))).unwrap();
    // The cut at 1.3 s begins with the key frame at 1.0 s. Only MP4 hides the pictures before 1.3 s, by an edit list.
    for (name, expected) in [("cut.mp4", 111..=111), ("cut.mkv", 111..=121)] {
        let cut = folder.path().join(name);
        let mut command = Command::new("ffmpeg");
        command
            .args(["-v", "error", "-ss", "1.3", "-i"])
            .arg(&whole);
        assert!(
            command
                .args(["-c", "copy"])
                .arg(&cut)
                .status()
                .unwrap()
                .success()
        );
        let request = app.request(Method::POST, "/frames", &[]);
        let answer = request
            .body(std::fs::read(&cut).unwrap())
            .send()
            .await
            .unwrap();
        assert_eq!(answer.status(), 200, "{name}");
        let count = times(&answer.bytes().await.unwrap()).len();
        assert!(expected.contains(&count), "{name}: {count}");
    }
}

/// The problem must not say that a picture of the file is damaged.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn of_a_video_that_needs_too_much_memory_it_is_told_how_to_make_it_smaller() {
    let app = TestApplication::start().await;
    let encoder = "-c:v libx264 -preset ultrafast -refs 4 -bf 2 -pix_fmt yuv420p";
    let source = "testsrc2=size=7680x4320:rate=10 -frames:v 6";
    let large = made("8k.mp4", &format!("{source} {encoder}"));
    let query = [("box", "2000,1500,400,400")];
    let request = app.request(Method::POST, "/track", &query);
    let answer = request.body(large).send().await.unwrap();
    let told = match answer.status().is_success() {
        true => lines(answer).await.pop().expect("a line"),
        false => expect_problem(answer, "frame-too-large").await,
    };
    assert_eq!(told["type"], "/docs/problems#frame-too-large", "{told}");
    let detail = told["detail"].as_str().unwrap();
    assert!(
        detail.contains("768 MiB") && detail.contains("scale="),
        "{detail}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs ffmpeg"]
async fn one_client_or_network_has_a_video_at_a_time_and_another_gets_the_next_place() {
    let app = TestApplication::start_with(|config| {
        config.workers = Some(1);
        // Long enough for a first picture on a busy machine.
        config.work_timeout = Duration::from_secs(5);
        behind_a_proxy(config);
    });
    let app = app.await;
    let send = async |session: String, client: &str, video: Vec<u8>| {
        let request = app.request(Method::POST, &format!("{session}/frames"), &[]);
        let request = request
            .header("content-type", "video/x-motion-jpeg")
            .body(video);
        request
            .header("x-forwarded-for", client)
            .send()
            .await
            .unwrap()
    };
    let (long, short) = (motion_jpeg().repeat(200), motion_jpeg());
    // With a worker there are two places, and a network of 48 bits has one of them.
    for [first, again, other] in [
        ["198.51.100.1", "198.51.100.1", "198.51.100.2"],
        ["2001:db8:1:1::1", "2001:db8:1:2::1", "2001:db8:2:1::1"],
    ] {
        let mut held = send(heavy::open(&app).await, first, long.clone()).await;
        held.chunk().await.unwrap().expect("a line");
        let session = async || format!("/sessions/{}", app.open().await);
        let again = send(session().await, again, short.clone()).await;
        expect_problem(again, "quota-exceeded").await;
        let other = send(session().await, other, short.clone()).await;
        assert_eq!(lines(other).await.len(), FRAMES as usize);
        // The first request was at work all the time.
        held.chunk().await.unwrap().expect("another line");
        drop(held);
    }
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn readers_that_take_nothing_lose_their_places_to_a_video_that_waits() {
    let app = TestApplication::start_with(|config| {
        config.workers = Some(1);
        config.work_timeout = Duration::from_secs(1);
        config.limits.write_timeout = Duration::from_secs(1000);
        behind_a_proxy(config);
    });
    let app = app.await;
    let source = "testsrc2=size=1280x720:rate=30 -frames:v 300 -c:v mpeg4 -q:v 9";
    let long = made("long.mp4", source);
    let frames_of = async |client: &str, video: &[u8]| {
        loop {
            let request = app.request(Method::POST, "/frames", &[]);
            let request = request.header("x-forwarded-for", client);
            let answer = request.body(video.to_vec()).send().await.unwrap();
            if answer.status() == 200 {
                return answer;
            }
            // The place is not free yet, or the machine is too busy for a first picture in time: try again.
            expect(answer, reqwest::StatusCode::SERVICE_UNAVAILABLE).await;
        }
    };
    let held = [
        frames_of("198.51.100.1", &long).await,
        frames_of("198.51.100.2", &long).await,
    ];
    let short = video("mp4");
    let other = async { frames_of("198.51.100.3", &short).await.bytes().await };
    let other = within(other, "a place is given up").await.unwrap();
    assert_eq!(times(&other).len(), FRAMES as usize);
    // The answer to a request that has lost its place is cut off. Usually one of the two has; both, if a try above
    // ended between being promised a place and getting it.
    let ends = join_all(held.map(Response::bytes)).await;
    assert!(
        ends.iter().any(Result::is_err),
        "an answer ends as if it were whole"
    );
    assert!(ends.iter().flatten().all(|bytes| times(bytes).len() == 300));
}

/// How many lines come before the problem that ends them, which must name that number of pictures.
async fn until_damage(app: &TestApplication, video: Vec<u8>) -> usize {
    let id = app.open().await;
    let answer = post(app, &id, "video/mp4", video).await;
    let mut got = match answer.status().is_success() {
        true => lines(answer).await,
        // If the first picture cannot be decoded, the problem is the whole answer.
        false => vec![expect_problem(answer, "frame-damaged").await],
    };
    let last = got.pop().expect("a line");
    assert_eq!(last["type"], "/docs/problems#frame-damaged", "{last}");
    let detail = last["detail"].as_str().unwrap();
    let named = format!("from its picture {} on", got.len() + 1);
    assert!(detail.contains(&named), "{named}: {detail}");
    for (answer, t) in got.iter().zip(1..) {
        expect_on_target(answer, t);
    }
    assert_eq!(app.frames_of(&id).await, 1 + got.len() as u64);
    got.len()
}

#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn damage_in_the_middle_of_a_video_is_told_and_nothing_after_it_is_numbered() {
    let app = TestApplication::start().await;
    let whole = video("mkv");
    let at = |part: f64| (whole.len() as f64 * part) as usize;
    // Each of these must end with a problem: not with 200 and fewer lines, and not with wrong frame numbers.
    let mut zeros = whole.clone();
    zeros[at(0.4)..at(0.6)].fill(0);
    assert!(until_damage(&app, zeros).await < FRAMES as usize);
    assert!(until_damage(&app, whole[..at(0.6)].to_vec()).await < FRAMES as usize);
    let mut noise = video("mp4");
    let middle = noise.len() / 3;
    noise[middle..middle + 500]
        .iter_mut()
        .for_each(|byte| *byte ^= 0x5A);
    assert!(until_damage(&app, noise).await < FRAMES as usize);
}

/// How many frames a video has before its damage; the last line must name that number.
async fn frames_before_damage(app: &TestApplication, video: &[u8]) -> usize {
    let request = app.request(Method::POST, "/track", &[("box", "20,20,60,60")]);
    let answer = request.body(video.to_vec()).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    let mut got = lines(answer).await;
    let last = got.pop().expect("a line");
    assert_eq!(last["type"], "/docs/problems#frame-damaged", "{last}");
    got.len()
}

/// ffmpeg reads seconds ahead to find the type of the sound, and may report the damage before the first picture;
/// without sound, some pictures early. The rows before the damage must come all the same.
#[tokio::test]
#[ignore = "needs ffmpeg"]
async fn damage_is_told_at_its_picture_with_sound_and_without() {
    let app = TestApplication::start().await;
    let pictures = "testsrc2=size=320x240:rate=30";
    let coded = "-frames:v 90 -c:v libx264 -g 30 -pix_fmt yuv420p";
    let silent = made("silent.mp4", &format!("{pictures} {coded}"));
    let sound = "-f lavfi -i sine -c:a aac -shortest";
    let loud = made("loud.mp4", &format!("{pictures} {sound} {coded}"));
    for whole in [silent, loud] {
        let mut damaged = whole.clone();
        let middle = whole.len() / 2;
        damaged[middle..middle + 500].fill(0x5A);
        let frames = frames_before_damage(&app, &damaged).await;
        assert!((30..60).contains(&frames), "{frames}");
        for _ in 0..3 {
            assert_eq!(frames_before_damage(&app, &damaged).await, frames);
        }
    }
}
