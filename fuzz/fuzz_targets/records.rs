//! What a store has of a session: it is read as one, which goes on, or the client is told that it cannot be read.
#![no_main]

use axum::http::{Method, StatusCode};
use bagtrack_fuzz::{pattern, png, Service, Shelf, Stored, BOX, MAX_RECENT, SETTINGS};
use bagtrack_sessions::{Record, SessionState};
use libfuzzer_sys::fuzz_target;
use std::cell::Cell;
use std::time::Duration;
use uuid::Uuid;

const MAX_PIXELS: u64 = 64 << 10;
const MAX_TTL: Duration = Duration::from_secs(101 * 366 * 24 * 3600);

thread_local! {
    static SERVICE: (Service, Shelf) = Service::with_store(Shelf::new());
    /// Each input is another session's.
    static IDS: Cell<u128> = const { Cell::new(0) };
}

/// What was read is written as it is read again.
fn comes_back(record: &Record) {
    let (version, head) = (record.version, record.head());
    assert!(record.ttl <= MAX_TTL);
    let again = Record::at_checkpoint(
        version.generation,
        version.checkpoint,
        &head,
        record.state.clone(),
        record.ttl,
    );
    assert_eq!(again.map(|again| again.head()), Ok(head));
    let read = |bytes: &[u8]| SessionState::from_stored(bytes, MAX_RECENT, None, None);
    if let Ok(state) = read(&record.state) {
        let stored = state.stored();
        let again = read(&stored).expect("a state that was written is read");
        assert_eq!(again.stored(), stored);
    }
}

/// The requests that a session may get.
fn goes_on(service: &Service, id: Uuid) {
    let session = format!("/sessions/{id}");
    let view = service.send((Method::GET, &session), "text/plain", b"");
    if view.status == StatusCode::OK {
        let view = view.json();
        let side = |name: &str| view["image"][name].as_u64().expect("a number") as u32;
        let (width, height) = (side("width"), side("height"));
        let frame = view["frames"].as_u64().expect("a number");
        if u64::from(width) * u64::from(height) <= MAX_PIXELS {
            let post = format!("{session}/frames?frame={frame}");
            let picture = pattern(1, width, height);
            let answer = service.send((Method::POST, &post), "image/png", &picture);
            assert!(!answer.status.is_server_error(), "{}", answer.json());
            let replayed = service.send((Method::POST, &post), "image/png", &picture);
            assert_eq!(replayed.status, answer.status);
            assert_eq!(replayed.body, answer.body);
        }
    }
    // The request that the sessions of the first inputs were opened with.
    let open = format!("{session}?box={BOX}&{SETTINGS}");
    service.send((Method::PUT, &open), "image/png", &png(0));
    service.send((Method::DELETE, &session), "text/plain", b"");
}

fuzz_target!(|data: &[u8]| {
    let Some(stored) = Stored::of(data) else {
        return;
    };
    SERVICE.with(|(service, shelf)| {
        let id = IDS.get() + 1;
        IDS.set(id);
        let id = Uuid::from_u128(id);
        shelf.put(Some(stored));
        if let Ok(Some(record)) = service.wait(shelf.record(id)) {
            comes_back(&record);
        }
        goes_on(service, id);
        shelf.put(None);
        shelf.take_written();
    });
});
