//! Tracks without a session.

use crate::world::{
    FIRST, PIXELS, SECOND, at_first, open, params, parts, picture, pictures, place, post_numbered,
    request, service,
};
use bagtrack_sessions::{
    Boxes, Clock, Estimates, FramesError, GivenBox, SessionService, Start, TrackError, TrackFrom,
    TrackedAway, is_snapshot,
};
use bagtrack_tracker::Rect;
use bytes::Bytes;

async fn track(
    service: &SessionService,
    from: TrackFrom,
    files: Vec<Bytes>,
) -> Result<TrackedAway, TrackError> {
    service
        .track(place(service), from, files, Ok::<_, TrackError>)
        .await
}

fn begin(boxes: Boxes) -> TrackFrom {
    TrackFrom::Start(boxes, Box::new(params()))
}

/// The answers of a session to the same pictures.
async fn of_a_session(service: &SessionService, boxes: Boxes, last: u32) -> Vec<Estimates> {
    let session = open(service, boxes).await;
    let mut answers = vec![session.latest()];
    let tracked = post_numbered(service, &session, 1, pictures(1..last + 1)).await;
    answers.extend(tracked.unwrap().estimates);
    answers
}

#[tokio::test]
async fn a_track_in_parts_is_that_of_a_session() {
    for boxes in [Boxes::One(FIRST), Boxes::List(vec![FIRST, SECOND])] {
        let service = service(&Clock::default());
        let expected = of_a_session(&service, boxes.clone(), 6).await;
        let first = track(&service, begin(boxes.clone()), pictures(0..1))
            .await
            .unwrap();
        assert_eq!(first.estimates, expected[..1]);
        assert_eq!(first.warnings, None);
        assert!(is_snapshot(&first.snapshot));
        let from = TrackFrom::Snapshot(first.snapshot.into(), None);
        let second = track(&service, from, pictures(1..4)).await.unwrap();
        assert_eq!(second.estimates, expected[1..4]);
        // A session goes on from there.
        let start = Start::Snapshot(second.snapshot.into());
        let opened = service.open(request(&service, None, 0, start)).await;
        let session = opened.unwrap().session;
        let last = post_numbered(&service, &session, 4, pictures(4..7)).await;
        assert_eq!(last.unwrap().estimates, expected[4..]);

        // Frame by frame.
        let begun = service.begin_track(place(&service), at_first(boxes)).await;
        let mut state = begun.unwrap();
        for (number, expected) in (0..).zip(&expected) {
            if number > 0 {
                let file = picture(number);
                let next = service.continue_track(place(&service), state, file).await;
                state = next.unwrap();
            }
            assert_eq!(state.latest(), *expected);
        }
        assert_eq!(service.registry.len(), 2, "tracks are no sessions");
    }
}

#[tokio::test]
async fn a_box_is_corrected_in_the_first_picture_after_a_snapshot() {
    let service = service(&Clock::default());
    let first = track(&service, begin(Boxes::One(FIRST)), pictures(0..1));
    let snapshot: Bytes = first.await.unwrap().snapshot.into();
    let correct = async |to, files| {
        let given = GivenBox { target: None, to };
        track(
            &service,
            TrackFrom::Snapshot(snapshot.clone(), Some(given)),
            files,
        )
        .await
    };
    let to = Rect::new(30.0, 20.0, 16.0, 12.0);
    let corrected = correct(to, pictures(1..2)).await.unwrap();
    assert_eq!(corrected.estimates[0].first().target, to);
    assert_eq!(corrected.warnings, None);
    // Most of the box is outside the picture.
    let outside = Rect::new(-10.0, 20.0, 16.0, 12.0);
    let warned = correct(outside, pictures(1..2)).await.unwrap();
    let warnings = warned.warnings.unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("outside"), "{warnings:?}");
    let warned = track(&service, begin(Boxes::One(outside)), pictures(0..1)).await;
    assert_eq!(warned.unwrap().warnings, Some(warnings));
}

#[tokio::test]
async fn a_track_has_the_limits_of_a_request() {
    let mut of = parts(&Clock::default());
    of.settings.max_request_pixels = 2 * PIXELS;
    let service = SessionService::new(of);
    let is_too_much = |refused: Result<TrackedAway, TrackError>| {
        matches!(
            refused,
            Err(TrackError::Frames(FramesError::TooManyPixels { .. }))
        )
    };
    let of_two = track(&service, begin(Boxes::One(FIRST)), pictures(0..2)).await;
    let snapshot = of_two.unwrap().snapshot;
    // The first picture counts, too.
    assert!(is_too_much(
        track(&service, begin(Boxes::One(FIRST)), pictures(0..3)).await
    ));
    let from = || TrackFrom::Snapshot(snapshot.clone().into(), None);
    assert!(track(&service, from(), pictures(2..4)).await.is_ok());
    assert!(is_too_much(track(&service, from(), pictures(2..5)).await));
}
