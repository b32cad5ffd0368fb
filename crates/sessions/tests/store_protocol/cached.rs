//! What one replica makes of a session that another has, in a store that works.

use crate::formats::{open, post};
use crate::memory::MemoryStore;
use crate::pictures::{FIRST, params, picture};
use crate::world::{ID, service};
use bagtrack_sessions::{
    ActError, Boxes, Flow, NoSession, Owner, SessionService, SessionStore, Start, clock,
};
use std::sync::Arc;
use std::time::Duration;

const FLOW: Flow = Flow(0);

fn start() -> Start {
    Start::Frame {
        file: picture(0, 0).into(),
        boxes: Boxes::One(FIRST),
        params: Box::new(params(1)),
    }
}

/// Two replicas, the first of which has opened a session.
async fn two() -> [SessionService; 2] {
    let store: Arc<dyn SessionStore> = Arc::new(MemoryStore::default());
    let replicas = [0, 1].map(|_| service(Some(store.clone()), 1));
    open(&replicas[0], ID, start()).await;
    replicas
}

#[tokio::test]
async fn a_session_of_another_replica_is_its_owner_s_alone() {
    let [_, other] = two().await;
    let of_ann = other.find(ID, &Owner::named("ann"), FLOW).await;
    assert!(
        matches!(of_ann, Err(ActError::NoSession(NoSession::Unknown))),
        "{of_ann:?}"
    );
    let own = other.find(ID, &Owner::default(), FLOW).await.unwrap();
    assert_eq!(own.latest_frame(), 0);
    other.end(ID, &Owner::default(), FLOW).await.unwrap();
}

#[tokio::test]
async fn a_session_that_was_ended_elsewhere_leaves_memory() {
    let [first, other] = two().await;
    other.end(ID, &Owner::default(), FLOW).await.unwrap();
    let cached = first.find(ID, &Owner::default(), FLOW).await.unwrap();
    let refused = first.refresh(&cached, None, FLOW).await;
    assert!(
        matches!(refused, Err(ActError::NoSession(NoSession::Unknown))),
        "{refused:?}"
    );
    assert!(!first.registry.is_live(ID));
    let gone = first.find(ID, &Owner::default(), FLOW).await;
    assert!(matches!(gone, Err(ActError::NoSession(_))), "{gone:?}");
}

#[tokio::test]
async fn an_early_frame_waits_for_those_that_another_replica_takes() {
    let [first, other] = two().await;
    let session = first.find(ID, &Owner::default(), FLOW).await.unwrap();
    let early = session.enter().unwrap();
    let place = || first.admission.enter(FLOW, Box::new(())).unwrap();
    let waiting = first.wait_for_turn(&early, place(), Some(2));
    let elsewhere = post(&other, ID, (1, picture(0, 1).into()));
    let (turn, posted) = tokio::join!(waiting, elsewhere);
    assert!(turn.is_ok() && posted.is_ok());
    assert!(!early.is_early(2), "the store has told of the frame before");
    assert_eq!(session.latest_frame(), 1);
    // Nobody sends the next one.
    tokio::time::pause();
    let begun = clock::now();
    assert!(first.wait_for_turn(&early, place(), Some(3)).await.is_ok());
    let waited = begun.elapsed();
    let patience = Duration::from_secs(2)..Duration::from_millis(2_400);
    assert!(patience.contains(&waited), "{waited:?}");
}
