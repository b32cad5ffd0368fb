//! What a replica does with its cached copy of a session while another replica uses the session, in a store that works.

use crate::common::{FLOW, assert_matches, place};
use crate::formats::{open, post};
use crate::hostile::HostileStore;
use crate::pictures::{FRAMES, picture};
use crate::world::{ID, LONG, parts, service, service_by, start};
use bagtrack_sessions::{
    ActError, Clock, Durability, FileStore, FrameBatch, FramesError, NoSession, Owner, ReplayError,
    Session, SessionService, SessionStore, Start, Stopped, Tracked, clock,
};
use std::sync::Arc;
use std::time::Duration;

/// Two replicas, the first of which has opened a session.
async fn two() -> [SessionService; 2] {
    let store: Arc<dyn SessionStore> = Arc::new(HostileStore::at_once());
    let replicas = [0, 1].map(|_| service(Some(store.clone()), 1));
    open(&replicas[0], ID, start(1)).await;
    replicas
}

#[tokio::test]
async fn a_session_of_another_replica_is_its_owner_s_alone() {
    let [_, other] = two().await;
    let of_ann = other.find(ID, &Owner::named("ann"), FLOW).await;
    assert_matches!(of_ann, Err(ActError::NoSession(NoSession::Unknown)));
    let own = other.find(ID, &Owner::default(), FLOW).await.unwrap();
    assert_eq!(own.latest_frame(), 0);
    other.end(ID, &Owner::default(), None).await.unwrap();
}

#[tokio::test]
async fn a_session_that_was_ended_elsewhere_leaves_memory() {
    let [first, other] = two().await;
    other.end(ID, &Owner::default(), None).await.unwrap();
    let cached = first.find(ID, &Owner::default(), FLOW).await.unwrap();
    let refused = first.refresh(&cached, None, FLOW).await;
    assert_matches!(refused, Err(ActError::NoSession(NoSession::Unknown)));
    assert!(!first.registry.is_live(ID));
    let gone = first.find(ID, &Owner::default(), FLOW).await;
    assert!(matches!(gone, Err(ActError::NoSession(_))), "{gone:?}");
}

#[tokio::test]
async fn an_early_frame_waits_for_those_that_another_replica_takes() {
    let [first, other] = two().await;
    let session = first.find(ID, &Owner::default(), FLOW).await.unwrap();
    let early = session.enter().unwrap();
    let place = || place(&first);
    let waiting = first.wait_for_turn(&early, place(), Some(2));
    let elsewhere = post(&other, ID, (1, picture(0, 1).into()));
    let (turn, posted) = tokio::join!(waiting, elsewhere);
    assert!(turn.is_ok() && posted.is_ok());
    assert!(!early.is_early(2), "the store has told of the frame before");
    assert_eq!(session.latest_frame(), 1);
    // Nobody sends the next frame. Meanwhile other requests take all places at the session, which must not end the
    // wait.
    tokio::time::pause();
    let begun = clock::now();
    let others = async { std::iter::from_fn(|| session.enter().ok()).collect::<Vec<_>>() };
    let (turn, others) = tokio::join!(first.wait_for_turn(&early, place(), Some(3)), others);
    assert!(turn.is_ok() && !others.is_empty());
    let waited = begun.elapsed();
    let patience = Duration::from_secs(2)..Duration::from_millis(2_400);
    assert!(patience.contains(&waited), "{waited:?}");
}

async fn cached(replica: &SessionService) -> Arc<Session> {
    replica.find(ID, &Owner::default(), FLOW).await.unwrap()
}

/// The client's frame, or its rival's, with or without its number.
async fn send(
    replica: &SessionService,
    number: Option<u64>,
    picture: Vec<u8>,
) -> Result<Tracked, FramesError> {
    let session = cached(replica).await;
    let place = place(replica);
    let batch = FrameBatch::posted(number, vec![picture.into()], None);
    let permit = session.enter().unwrap();
    replica.advance(permit, place, batch).await
}

#[tokio::test]
async fn frames_in_turns_at_two_replicas_have_the_answers_of_one() {
    for is_numbered in [true, false] {
        let replicas = two().await;
        let alone = service(None, 1);
        open(&alone, ID, start(1)).await;
        for number in 1..=FRAMES {
            let told = is_numbered.then_some(number);
            let expected = send(&alone, told, picture(0, number)).await.unwrap();
            let replica = &replicas[number as usize % 2];
            let tracked = send(replica, told, picture(0, number)).await.unwrap();
            assert_eq!(tracked.estimates, expected.estimates);
            assert_eq!(
                (tracked.replayed, tracked.checkpoint),
                (false, Some(number))
            );
            assert_eq!(cached(replica).await.latest_frame(), number);
        }
    }
}

#[tokio::test]
async fn the_state_is_written_at_every_third_frame_and_at_each_before_the_end() {
    let store: Arc<dyn SessionStore> = Arc::new(HostileStore::at_once());
    let replica = service(Some(store.clone()), 3);
    open(&replica, ID, start(1)).await;
    for (number, checkpoint) in [(1, 0), (2, 0), (3, 3), (4, 3)] {
        let tracked = send(&replica, Some(number), picture(0, number)).await;
        assert_eq!(tracked.unwrap().checkpoint, Some(checkpoint));
    }
    replica.drain();
    let tracked = send(&replica, Some(5), picture(0, 5)).await.unwrap();
    assert_eq!(tracked.checkpoint, Some(5));
    // Another replica goes on from there.
    let other = service(Some(store), 3);
    let tracked = send(&other, Some(6), picture(0, 6)).await.unwrap();
    assert_eq!(tracked.checkpoint, Some(5));
}

#[tokio::test]
async fn what_another_replica_has_answered_is_answered_again() {
    let [first, other] = two().await;
    for number in 1..=3 {
        let tracked = send(&other, Some(number), picture(0, number))
            .await
            .unwrap();
        // The first time the replica has the frame before in memory, the second time this frame.
        for _ in 0..2 {
            let again = send(&first, Some(number), picture(0, number))
                .await
                .unwrap();
            assert!(again.replayed, "{number}");
            assert_eq!(again.estimates, tracked.estimates);
            assert_eq!(again.checkpoint, Some(number));
        }
        assert_eq!(cached(&first).await.latest_frame(), number);
    }
}

#[tokio::test]
async fn of_two_pictures_with_one_number_the_first_that_the_store_has_counts() {
    let [first, other] = two().await;
    let taken = send(&other, Some(1), picture(0, 1)).await.unwrap();
    let send_late = async || send(&first, Some(1), picture(1, 1)).await.unwrap_err();
    let late = send_late().await;
    let next = |late: &FramesError| match late {
        FramesError::Replay(ReplayError::OutOfOrder { got: 1, expected }) => Some(*expected),
        _ => None,
    };
    assert_eq!(next(&late), Some(2), "{late}");
    // The replica has the session from the store now, and knows the number.
    let again = send_late().await;
    let differs = matches!(
        again,
        FramesError::Replay(ReplayError::Differs {
            got: 1,
            expected: 2
        })
    );
    assert!(differs, "{again}");
    let same = send(&first, Some(1), picture(0, 1)).await.unwrap();
    assert!(same.replayed);
    assert_eq!(same.estimates, taken.estimates);
}

#[tokio::test]
async fn a_look_at_a_replica_that_lacks_frames_tells_the_newest() {
    let [first, other] = two().await;
    send(&other, Some(1), picture(0, 1)).await.unwrap();
    let session = cached(&first).await;
    assert_eq!(session.latest_frame(), 0);
    first.refresh(&session, None, FLOW).await.unwrap();
    assert_eq!(session.latest_frame(), 1);
    send(&other, Some(2), picture(0, 2)).await.unwrap();
    let place = place(&first);
    let snapshot = first.snapshot(session.read_permit().unwrap(), place).await;
    let alone = service(None, 1);
    open(&alone, ID, Start::Snapshot(snapshot.unwrap().into())).await;
    assert_eq!(cached(&alone).await.latest_frame(), 2);
    // A stream begins with the newest state, and no other copy goes on from there.
    send(&other, Some(3), picture(0, 3)).await.unwrap();
    let permit = session.read_permit().unwrap();
    let mut fenced = first.fence(permit, FLOW).await.unwrap();
    assert_eq!(fenced.state().latest_frame(), 3);
    drop(fenced);
    let copy = cached(&other).await.version().unwrap();
    let newest = session.version().unwrap();
    assert_eq!((copy.frame, newest.frame), (3, 3));
    assert_ne!(copy.generation, newest.generation);
    let next = send(&other, Some(4), picture(0, 4)).await.unwrap();
    assert_eq!(next.estimates[0].first().frame, 4);
}

/// Two replicas by one clock, whose store is a folder, and the first of which has opened a session.
async fn two_by(clock: &Clock, folder: &std::path::Path) -> ([SessionService; 2], Arc<FileStore>) {
    let store = FileStore::open(folder, Durability::default(), LONG, clock.clone());
    let store = Arc::new(store.unwrap());
    let first = service_by(clock.clone(), Some(store.clone()), 1);
    let mut of = parts(clock.clone(), Some(store.clone()), 1);
    of.settings.work_timeout = Duration::from_millis(50);
    open(&first, ID, start(1)).await;
    ([first, SessionService::new(of)], store)
}

#[tokio::test]
async fn a_session_lives_as_long_as_the_store_says() {
    let (folder, clock) = (tempfile::tempdir().unwrap(), Clock::default());
    let ([first, other], store) = two_by(&clock, folder.path()).await;
    let (minute, later) = (Duration::from_secs(60), LONG - Duration::from_secs(60));
    // The session lives longer here, since the other replica has answered a stored frame again.
    send(&first, Some(1), picture(0, 1)).await.unwrap();
    let session = cached(&other).await;
    clock.advance(later);
    assert!(session.ttl() <= minute);
    send(&first, Some(1), picture(0, 1)).await.unwrap();
    other.refresh(&session, None, FLOW).await.unwrap();
    assert!(session.ttl() > later, "{:?}", session.ttl());
    // A frame for which there was no time renews the session here and in the store.
    clock.advance(later);
    let at_work = session.enter().unwrap().lock().await.unwrap();
    let refused = send(&other, Some(2), picture(0, 2)).await.unwrap_err();
    let deadline = FramesError::Act(ActError::Stopped(Stopped::Deadline));
    assert_eq!(refused.to_string(), deadline.to_string());
    drop(at_work);
    let stored = store.load(ID).await.unwrap().unwrap();
    assert!(
        stored.ttl > later && session.ttl() > later,
        "{:?}",
        stored.ttl
    );
    // A look does not renew it.
    clock.advance(later);
    other.refresh(&session, None, FLOW).await.unwrap();
    assert!(session.ttl() <= minute, "{:?}", session.ttl());
    clock.advance(minute);
    let expired = other.find(ID, &Owner::default(), FLOW).await.unwrap_err();
    assert_matches!(expired, ActError::NoSession(NoSession::Expired));
}

#[tokio::test]
async fn a_session_that_the_store_has_lost_is_told_as_lost() {
    let folder = tempfile::tempdir().unwrap();
    let clock = Clock::default();
    let ([first, _], store) = two_by(&clock, folder.path()).await;
    let session = cached(&first).await;
    // As if the store had been begun anew: the record is gone, and no mark says that the session was ended.
    assert!(
        store
            .end(session.name(), Duration::from_millis(1))
            .await
            .unwrap()
    );
    clock.advance(Duration::from_secs(1));
    let lost = send(&first, Some(1), picture(0, 1)).await.unwrap_err();
    assert_matches!(lost, FramesError::Act(ActError::NoSession(NoSession::Lost)));
    assert!(!first.registry.is_live(ID));
}
