//! What a replica writes when it ends.

use crate::formats::{open, post};
use crate::pictures::picture;
use crate::world::{ID, LONG, service, service_by, start};
use bagtrack_sessions::{Clock, Durability, FileStore, SessionStore};
use std::sync::Arc;

/// Seeds 3419 and 13250 of the simulation. After a jump of its clock, the session has no time left by the replica's
/// clock. If the last state were written with that time to live, the store would drop the record.
#[tokio::test]
async fn a_session_outlives_a_jump_of_the_clock_of_a_replica_that_ends() {
    let folder = tempfile::tempdir().unwrap();
    let store = FileStore::open(folder.path(), Durability::default(), LONG, Clock::default());
    let store: Arc<dyn SessionStore> = Arc::new(store.unwrap());
    let clock = Clock::default();
    let ending = service_by(clock.clone(), Some(store.clone()), 3);
    open(&ending, ID, start(1)).await;
    // Its state is not in the store yet.
    post(&ending, ID, (1, picture(0, 1).into())).await.unwrap();
    clock.advance(2 * LONG);
    ending.flush().await;

    let other = service(Some(store), 3);
    let answer = post(&other, ID, (2, picture(0, 2).into())).await;
    assert_eq!(answer.unwrap().first().frame, 2);
}
