//! Snapshots with a valid code, after a byte that tells their version: what is taken goes on, and its own snapshot is
//! taken again.
#![no_main]

use axum::http::{Method, StatusCode};
use bagtrack_fuzz::{pattern, snapshot_of, Service};
use libfuzzer_sys::fuzz_target;

const MEDIA_TYPE: &str = "application/vnd.bagtrack.snapshot";
const MAX_PIXELS: u64 = 64 << 10;

thread_local! {
    static SERVICE: Service = Service::new();
}

fuzz_target!(|data: &[u8]| {
    let Some((version, content)) = data.split_first() else {
        return;
    };
    SERVICE.with(|service| {
        let restore = |bytes: &[u8]| service.send((Method::POST, "/sessions"), MEDIA_TYPE, bytes);
        let restored = restore(&snapshot_of(4 + version % 2, content));
        let Some(session) = restored.session() else {
            return;
        };
        let image = &restored.json()["image"];
        let side = |name: &str| image[name].as_u64().expect("a number") as u32;
        let (width, height) = (side("width"), side("height"));
        if u64::from(width) * u64::from(height) <= MAX_PIXELS {
            for t in 0..2 {
                let post = format!("{session}/frames");
                let picture = pattern(t, width, height);
                let answer = service.send((Method::POST, &post), "image/png", &picture);
                if answer.status == StatusCode::OK {
                    let target = &answer.json()["box"];
                    for field in ["x", "y", "width", "height"] {
                        assert!(target[field].is_f64(), "{target}");
                    }
                }
            }
        }
        let get = format!("{session}/snapshot");
        let snapshot = service.send((Method::GET, &get), "text/plain", b"");
        let again = restore(&snapshot.body);
        assert_eq!(
            again.status,
            StatusCode::CREATED,
            "its own snapshot is refused"
        );
        service.delete(&again.session().expect("it was opened"));
        service.delete(&session);
    });
});
