//! Frames of a session: which are taken, which are refused, and what is answered.

use crate::common::assert_matches;
use crate::world::{
    FIRST, PIXELS, SECOND, SIZE, at_first, open, parts, picture, pictures, place, png, post,
    post_numbered, request, service, small_picture,
};
use bagtrack_sessions::{
    ActError, Boxes, Clock, Fingerprint, FrameBatch, FrameFault, FramesError, GivenBox,
    KEPT_ANSWERS, PerTarget, ReplayError, Session, SessionService, Start, check_readable_pixels,
    is_snapshot,
};
use bagtrack_tracker::{Rect, Status, TrackerError};
use metrics::Counter;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

fn corrected(target: Option<usize>, to: Rect, number: u64) -> FrameBatch {
    let given = GivenBox { target, to };
    FrameBatch::posted(
        Some(number),
        vec![picture(number.try_into().unwrap())],
        Some(given),
    )
}

#[tokio::test]
async fn frames_are_answered_once_and_again_under_the_same_number() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let first = post_numbered(&service, &session, 1, pictures(1..4))
        .await
        .unwrap();
    let frames: Vec<u64> = first.estimates.iter().map(|of| of.first().frame).collect();
    assert_eq!((frames, first.replayed), (vec![1, 2, 3], false));
    assert_eq!(first.checkpoint, None);
    let again = post_numbered(&service, &session, 1, pictures(1..4))
        .await
        .unwrap();
    assert!(again.replayed);
    assert_eq!(again.estimates, first.estimates);
    let opening = post_numbered(&service, &session, 0, pictures(0..1)).await;
    let opening = opening.unwrap();
    assert!(opening.replayed && opening.estimates[0].first().target == FIRST);
    assert_eq!(session.latest_frame(), 3);
    // Parts of the request are replays, too: the client may have lost only some of the answers.
    for (number, files) in [(1, pictures(1..3)), (2, pictures(2..3))] {
        let count = files.len();
        let part = post_numbered(&service, &session, number, files).await;
        let (from, part) = (number as usize - 1, part.unwrap());
        assert!(part.replayed);
        assert_eq!(part.estimates, first.estimates[from..from + count]);
    }
    let out_of_order = |got| ReplayError::OutOfOrder { got, expected: 4 };
    let differs = |got| ReplayError::Differs { got, expected: 4 };
    for (number, files, expected) in [
        // The last frame of this request is new.
        (2, pictures(2..5), out_of_order(2)),
        (3, pictures(1..2), differs(3)),
        (5, pictures(5..6), out_of_order(5)),
        (u64::MAX, pictures(5..6), out_of_order(u64::MAX)),
    ] {
        let refused = post_numbered(&service, &session, number, files).await;
        assert_matches!(refused, Err(FramesError::Replay(error)) if *error == expected);
    }
    // A frame without a number is the next one, even with the bytes of the last.
    let next = FrameBatch::posted(None, pictures(3..4), None);
    let next = post(&service, &session, next).await.unwrap();
    assert_eq!(next.estimates[0].first().frame, 4);
    assert_eq!(next.estimates[0], session.latest());
}

#[tokio::test]
async fn one_bad_frame_of_several_leaves_the_session_as_it_was() {
    for boxes in [Boxes::One(FIRST), Boxes::List(vec![FIRST, SECOND])] {
        one_bad_frame_leaves_it_as_it_was(boxes).await;
    }
}

async fn one_bad_frame_leaves_it_as_it_was(boxes: Boxes) {
    let service = service(&Clock::default());
    let session = open(&service, boxes).await;
    let before = session.latest();
    for bad in [small_picture(), "no picture".into()] {
        let files = vec![picture(1), bad.clone(), picture(3)];
        let batch = FrameBatch::posted(Some(1), files, None);
        let checked = batch.check_sizes(&service.request_limits(), SIZE);
        let posted = post(&service, &session, batch).await.map(drop);
        for refused in [checked, posted] {
            let Err(FramesError::Frame {
                index: 1,
                count: 3,
                fault,
            }) = refused
            else {
                panic!("{refused:?}");
            };
            match fault {
                FrameFault::Tracker(TrackerError::FrameSize {
                    width,
                    height,
                    got_width,
                    got_height,
                }) => {
                    assert_eq!((width, height), SIZE);
                    assert_eq!((got_width, got_height), (48, 48));
                }
                fault => assert!(bad.len() < 20, "{fault}"),
            }
        }
        assert_eq!(session.latest(), before);
    }
    // The next frame is still the first one.
    assert!(
        post_numbered(&service, &session, 1, pictures(1..2))
            .await
            .is_ok()
    );
}

#[tokio::test]
async fn several_frames_have_so_many_pixels_together_and_one_may_have_more() {
    let mut of = parts(&Clock::default());
    of.settings.max_request_pixels = 2 * PIXELS;
    let service = SessionService::new(of);
    let limits = service.request_limits();
    let session = open(&service, Boxes::One(FIRST)).await;
    let refused = post_numbered(&service, &session, 1, pictures(1..4)).await;
    let readable = check_readable_pixels(&pictures(1..4), &limits);
    for refused in [refused.map(drop), readable] {
        let Err(FramesError::TooManyPixels { pixels, limit }) = refused else {
            panic!("{refused:?}");
        };
        assert_eq!((pixels, limit), (3 * PIXELS, 2 * PIXELS));
    }
    assert!(
        post_numbered(&service, &session, 1, pictures(1..3))
            .await
            .is_ok()
    );
    // A file that is no picture counts as 0 pixels here; it is refused when its turn comes.
    let with_text = vec![picture(1), "no picture".into(), picture(2)];
    assert!(check_readable_pixels(&with_text, &limits).is_ok());

    let mut of = parts(&Clock::default());
    of.settings.max_request_pixels = PIXELS - 1;
    let service = SessionService::new(of);
    let session = open(&service, Boxes::One(FIRST)).await;
    assert!(
        post_numbered(&service, &session, 1, pictures(1..2))
            .await
            .is_ok()
    );
}

#[tokio::test]
async fn a_correction_is_of_one_target_which_there_is() {
    let service = service(&Clock::default());
    let to = Rect::new(30.0, 20.0, 16.0, 12.0);
    let list = open(&service, Boxes::List(vec![SECOND, FIRST])).await;
    for target in [None, Some(2)] {
        let refused = post(&service, &list, corrected(target, to, 1)).await;
        let refused = refused.unwrap_err();
        assert_matches!(refused, FramesError::NoSuchTarget { count: 2 });
    }
    let fractions = corrected(Some(1), Rect::new(0.1, 0.1, 0.2, 0.2), 1);
    let refused = post(&service, &list, fractions).await.unwrap_err();
    assert!(matches!(refused, FramesError::Box(_)), "{refused}");
    let answer = post(&service, &list, corrected(Some(1), to, 1)).await;
    let answer = answer.unwrap();
    let [other, given] = answer.estimates[0].as_slice() else {
        panic!("{answer:?}");
    };
    assert_eq!(given.target, to);
    assert!((other.target.x - SECOND.x).abs() < 4.0, "{other:?}");
    // The same box again is the same request, and another one is not.
    let again = post(&service, &list, corrected(Some(1), to, 1)).await;
    assert!(again.unwrap().replayed);
    let moved = Rect { x: 31.0, ..to };
    for (target, to) in [(1, moved), (0, to)] {
        let differs = post(&service, &list, corrected(Some(target), to, 1)).await;
        assert_matches!(
            differs,
            Err(FramesError::Replay(ReplayError::Differs { .. }))
        );
    }

    let one = open(&service, Boxes::One(FIRST)).await;
    for (number, target) in [(1, None), (2, Some(0))] {
        let answer = post(&service, &one, corrected(target, to, number)).await;
        assert_eq!(answer.unwrap().estimates[0].first().target, to);
    }
    assert!(matches!(
        post(&service, &one, corrected(Some(1), to, 3)).await,
        Err(FramesError::NoSuchTarget { count: 1 })
    ));
}

#[tokio::test]
async fn what_the_trackers_saw_is_told_of_the_last_frame_where_it_is_asked_for() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::List(vec![FIRST, SECOND])).await;
    let ask = |numbers: std::ops::Range<u32>, with_diagnostics| FrameBatch {
        with_diagnostics,
        ..FrameBatch::posted(Some(numbers.start.into()), pictures(numbers), None)
    };
    let told = post(&service, &session, ask(1..3, true)).await.unwrap();
    assert_eq!(told.diagnostics.len(), 2);
    let again = post(&service, &session, ask(1..3, true)).await.unwrap();
    assert!(again.replayed && again.diagnostics.is_empty());
    let silent = post(&service, &session, ask(3..4, false)).await.unwrap();
    assert!(silent.diagnostics.is_empty());
    let corrected = FrameBatch {
        with_diagnostics: true,
        ..corrected(Some(0), FIRST, 4)
    };
    let corrected = post(&service, &session, corrected).await.unwrap();
    assert!(corrected.diagnostics.is_empty());
}

/// The frames whose answers are stored from this one on.
async fn stored_from(
    service: &SessionService,
    session: &Arc<Session>,
    number: u64,
) -> Option<Vec<u64>> {
    let permit = session.read_permit().unwrap();
    let read = service.read(permit, place(service), move |state| {
        Ok::<_, ActError>(state.answers_from(number))
    });
    let answers = read.await.unwrap()?;
    Some(answers.iter().map(|answer| answer.first().frame).collect())
}

#[tokio::test]
async fn the_last_answers_are_kept_and_more_where_that_is_asked_for() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    post_numbered(&service, &session, 1, pictures(1..4))
        .await
        .unwrap();
    assert_eq!(
        stored_from(&service, &session, 0).await,
        Some(vec![0, 1, 2, 3])
    );
    assert_eq!(stored_from(&service, &session, 4).await, Some(vec![]));
    assert_eq!(stored_from(&service, &session, 5).await, None);
    // Answers of earlier requests are kept, up to [`KEPT_ANSWERS`].
    let (kept, last) = (KEPT_ANSWERS as u64, KEPT_ANSWERS as u64 + 6);
    for number in 4..=last {
        post_numbered(&service, &session, number, pictures(4..5))
            .await
            .unwrap();
    }
    let first = last + 1 - kept;
    let stored: Vec<u64> = (first..=last).collect();
    assert_eq!(stored_from(&service, &session, first).await, Some(stored));
    assert_eq!(stored_from(&service, &session, first - 1).await, None);
    // Each of them is given again, and changes nothing.
    let again = post_numbered(&service, &session, first, pictures(4..5));
    assert!(again.await.unwrap().replayed);
    let (got, expected) = (first - 1, last + 1);
    let out_of_order = ReplayError::OutOfOrder { got, expected };
    // A request is refused even where the answers to its later frames are kept.
    for files in [pictures(4..5), [pictures(4..5), pictures(4..5)].concat()] {
        let late = post_numbered(&service, &session, got, files).await;
        assert_matches!(late, Err(FramesError::Replay(error)) if *error == out_of_order);
    }
    assert_eq!(session.latest_frame(), last);
    let keeps = FrameBatch {
        min_answers: KEPT_ANSWERS + 2,
        ..FrameBatch::posted(Some(last + 1), pictures(5..6), None)
    };
    post(&service, &session, keeps).await.unwrap();
    assert!(stored_from(&service, &session, first).await.is_some());
}

#[tokio::test]
async fn a_stored_answer_is_given_for_the_same_bytes_alone() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let posted = post_numbered(&service, &session, 1, pictures(1..3)).await;
    let answers = posted.unwrap().estimates;
    let asked = |number, file: bytes::Bytes| {
        let print = Fingerprint::of(&file);
        let permit = session.read_permit().unwrap();
        service.read(permit, place(&service), move |state| {
            Ok::<_, FramesError>(state.stored_answer(number, print)?)
        })
    };
    for (number, answer) in (1..).zip(&answers) {
        let given = asked(number, picture(number.try_into().unwrap())).await;
        assert_eq!(given.unwrap(), *answer);
    }
    let replay = |refused: Result<_, FramesError>| match refused {
        Err(FramesError::Replay(error)) => error,
        other => panic!("{other:?}"),
    };
    let (got, expected) = (1, 3);
    let other = replay(asked(1, picture(2)).await);
    assert_eq!(other, ReplayError::Differs { got, expected });
    let (got, expected) = (4, 3);
    let early = replay(asked(4, picture(4)).await);
    assert_eq!(early, ReplayError::OutOfOrder { got, expected });
}

#[tokio::test]
async fn a_session_is_looked_at_without_a_frame() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::List(vec![FIRST, SECOND])).await;
    assert_eq!((session.source_size(), session.target_count()), (SIZE, 2));
    let name = session.short_id();
    let shown = name.trim_end_matches('…');
    assert!(session.id().to_string().starts_with(shown) && shown.len() == 8);
    let permit = || session.read_permit().unwrap();
    let bags = service.read(permit(), place(&service), |state| {
        assert_eq!(state.source_size(), SIZE);
        Ok::<_, ActError>([0, 1, 2].map(|target| state.bag(target).map(|bag| bag.len())))
    });
    let [first, second, none] = bags.await.unwrap();
    assert!(first > Some(0) && second > Some(0), "{first:?} {second:?}");
    assert_eq!(none, None);
    let snapshot = service.snapshot(permit(), place(&service)).await.unwrap();
    assert!(is_snapshot(&snapshot) && !is_snapshot(&picture(0)));
    let start = Start::Snapshot(snapshot.into());
    let opened = service.open(request(&service, None, 0, start)).await;
    let opened = opened.unwrap().session;
    assert_eq!(opened.latest(), session.latest());
    assert_ne!(opened.id(), session.id());
}

#[tokio::test]
async fn frames_of_a_stream_are_taken_until_a_newer_one_has_its_place() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let place = Arc::new(service.streams.take(session.id()));
    let streamed = |number: u32| FrameBatch {
        stream: Some(place.clone()),
        ..FrameBatch::posted(None, vec![picture(number)], None)
    };
    assert!(post(&service, &session, streamed(1)).await.is_ok());
    assert!(futures_util::poll!(Box::pin(place.replaced())).is_pending());
    let newer = service.streams.take(session.id());
    let refused = post(&service, &session, streamed(2)).await.unwrap_err();
    assert!(matches!(refused, FramesError::StreamReplaced), "{refused}");
    assert!(refused.is_temporary());
    place.replaced().await;
    assert!(!newer.is_replaced());
    assert_eq!(session.latest_frame(), 1);
}

#[tokio::test]
async fn each_answer_of_each_target_is_counted() {
    let counts: [Arc<AtomicU64>; 4] = Default::default();
    let [tracking, uncertain, lost, losses] = counts
        .each_ref()
        .map(|count| Counter::from_arc(count.clone()));
    let mut of = parts(&Clock::default());
    of.tracking = bagtrack_sessions::TrackingMetrics {
        tracking,
        uncertain,
        lost,
        losses,
        ..bagtrack_sessions::TrackingMetrics::noop()
    };
    let service = SessionService::new(of);
    let mut robust = bagtrack_tracker::Preset::Robust.params();
    robust.particles = 20;
    let mut start = at_first(Boxes::List(vec![FIRST, SECOND]));
    if let Start::Frame { params, .. } = &mut start {
        **params = robust;
    }
    let opened = service.open(request(&service, None, 0, start)).await;
    let session = opened.unwrap().session;
    // The targets are visible, then hidden, then visible again.
    let nothing = image::GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        image::Luma([(x * 131 + y * 17) as u8 ^ (x * y) as u8])
    });
    let mut files = pictures(1..4);
    files.extend(vec![png(nothing); 20]);
    files.extend(pictures(4..10));
    let mut statuses: Vec<Vec<Status>> = vec![vec![Status::Tracking; 2]];
    // Requests of one frame, and of several.
    let (single, several) = files.split_at(5);
    let mut requests: Vec<Vec<bytes::Bytes>> =
        single.iter().map(|file| vec![file.clone()]).collect();
    requests.extend(several.chunks(4).map(<[_]>::to_vec));
    for files in requests {
        let batch = FrameBatch::posted(None, files, None);
        for answer in post(&service, &session, batch).await.unwrap().estimates {
            let PerTarget::List(list) = answer else {
                panic!("it has a list of targets");
            };
            statuses.push(list.iter().map(|estimate| estimate.status).collect());
        }
    }
    let told: Vec<Status> = statuses[1..].concat();
    let of = |status| told.iter().filter(|told| **told == status).count() as u64;
    let mut expected_losses = 0;
    for pair in statuses.windows(2) {
        for (before, after) in pair[0].iter().zip(&pair[1]) {
            expected_losses += u64::from(*after == Status::Lost && *before != Status::Lost);
        }
    }
    let expected = [
        of(Status::Tracking),
        of(Status::Uncertain),
        of(Status::Lost),
        expected_losses,
    ];
    let [seen, _, not_seen, went] = expected;
    assert!(seen > 0 && not_seen > went && went > 0, "{expected:?}");
    assert_eq!(counts.map(|count| count.load(Ordering::Relaxed)), expected);
}
