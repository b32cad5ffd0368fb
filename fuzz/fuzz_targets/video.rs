//! Videos, without a decoder: which files are taken for one, and what is read of the output of ffmpeg.
#![no_main]

use axum::http::Method;
use bagtrack_fuzz::{Service, BOX};
use bagtrack_ingest::video::{read_output, video_format, VideoFormat};
use bagtrack_ingest::{decode, inspect, recycle, Limits};
use libfuzzer_sys::fuzz_target;

/// Most bytes of a picture, as for a decoder.
const MAX_BYTES: usize = 16 << 10;
/// Most characters that are told of what ffmpeg says.
const MAX_SAID: usize = 200;

thread_local! {
    static SERVICE: Service = Service::new();
}

/// A file is a video, or a picture, or neither; and a service says so that has been sent it as a picture.
fn file(bytes: &[u8]) {
    let format = video_format(bytes, "");
    assert_eq!(video_format(bytes, "video/mp4"), format);
    let motion = video_format(bytes, "video/x-motion-jpeg");
    match format {
        Some(VideoFormat::MotionJpeg) => panic!("nothing says that it is one"),
        Some(VideoFormat::Container) => {
            assert_eq!(motion, format);
            assert!(inspect(bytes, &Limits::default()).is_err());
        }
        None => assert_eq!(motion.is_some(), bytes.starts_with(b"\xFF\xD8")),
    }
    if format.is_some() {
        SERVICE.with(|service| {
            let open = format!("/sessions?box={BOX}");
            let answer = service.send((Method::POST, &open), "video/mp4", bytes);
            assert!(answer.status.is_client_error(), "{}", answer.status);
        });
    }
}

/// The pictures lie in the output one after the other, and none is larger than it may be.
fn output(bytes: &[u8]) {
    let Some((length, rest)) = bytes.split_first_chunk() else {
        return;
    };
    let length = usize::from(u16::from_le_bytes(*length));
    let Some((said, written)) = rest.split_at_checked(length) else {
        return;
    };
    let Ok((pictures, damage)) = read_output(written, said, MAX_BYTES) else {
        return;
    };
    assert!(pictures
        .iter()
        .all(|picture| picture.jpeg.len() <= MAX_BYTES));
    let all: usize = pictures.iter().map(|picture| picture.jpeg.len()).sum();
    assert!(all <= written.len());
    if let Some(damage) = damage {
        assert!(damage.chars().count() <= MAX_SAID && !damage.contains('\n'));
        assert_eq!(damage.trim_start(), damage);
    }
    let limits = Limits {
        max_side: 256,
        max_pixels: 1 << 14,
        max_memory: 4 << 20,
        ..Limits::default()
    };
    for picture in pictures.iter().take(2) {
        if let Ok(frame) = decode(&picture.jpeg, &limits) {
            recycle(frame);
        }
    }
}

fuzz_target!(|data: &[u8]| {
    match data.split_first() {
        Some((0, bytes)) => file(bytes),
        Some((1, bytes)) => output(bytes),
        _ => (),
    }
});
