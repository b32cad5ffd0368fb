//! Which requests keep a session alive.

use crate::common::assert_matches;
use crate::world::{
    FIRST, FLOW, LEASE, WORK_TIMEOUT, open, parts, picture, pictures, place, post, post_numbered,
    service, small_picture,
};
use bagtrack_sessions::{
    ActError, Admission, Boxes, Clock, FrameBatch, FramesError, Session, SessionService, Stopped,
    WorkMeter, clock,
};
use std::sync::Arc;
use std::time::Duration;

/// How long the session lives from now, to a second.
fn left(session: &Session) -> u64 {
    session.ttl().as_secs_f64().round() as u64
}

#[tokio::test(start_paused = true)]
async fn a_frame_that_was_taken_renews_a_session_and_one_that_is_refused_does_not() {
    let clock = Clock::default();
    let service = service(&clock);
    let session = open(&service, Boxes::One(FIRST)).await;
    let later = || clock.advance(Duration::from_secs(10));
    assert_eq!(left(&session), LEASE.first.as_secs());
    later();
    let refused = post_numbered(&service, &session, 1, vec![small_picture()]).await;
    assert!(!refused.unwrap_err().is_temporary());
    let refused = post_numbered(&service, &session, 7, pictures(1..2)).await;
    assert!(!refused.unwrap_err().is_temporary());
    assert_eq!(left(&session), LEASE.first.as_secs() - 10);
    // The second time the stored answer is given.
    for _ in 0..2 {
        let taken = post_numbered(&service, &session, 1, pictures(1..2)).await;
        assert!(taken.is_ok());
        assert_eq!(left(&session), LEASE.idle.as_secs());
        later();
    }
    // Reading the session does not renew it.
    let permit = session.read_permit().unwrap();
    service.snapshot(permit, place(&service)).await.unwrap();
    assert_eq!(left(&session), LEASE.idle.as_secs() - 10);
    assert!(service.refresh(&session, None, FLOW).await.is_ok());
    assert_eq!(left(&session), LEASE.idle.as_secs() - 10);
    service.renew(&session, true).await;
    assert_eq!(left(&session), LEASE.idle.as_secs());
    session.set_ttl(Duration::from_secs(5));
    assert_eq!(left(&session), 5);
}

#[tokio::test(start_paused = true)]
async fn a_session_does_not_end_because_there_was_no_time_for_its_frame() {
    let clock = Clock::default();
    let service = service(&clock);
    let session = open(&service, Boxes::One(FIRST)).await;
    let at_work = session.enter().unwrap().lock().await.unwrap();
    let begun = clock::now();
    let place_of_stream = Arc::new(service.streams.take(session.id()));
    let of_stream = FrameBatch {
        stream: Some(place_of_stream),
        ..FrameBatch::posted(Some(1), pictures(1..2), None)
    };
    let posted = FrameBatch::posted(Some(1), pictures(1..2), None);
    // A stream renews the session only with frames that are taken.
    for (batch, lease) in [
        (of_stream, LEASE.first - WORK_TIMEOUT),
        (posted, LEASE.idle),
    ] {
        let refused = post(&service, &session, batch).await.unwrap_err();
        assert_matches!(
            refused,
            FramesError::Act(ActError::Stopped(Stopped::Deadline))
        );
        assert!(refused.is_temporary());
        assert_eq!(left(&session), lease.as_secs());
    }
    assert_eq!(begun.elapsed(), 2 * WORK_TIMEOUT);
    drop(at_work);
}

#[tokio::test]
async fn a_request_that_costs_too_much_is_refused_and_renews_nothing() {
    let clock = Clock::default();
    let mut of = parts(&clock);
    of.admission = Admission::new(8, 1, Duration::ZERO).unwrap();
    // Enough for one frame, and not for all.
    of.settings.max_request_cpu = Duration::from_millis(200);
    let service = SessionService::new(of);
    let session = open(&service, Boxes::One(FIRST)).await;
    clock.advance(Duration::from_secs(10));
    let many = FrameBatch::posted(Some(1), vec![picture(1); 5_000], None);
    let refused = post(&service, &session, many).await.unwrap_err();
    let cost = Stopped::Cost(Duration::from_millis(200));
    assert_matches!(refused, FramesError::Act(ActError::Stopped(told)) if *told == cost);
    assert!(!refused.is_temporary());
    assert!(session.ttl() < LEASE.first);
    assert_eq!(session.latest_frame(), 0);
}

#[tokio::test]
async fn the_work_of_one_request_has_its_processor_time_together() {
    let mut of = parts(&Clock::default());
    of.admission = Admission::new(8, 1, Duration::ZERO).unwrap();
    of.settings.max_request_cpu = Duration::from_millis(200);
    let service = SessionService::new(of);
    let work = |meter: &mut WorkMeter| {
        while meter.cpu_time() < Duration::from_millis(120) {
            std::hint::spin_loop();
        }
        Ok::<_, ActError>(meter.check()?)
    };
    let one = place(&service);
    assert!(service.run(one.clone(), work).await.is_ok());
    let refused = service.run(one, work).await;
    assert_matches!(refused, Err(ActError::Stopped(Stopped::Cost(_))));
    // A request may have the time of several.
    let three = place(&service).with_cpu_of(3);
    for _ in 0..3 {
        assert!(service.run(three.clone(), work).await.is_ok());
    }
}
