//! Sessions that are opened, found, and ended.

use crate::common::assert_matches;
use crate::world::{
    FIRST, FLOW, FREE, LEASE, Quota, SECOND, SESSIONS, at_first, open, params, parts, picture,
    post_numbered, request, service,
};
use bagtrack_sessions::{
    ActError, Boxes, Clock, CreationKey, NoSession, OpenError, Owner, Registry, SessionService,
    Start, StartError, TooManySessions,
};
use bagtrack_tracker::{ImplausibleBox, Rect};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use uuid::Uuid;

const ID: Uuid = Uuid::from_u128(7);
const SECOND_OF_TIME: Duration = Duration::from_secs(1);

fn key(name: &str) -> Option<CreationKey> {
    Some(CreationKey::Key(Owner::default(), name.to_owned()))
}

async fn missing(service: &SessionService, id: Uuid, owner: &Owner) -> NoSession {
    match service.find(id, owner, FLOW).await {
        Err(ActError::NoSession(missing)) => missing,
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_request_that_comes_again_finds_the_session_that_it_opened() {
    let service = service(&Clock::default());
    let begin = || at_first(Boxes::One(FIRST));
    let ask = async |key, digest| service.open(request(&service, key, digest, begin())).await;
    let first = ask(key("one"), 1).await.unwrap();
    let again = ask(key("one"), 1).await.unwrap();
    assert!(!first.replayed && again.replayed);
    assert_eq!(first.session.id(), again.session.id());
    let reused = ask(key("one"), 2).await;
    assert!(matches!(reused, Err(OpenError::KeyReused)), "{reused:?}");
    // Each owner has keys of its own.
    let mut of_ann = request(&service, None, 1, begin());
    of_ann.owner = Owner::named("ann");
    of_ann.key = Some(CreationKey::Key(of_ann.owner.clone(), "one".to_owned()));
    let of_ann = service.open(of_ann).await.unwrap();
    assert!(!of_ann.replayed && of_ann.session.id() != first.session.id());
    // After the session has ended, the same key opens a new one.
    let id = first.session.id();
    service.end(id, &Owner::default(), None).await.unwrap();
    let anew = ask(key("one"), 2).await.unwrap();
    assert!(!anew.replayed && anew.session.id() != id);
    // Without a name each request opens one.
    let nameless = ask(None, 2).await.unwrap();
    assert!(!nameless.replayed && nameless.session.id() != anew.session.id());
}

#[tokio::test]
async fn a_client_that_makes_the_id_gets_it_and_nobody_else_does() {
    let service = service(&Clock::default());
    let named = || Some(CreationKey::Id(ID));
    let begin = || at_first(Boxes::One(FIRST));
    let first = service.open(request(&service, named(), 1, begin())).await;
    assert_eq!(first.unwrap().session.id(), ID);
    let again = service.open(request(&service, named(), 1, begin())).await;
    assert!(again.unwrap().replayed);
    let other = service.open(request(&service, named(), 2, begin())).await;
    assert!(matches!(other, Err(OpenError::Exists)), "{other:?}");
    let mut of_ann = request(&service, named(), 1, begin());
    of_ann.owner = Owner::named("ann");
    let of_ann = service.open(of_ann).await;
    assert!(matches!(of_ann, Err(OpenError::Exists)), "{of_ann:?}");
}

#[tokio::test]
async fn a_full_service_opens_none_until_a_session_has_gone() {
    let clock = Clock::default();
    let service = service(&clock);
    let mut all = Vec::new();
    for number in 0..SESSIONS {
        assert_eq!(service.registry.len(), number);
        assert!(service.check_room(&FREE).is_ok());
        all.push(open(&service, Boxes::One(FIRST)).await);
    }
    for key in [None, key("one more")] {
        let one_more = request(&service, key, 0, at_first(Boxes::One(FIRST)));
        let refused = service.open(one_more).await.unwrap_err();
        let full = TooManySessions(SESSIONS);
        assert_matches!(refused, OpenError::Act(ActError::TooManySessions(told)) if *told == full);
    }
    assert!(service.check_room(&FREE).is_err());
    // The session that was used lives, the others have expired.
    clock.advance(LEASE.first - SECOND_OF_TIME);
    let used = &all[1];
    post_numbered(&service, used, 1, vec![picture(1)])
        .await
        .unwrap();
    clock.advance(SECOND_OF_TIME);
    assert!(service.check_room(&FREE).is_ok());
    assert_eq!(service.registry.len(), 1);
    assert!(service.registry.is_live(used.id()) && !service.registry.is_empty());
    open(&service, Boxes::One(FIRST)).await;
    assert_eq!(service.registry.all().len(), 2);
}

#[tokio::test]
async fn sessions_take_no_more_memory_than_there_is() {
    let clock = Clock::default();
    let with = |bytes: usize| {
        let mut parts = parts(&clock);
        parts.registry = Registry::new(SESSIONS, 4, LEASE, clock.clone()).with_memory(bytes);
        SessionService::new(parts)
    };
    let bytes = params().session_bytes();
    let service = with(2 * bytes);
    let first = open(&service, Boxes::One(FIRST)).await;
    open(&service, Boxes::One(FIRST)).await;
    let third = request(&service, None, 0, at_first(Boxes::One(FIRST)));
    let refused = service.open(third).await;
    let is_full = |refused: &Result<_, OpenError>| {
        matches!(refused, Err(OpenError::Act(ActError::TooManySessions(_))))
    };
    assert!(is_full(&refused), "{refused:?}");
    assert!(service.registry.remove(first.name()));
    drop(first);
    open(&service, Boxes::One(FIRST)).await;
    let service = with(2 * bytes - 1);
    let list = Boxes::List(vec![FIRST, SECOND]);
    let refused = service
        .open(request(&service, None, 0, at_first(list)))
        .await;
    assert!(is_full(&refused), "{refused:?}");
}

#[tokio::test]
async fn a_service_that_ends_and_a_client_without_a_share_open_none() {
    let service = service(&Clock::default());
    let ask = |is_free, targets| {
        let list = Boxes::List(vec![FIRST, SECOND]);
        let mut asked = request(&service, key("of a client"), 0, at_first(list));
        asked.quota = Arc::new(Quota { is_free, targets });
        service.open(asked)
    };
    for (is_free, targets) in [(false, 2), (true, 1)] {
        let refused = ask(is_free, targets).await;
        assert!(matches!(refused, Err(OpenError::Quota(_))), "{refused:?}");
    }
    assert!(service.registry.is_empty());
    assert!(ask(true, 2).await.is_ok());
    assert!(!service.is_draining());
    service.drain();
    assert!(service.is_draining());
    assert!(ask(true, 2).await.unwrap().replayed, "it is open");
    let refused = service.check_room(&FREE);
    assert!(matches!(refused, Err(OpenError::Draining)), "{refused:?}");
}

#[tokio::test]
async fn what_a_session_cannot_begin_with_is_told_with_the_box_that_is_wrong() {
    let service = service(&Clock::default());
    let fractions = Rect::new(0.1, 0.1, 0.5, 0.5);
    let outside = Rect::new(500.0, 400.0, 10.0, 10.0);
    let ask = async |start| {
        let refused = service.open(request(&service, None, 0, start)).await;
        refused.unwrap_err()
    };
    for (boxes, expected) in [
        (Boxes::One(fractions), None),
        (Boxes::List(vec![FIRST, fractions]), Some((1, 2))),
    ] {
        let refused = ask(at_first(boxes)).await;
        let OpenError::Box { error, listed } = refused else {
            panic!("{refused}");
        };
        assert!(matches!(error, ImplausibleBox::Fractions { .. }), "{error}");
        assert_eq!(listed, expected);
    }
    for (boxes, which, expected) in [
        (Boxes::One(outside), 0, None),
        (Boxes::List(vec![FIRST, outside]), 1, Some(2)),
    ] {
        let refused = ask(at_first(boxes)).await;
        let OpenError::Start { error, listed } = refused else {
            panic!("{refused}");
        };
        assert_matches!(error, StartError::Refused { target, .. } if *target == which);
        assert_eq!(listed, expected);
    }
    let no_picture = Start::Frame {
        file: "no picture".into(),
        boxes: Boxes::One(FIRST),
        params: Box::new(params()),
    };
    let refused = ask(no_picture).await;
    assert!(matches!(refused, OpenError::Frame(_)), "{refused}");
    let refused = ask(Start::Snapshot("no snapshot".into())).await;
    assert!(matches!(refused, OpenError::Snapshot(_)), "{refused}");
    assert!(service.registry.is_empty());
}

#[tokio::test]
async fn a_session_is_its_owner_s_until_it_expires_or_is_ended() {
    let clock = Clock::with_wall(|| SystemTime::UNIX_EPOCH + Duration::from_secs(1_800_000_000));
    let service = service(&clock);
    let (nobody, ann) = (Owner::default(), Owner::named("ann"));
    let session = open(&service, Boxes::One(FIRST)).await;
    let id = session.id();
    // The moment of opening has a fraction of a second, so the expiry may round down.
    let opened = session.opening().expires;
    assert!(
        (1_800_000_059..=1_800_000_060).contains(&opened),
        "{opened}"
    );
    let expires = service.registry.expires_at(&session);
    let expected = SystemTime::UNIX_EPOCH + Duration::from_secs(1_800_000_060);
    let off = expires.duration_since(expected);
    let off = off.unwrap_or_else(|early| early.duration());
    assert!(off < SECOND_OF_TIME, "{expires:?}");
    assert_eq!(service.find(id, &nobody, FLOW).await.unwrap().id(), id);
    assert_eq!(missing(&service, id, &ann).await, NoSession::Unknown);

    clock.advance(LEASE.first);
    assert_eq!(missing(&service, id, &ann).await, NoSession::Unknown);
    assert_eq!(missing(&service, id, &nobody).await, NoSession::Expired);
    assert!(session.is_closed());
    // The expiry is remembered for an hour.
    clock.advance(Duration::from_secs(3_599));
    assert_eq!(missing(&service, id, &nobody).await, NoSession::Expired);
    clock.advance(SECOND_OF_TIME);
    assert_eq!(missing(&service, id, &nobody).await, NoSession::Unknown);

    let ended = open(&service, Boxes::One(FIRST)).await;
    let id = ended.id();
    let refused = service.end(id, &ann, None).await;
    assert_matches!(refused, Err(ActError::NoSession(NoSession::Unknown)));
    service.end(id, &nobody, None).await.unwrap();
    assert_eq!(missing(&service, id, &nobody).await, NoSession::Unknown);
    assert!(service.end(id, &nobody, None).await.is_err());
    assert!(!service.registry.remove(ended.name()));
}

#[tokio::test]
async fn expired_sessions_are_swept_and_those_in_use_are_not() {
    let clock = Clock::default();
    let service = service(&clock);
    let used = open(&service, Boxes::One(FIRST)).await;
    let idle = open(&service, Boxes::One(FIRST)).await;
    let permit = used.enter().unwrap();
    clock.advance(LEASE.first - SECOND_OF_TIME);
    assert_eq!(service.registry.sweep(), 0);
    clock.advance(SECOND_OF_TIME);
    assert_eq!(service.registry.sweep(), 1);
    assert!(idle.is_closed() && !used.is_closed());
    assert!(service.registry.is_live(used.id()));
    drop(permit);
    assert!(!service.registry.is_live(used.id()));
    assert_eq!(service.registry.sweep(), 1);
    assert!(service.registry.is_empty());
}

#[tokio::test]
async fn the_first_lease_is_no_longer_than_the_idle_one() {
    let clock = Clock::default();
    let mut of = parts(&clock);
    let lease = bagtrack_sessions::Lease {
        first: LEASE.idle,
        idle: LEASE.first,
    };
    of.registry = Registry::new(SESSIONS, 4, lease, clock.clone());
    let service = SessionService::new(of);
    let session = open(&service, Boxes::One(FIRST)).await;
    assert_eq!(service.registry.first_lease(), LEASE.first);
    assert_eq!(service.registry.idle_lease(), LEASE.first);
    let left = session.ttl();
    assert!(left <= LEASE.first && left > LEASE.first / 2, "{left:?}");
}

#[tokio::test]
async fn names_of_sessions_that_have_ended_are_dropped() {
    let service = service(&Clock::default());
    let begin = || at_first(Boxes::One(FIRST));
    let opened = service.open(request(&service, key("one"), 1, begin()));
    let session = opened.await.unwrap().session;
    service.prune();
    let again = service.open(request(&service, key("one"), 2, begin()));
    assert!(matches!(again.await, Err(OpenError::KeyReused)));
    service
        .end(session.id(), &Owner::default(), None)
        .await
        .unwrap();
    service.prune();
    let none = format!("{:?}", service.opened);
    assert!(!none.contains(&session.id().to_string()), "{none}");
}
