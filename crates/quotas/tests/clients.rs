//! The accounts of clients, as the service uses them, without a socket.

use bagtrack_config::Config;
use bagtrack_quotas::{Client, ClientSessions, Clients, RequestPermit};
use bagtrack_sessions::{OpenError, SessionQuota, clock};
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::Duration;
use uuid::Uuid;

/// Clients of whom each may have 4 sessions and 6 requests in flight, and send a frame a second, 200 at once. At this
/// rate so few frames are regained that the test gives the same on a slow machine.
fn clients() -> Clients {
    let mut config = Config {
        max_frames: 200,
        ..Config::default()
    };
    config.limits.client_sessions = Some(4);
    config.limits.client_requests = Some(6);
    config.limits.client_frame_rate = 1;
    Clients::new(&config, false)
}

fn key() -> Client {
    Client::Key("ada".into())
}

fn page() -> Client {
    Client::Page("ada".into(), Uuid::from_u128(1))
}

fn address(number: u32) -> Client {
    Client::at(IpAddr::V4(Ipv4Addr::from_bits(number)))
}

/// Requests in flight, as many as the client is given.
fn requests(clients: &Clients, client: &Client) -> Vec<RequestPermit> {
    let account = clients.account(client);
    std::iter::from_fn(|| account.request().ok()).collect()
}

#[test]
fn a_page_has_half_of_its_keys_requests_and_takes_no_more_than_it_leaves() {
    let clients = clients();
    let of_page = requests(&clients, &page());
    assert_eq!(of_page.len(), 3);
    let of_key = requests(&clients, &key());
    assert_eq!(of_key.len(), 3, "the page's count as the key's");
    drop(of_page);
    let more_of_key = requests(&clients, &key());
    assert_eq!(more_of_key.len(), 3);
    assert!(requests(&clients, &page()).is_empty(), "the key has all");
    let refused = clients.account(&key()).request().unwrap_err();
    assert_eq!((refused.what, refused.limit), ("requests in flight", 6));
    drop(of_key);
    let of_page = requests(&clients, &page());
    assert_eq!(of_page.len(), 2, "of the three that are left");
}

#[test]
fn frames_of_a_page_count_as_its_keys() {
    let clients = clients();
    let (of_key, of_page) = (clients.account(&key()), clients.account(&page()));
    assert_eq!(of_page.count_frames(150), Ok(()));
    let (_, left) = of_key.frames().expect("they are counted");
    assert!((50..100).contains(&left), "{left} are left");
    assert_eq!(of_key.count_frames(50), Ok(()));
    let refused = of_page.count_frames(200).unwrap_err();
    assert_eq!((refused.what, refused.limit), ("frames a second", 1));
    let most = Duration::from_secs(200);
    assert!(
        refused.wait > most / 2 && refused.wait <= most,
        "{refused:?}"
    );
    let other = clients.account(&address(1));
    assert_eq!(
        other.count_frames(200),
        Ok(()),
        "another client has its own"
    );
}

#[test]
fn sessions_are_counted_by_their_targets_until_they_end() {
    let clients = clients();
    let quota = ClientSessions(clients.account(&key()));
    let three = quota.reserve(3, 1000).expect("four fit");
    assert_eq!(clients.account(&page()).sessions(), (4, 1));
    let refused = quota.reserve(2, 1000).map(drop).unwrap_err();
    assert!(
        matches!(refused, OpenError::Quota(full) if full.limit == 4),
        "{refused}"
    );
    let never = quota.reserve(5, 1000).map(drop).unwrap_err();
    assert!(
        matches!(never, OpenError::TooManyTargets { limit: 4, .. }),
        "{never}"
    );
    let one = quota.reserve(1, 1000).expect("one more fits");
    assert!(quota.check().is_err());
    drop((three, one));
    assert_eq!(clients.account(&key()).sessions(), (4, 4));
}

#[tokio::test]
async fn who_waits_for_a_request_gets_the_place_that_another_one_leaves() {
    let clients = Arc::new(clients());
    let mut held = requests(&clients, &key());
    let waiting = tokio::spawn({
        let account = clients.account(&key());
        async move { account.request_in_order().await }
    });
    tokio::task::yield_now().await;
    assert!(!waiting.is_finished());
    held.pop();
    let given = waiting.await.expect("it is given");
    assert!(clients.account(&key()).request().is_err());
    drop(given);
    assert!(clients.account(&key()).request().is_ok());
}

/// The holder of the place has to give it up, or other requests with its key would never get it.
#[tokio::test(start_paused = true)]
async fn the_place_for_a_video_is_wanted_where_another_of_the_client_waits() {
    let clients = clients();
    let account = clients.account(&key());
    let after = |seconds| clock::now() + Duration::from_secs(seconds);
    let held = account.video_until(after(1)).await.expect("it is free");
    let of_page = clients.account(&page());
    let next = tokio::spawn(async move { of_page.video_until(after(60)).await.is_ok() });
    account.videos()[0].wanted_from(after(30)).await;
    assert!(!next.is_finished());
    drop(held);
    assert!(next.await.expect("it does not panic"));
}

/// If the account were forgotten because of many other addresses, the key would get its whole burst again.
#[test]
fn a_key_that_has_sent_its_frames_is_remembered_beside_many_addresses() {
    let mut config = Config {
        max_frames: 20,
        ..Config::default()
    };
    config.limits.client_frame_rate = 1;
    let clients = Clients::new(&config, false);
    let at_once = clients
        .account(&key())
        .frames()
        .expect("they are counted")
        .1;
    while clients.account(&key()).count_frames(1).is_ok() {}
    for number in 0..5000 {
        clients.account(&address(number));
    }
    let left = clients
        .account(&key())
        .frames()
        .expect("they are counted")
        .1;
    assert!(left < at_once, "{left}");
}

#[test]
fn of_many_addresses_those_with_nothing_in_use_are_forgotten() {
    let clients = clients();
    let session = ClientSessions(clients.account(&address(0)));
    let held = session.reserve(1, 1000).expect("it fits");
    drop(session);
    let busy = clients.account(&address(0)).flow();
    let idle = clients.account(&address(1)).flow();
    for number in 2..5000 {
        clients.account(&address(number));
    }
    assert_eq!(clients.account(&address(0)).flow(), busy);
    assert_eq!(clients.account(&address(0)).sessions(), (4, 3));
    assert_ne!(
        clients.account(&address(1)).flow(),
        idle,
        "it is a new client"
    );
    drop(held);
}
