//! Requests with an idempotency key, at replicas with one store.

use crate::common::{FIRST, request};
use crate::hostile::HostileStore;
use crate::pictures::{params, picture};
use crate::redis::Redis;
use crate::world::{LONG, service};
use bagtrack_sessions::{
    Boxes, Clock, CreationKey, Durability, FileStore, OpenError, OpenRequest, Opened, Owner,
    SessionService, SessionStore, Start,
};
use std::sync::Arc;
use std::time::Duration;

/// Asks for a session under a key, with this file as its first frame.
async fn ask(
    service: &SessionService,
    owner: &Owner,
    key: &str,
    file: Vec<u8>,
) -> Result<Opened, OpenError> {
    let key = CreationKey::Key(owner.clone(), key.to_owned());
    let digest = u8::try_from(file.len() % 251).unwrap();
    let start = Start::Frame {
        file: file.into(),
        boxes: Boxes::One(FIRST),
        params: Box::new(params(1)),
    };
    let request = OpenRequest {
        owner: owner.clone(),
        ..request(service, Some(key), digest, start)
    };
    service.open(request).await
}

/// Requests with a key, some of which are refused, at two replicas with this store.
async fn keys_hold_for(store: Arc<dyn SessionStore>) {
    let one = service(Some(store.clone()), 1);
    let other = service(Some(store), 1);
    let (ann, ben) = (Owner::named("ann"), Owner::named("ben"));
    let good = || picture(0, 0);
    // The first request with the key is refused.
    let refused = ask(&one, &ann, "a", b"no picture".to_vec()).await;
    assert!(matches!(refused, Err(OpenError::Frame(_))), "{refused:?}");
    let first = ask(&one, &ann, "a", good()).await.unwrap();
    assert!(!first.replayed);
    for replica in [&one, &other] {
        let again = ask(replica, &ann, "a", good()).await.unwrap();
        assert!(again.replayed);
        assert_eq!(again.session.name(), first.session.name());
        let reused = ask(replica, &ann, "a", picture(0, 1)).await;
        assert!(matches!(reused, Err(OpenError::KeyReused)), "{reused:?}");
    }
    // Each owner has keys of its own.
    let of_ben = ask(&other, &ben, "a", good()).await.unwrap();
    assert!(!of_ben.replayed && of_ben.session.id() != first.session.id());
    // Both come at once.
    for key in ["b", "c", "d"] {
        let both = tokio::join!(ask(&one, &ann, key, good()), ask(&other, &ann, key, good()));
        let both = (both.0.unwrap(), both.1.unwrap());
        assert_eq!(both.0.session.name(), both.1.session.name());
        assert!(both.0.replayed != both.1.replayed, "one has opened it");
    }
    // After the session has ended, the same key opens a new one.
    one.end(first.session.id(), &ann, None).await.unwrap();
    let anew = ask(&other, &ann, "a", good()).await.unwrap();
    assert!(!anew.replayed && anew.session.name() != first.session.name());
}

#[tokio::test]
async fn with_a_store_in_memory_a_key_opens_one_session() {
    keys_hold_for(Arc::new(HostileStore::at_once())).await;
}

#[tokio::test]
async fn with_a_store_in_a_folder_a_key_opens_one_session() {
    let folder = tempfile::tempdir().unwrap();
    let store = FileStore::open(folder.path(), Durability::default(), LONG, Clock::default());
    keys_hold_for(Arc::new(store.unwrap())).await;
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn with_a_store_in_redis_a_key_opens_one_session() {
    let redis = Redis::start();
    keys_hold_for(Arc::new(redis.store(Duration::from_secs(5)).await)).await;
}

/// If each refused request left a key, 54,000 of them would fill a Redis of 14 MB, and no client's frames could be
/// taken.
#[tokio::test]
#[ignore = "needs redis-server"]
async fn requests_with_keys_that_are_refused_leave_nothing_in_redis() {
    let redis = Redis::start();
    let store = redis.store(Duration::from_secs(5)).await;
    let service = service(Some(Arc::new(store)), 1);
    for key in ["a", "b", "c"] {
        let refused = ask(&service, &Owner::default(), key, b"x".to_vec()).await;
        assert!(matches!(refused, Err(OpenError::Frame(_))), "{refused:?}");
    }
    let mut kept: Vec<String> = redis.ask(&["KEYS", "*"]);
    kept.retain(|key| key != "suite:probe");
    assert_eq!(kept, ["suite:secret"]);
}
