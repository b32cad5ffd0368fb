//! Frames of one session in several requests at once: which waits for which.

use crate::common::assert_matches;
use crate::world::{FIRST, FLOW, open, pictures, place, post_numbered, service};
use bagtrack_sessions::{ActError, Boxes, Clock, FrameBatch, FramesError, QueueFull, clock};
use std::time::Duration;

/// How long an early frame waits.
const PATIENCE: Duration = Duration::from_secs(2);

#[tokio::test]
async fn a_frame_without_a_number_is_refused_beside_another() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let first = session.enter().unwrap();
    assert!(!first.overlaps());
    let second = session.enter().unwrap();
    assert!(second.overlaps());
    let ask = |permit, number| service.wait_for_turn(permit, place(&service), number);
    assert!(ask(&first, None).await.is_ok());
    let refused = ask(&second, None).await.unwrap_err();
    assert!(matches!(refused, FramesError::NotInOrder), "{refused}");
    assert!(ask(&second, Some(1)).await.is_ok(), "its number tells");
    drop((first, second));
    // A reader does not count as a request with frames.
    let reader = session.read_permit().unwrap();
    assert!(!session.enter().unwrap().overlaps());
    drop(reader);
}

#[tokio::test(start_paused = true)]
async fn an_early_frame_waits_for_those_before_it_and_not_for_ever() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let early = session.enter().unwrap();
    let begun = clock::now();
    // Frames whose turn it is, late frames and frames that are far too early do not wait.
    for number in [0, 1, 18, u64::MAX] {
        let place = place(&service);
        let turn = service.wait_for_turn(&early, place, Some(number)).await;
        assert!(turn.is_ok());
        assert_eq!(begun.elapsed(), Duration::ZERO, "{number}");
    }
    for number in [2, 17] {
        let begun = clock::now();
        let place = place(&service);
        let turn = service.wait_for_turn(&early, place, Some(number)).await;
        assert!(turn.is_ok(), "its number is refused later");
        assert_eq!(begun.elapsed(), PATIENCE, "{number}");
    }
    let begun = clock::now();
    let waiting = service.wait_for_turn(&early, place(&service), Some(3));
    let others = async {
        for number in 1..3 {
            clock::sleep(PATIENCE / 4).await;
            let files = pictures(number..number + 1);
            let posted = post_numbered(&service, &session, number.into(), files).await;
            assert!(posted.is_ok());
        }
    };
    let (turn, ()) = tokio::join!(waiting, others);
    assert_eq!(begun.elapsed(), PATIENCE / 2);
    let batch = FrameBatch::posted(Some(3), pictures(3..4), None);
    let answer = service.advance(early, turn.unwrap(), batch).await;
    assert_eq!(answer.unwrap().estimates[0].first().frame, 3);
}

#[tokio::test(start_paused = true)]
async fn an_early_frame_leaves_its_place_in_the_queue_to_others_meanwhile() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let early = session.enter().unwrap();
    let own = place(&service);
    let free = service.admission.queue_places();
    assert_eq!(service.admission.requests_inside(), 1);
    let waiting = service.wait_for_turn(&early, own, Some(2));
    let others = async {
        clock::sleep(PATIENCE / 2).await;
        assert_eq!(service.admission.queue_places(), free + 1);
        let all: Vec<_> = (0..=free).map(|_| place(&service)).collect();
        clock::sleep(PATIENCE).await;
        drop(all);
    };
    let (turn, ()) = tokio::join!(waiting, others);
    let refused = turn.unwrap_err();
    assert_matches!(refused, FramesError::Act(ActError::QueueFull(QueueFull)));
    assert!(service.admission.check_place(FLOW).is_ok());
}

#[tokio::test(start_paused = true)]
async fn the_last_place_at_a_session_is_left_to_the_frame_whose_turn_it_is() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let mut permits: Vec<_> = (0..3).map(|_| session.enter().unwrap()).collect();
    let early = permits[0].share();
    let waiting = service.wait_for_turn(&early, place(&service), Some(2));
    let mut waiting = Box::pin(waiting);
    assert!(futures_util::poll!(&mut waiting).is_pending());
    permits.push(session.enter().unwrap());
    let refused = service.wait_for_turn(&permits[3], place(&service), Some(3));
    let refused = refused.await.map(drop).unwrap_err();
    assert_matches!(refused, FramesError::Act(ActError::Busy(_)));
    // A frame that waits already goes on waiting.
    assert!(futures_util::poll!(&mut waiting).is_pending());
    drop(waiting);
    drop(early);
    assert!(session.enter().is_err() && session.read_permit().is_err());
    assert!(session.is_busy());
    // A place that is shared is the same one.
    let shared = permits[0].share();
    permits.remove(0);
    assert!(session.enter().is_err());
    drop(shared);
    assert!(session.enter().is_ok());
    drop(permits);
    assert!(!session.is_busy());
}

#[tokio::test]
async fn a_request_that_waits_at_a_session_that_ends_is_told() {
    let service = service(&Clock::default());
    let session = open(&service, Boxes::One(FIRST)).await;
    let before = session.enter().unwrap().lock().await.unwrap();
    let (own, batch) = (
        session.enter().unwrap(),
        FrameBatch::posted(Some(1), pictures(1..2), None),
    );
    let waiting = service.advance(own, place(&service), batch);
    let mut waiting = Box::pin(waiting);
    assert!(futures_util::poll!(&mut waiting).is_pending());
    assert!(service.registry.remove(session.name()));
    drop(before);
    let told = waiting.await.unwrap_err();
    assert_matches!(told, FramesError::Act(ActError::NoSession(_)));
    assert!(!told.is_temporary());
}
