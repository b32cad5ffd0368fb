//! The store in a Redis: what it counts, how long it keeps what it has, and what it does without a Redis.

use crate::folder::Known;
use crate::suite::{TTL, holds_for, is_committed, record, told};
use bagtrack_sessions::{
    Clock, Commit, Counted, Outcome, RedisAddress, RedisStore, SessionName, SessionStore,
    StoreShare,
};
use bagtrack_testing::processes::{Process, free_port, redis_server};
use bytes::Bytes;
use redis::FromRedisValue;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use uuid::Uuid;

const LONG: Duration = Duration::from_secs(5);
/// Time-out of a store that does not answer; also a busy machine answers in less.
const SHORT: Duration = Duration::from_secs(1);

/// A Redis that ends with the test.
pub struct Redis {
    _process: Process,
    pub port: u16,
}

impl Redis {
    pub fn start() -> Self {
        Self::start_at(free_port())
    }

    fn start_at(port: u16) -> Self {
        let flags = ["--port", &port.to_string()];
        Self {
            _process: redis_server(Path::new("."), port, &flags),
            port,
        }
    }

    pub async fn store(&self, timeout: Duration) -> RedisStore {
        store_at(self.port, timeout).await
    }

    /// What a command answers.
    pub fn ask<T: FromRedisValue>(&self, words: &[&str]) -> T {
        let client = redis::Client::open(format!("redis://127.0.0.1:{}", self.port)).unwrap();
        let mut command = redis::cmd(words[0]);
        command.arg(&words[1..]);
        command
            .query(&mut client.get_connection().unwrap())
            .unwrap()
    }
}

async fn store_at(port: u16, timeout: Duration) -> RedisStore {
    let address = RedisAddress::parse(&format!("redis://127.0.0.1:{port}"), timeout).unwrap();
    let store = RedisStore::connect(address, "suite", timeout, Clock::default());
    store.await.unwrap()
}

/// A proxy before a Redis that can silence its connections: from then on they carry no byte, and not even their end.
struct Link {
    port: u16,
    /// How often all connections so far were silenced.
    silences: Arc<AtomicUsize>,
}

impl Link {
    fn to(redis: &Redis) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (port, to) = (listener.local_addr().unwrap().port(), redis.port);
        let silences = Arc::new(AtomicUsize::new(0));
        let all = silences.clone();
        std::thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                let Ok(server) = TcpStream::connect(("127.0.0.1", to)) else {
                    return;
                };
                let begun = all.load(Ordering::Acquire);
                for (mut from, mut to) in [
                    (client.try_clone().unwrap(), server.try_clone().unwrap()),
                    (server, client),
                ] {
                    let all = all.clone();
                    std::thread::spawn(move || {
                        let mut bytes = [0; 4096];
                        while let Ok(length @ 1..) = from.read(&mut bytes) {
                            let speaks = all.load(Ordering::Acquire) == begun;
                            if speaks && to.write_all(&bytes[..length]).is_err() {
                                return;
                            }
                        }
                    });
                }
            }
        });
        Self { port, silences }
    }

    fn silence(&self) {
        self.silences.fetch_add(1, Ordering::AcqRel);
    }
}

async fn until(what: &str, is_so: impl Fn() -> bool) {
    let waits = bagtrack_sessions::clock::now();
    while !is_so() {
        assert!(waits.elapsed() < 12 * LONG, "{what}");
        bagtrack_sessions::clock::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn redis_keeps_to_the_rules() {
    let redis = Redis::start();
    holds_for(&redis.store(LONG).await).await;
}

fn share(client: &str, max_places: usize, max_bytes: usize) -> StoreShare {
    StoreShare {
        client: client.to_owned(),
        max_places,
        max_bytes,
    }
}

fn counted(seed: u64) -> Counted {
    Counted {
        name: SessionName {
            id: Uuid::from_u128(seed.into()),
            incarnation: seed,
        },
        places: 2,
        bytes: 100,
        ttl: TTL,
    }
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn in_redis_a_client_has_so_many_places_and_bytes_until_its_sessions_end() {
    let redis = Redis::start();
    let store = redis.store(LONG).await;
    let admit = async |client: &str, places, bytes, seed| {
        let share = share(client, places, bytes);
        store.admit(&share, counted(seed)).await.unwrap()
    };
    let mut known = Vec::new();
    for seed in 1..=40 {
        assert!(admit("one", 80, 4000, seed).await, "{seed}");
        known.push(Known::create(&store, seed, TTL).await);
    }
    assert!(!admit("one", 81, 9000, 41).await, "it has 80 places of 81");
    assert!(!admit("one", 100, 4099, 41).await, "it has 4,000 bytes");
    assert!(admit("other", 80, 4000, 42).await);
    // The newest is not among the 32 that are looked at first.
    assert!(store.end(known[39].name, TTL).await.unwrap());
    assert!(admit("one", 80, 4000, 43).await);
    Known::create(&store, 43, TTL).await;
    assert!(!admit("one", 80, 4000, 44).await);
}

/// Looking for room takes 263 calls of Redis.
#[tokio::test]
#[ignore = "needs redis-server"]
async fn refusals_of_one_client_do_not_look_for_room_each_time() {
    let redis = Redis::start();
    let store = redis.store(LONG).await;
    let share = share("one", 80, 4000);
    let admit = async |seed| store.admit(&share, counted(seed)).await.unwrap();
    for seed in 1..=40 {
        assert!(admit(seed).await, "{seed}");
        Known::create(&store, seed, TTL).await;
    }
    let scripts = || {
        let stats: String = redis.ask(&["INFO", "commandstats"]);
        let line = stats.lines().find(|line| line.contains("_evalsha:"));
        let calls = line.and_then(|line| line.split(['=', ',']).nth(1)).unwrap();
        calls.parse::<u64>().unwrap()
    };
    let before = scripts();
    assert!(!admit(41).await);
    let once = scripts() - before;
    assert!(once > 80, "it looks at 40 sessions: {once}");
    let begun = bagtrack_sessions::clock::now();
    for _ in 0..10 {
        assert!(!admit(41).await);
    }
    let further = scripts() - before - once;
    let looks = begun.elapsed().as_secs() + 1;
    assert!(further >= 10 && further <= 10 + looks * once, "{further}");
    // A moment later the store looks for room again.
    bagtrack_sessions::clock::sleep(Duration::from_millis(1100)).await;
    let before = scripts();
    assert!(!admit(41).await);
    assert!(scripts() - before > 80);
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn all_that_is_in_redis_goes_by_itself() {
    let redis = Redis::start();
    let store = redis.store(LONG).await;
    assert!(
        store
            .admit(&share("one", 9, 900), counted(1))
            .await
            .unwrap()
    );
    let mut session = Known::create(&store, 1, TTL / 2).await;
    session.advance_for(&store, TTL).await;
    let ended = Known::create(&store, 2, TTL).await;
    assert!(store.end(ended.name, 2 * TTL).await.unwrap());
    store.secret([1; 32]).await.unwrap();
    let keys: Vec<String> = redis.ask(&["KEYS", "*"]);
    let day = Duration::from_secs(24 * 3600);
    let mut kinds = Vec::new();
    for key in keys {
        let left: i64 = redis.ask(&["PTTL", &key]);
        let kind = key.split(':').nth(1).unwrap().to_owned();
        let (least, most) = match &kind[..] {
            "probe" => (Duration::ZERO, Duration::from_secs(1)),
            "session" => (TTL / 2, TTL),
            "ended" => (TTL, 2 * TTL),
            "secret" => (30 * day - TTL, 30 * day),
            "client" => (7 * day - TTL, 7 * day),
            _ => panic!("{key}"),
        };
        // `PTTL` is -2 for a key that has gone meanwhile.
        let is_gone = kind == "probe" && left == -2;
        let left = Duration::from_millis(u64::try_from(left).unwrap_or(0));
        assert!(is_gone || (left > least && left <= most), "{key}: {left:?}");
        kinds.push(kind);
    }
    kinds.retain(|kind| kind != "probe");
    kinds.sort();
    assert_eq!(kinds, ["client", "ended", "secret", "session"]);
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn a_commit_leaves_only_the_record_whatever_redis_says_to_its_transaction() {
    let redis = Redis::start();
    let store = redis.store(LONG).await;
    let mut session = Known::create(&store, 1, TTL).await;
    let all_is_well = || {
        let keys: Vec<String> = redis.ask(&["KEYS", "*"]);
        let others = keys.iter().filter(|key| !key.starts_with("suite:probe"));
        assert!(others.count() == 1, "{keys:?}");
    };
    // The script is not known yet, known, and forgotten.
    session.advance(&store).await;
    all_is_well();
    session.advance(&store).await;
    all_is_well();
    let _: String = redis.ask(&["SCRIPT", "FLUSH"]);
    let before_last = session.version;
    session.advance(&store).await;
    all_is_well();
    // A commit of a replica that comes second.
    let late = Commit {
        name: session.name,
        before: before_last,
        frame: session.version.frame,
        state: Some(Bytes::from_static(b"late")),
        takes_over: false,
        ttl: TTL,
    };
    let refused = store.commit(late).await.unwrap();
    assert!(session.is(&told(refused)));
    all_is_well();
    // A command of the transaction is not allowed.
    let _: String = redis.ask(&["ACL", "SETUSER", "default", "-rename"]);
    session.advance(&store).await;
    all_is_well();
    assert!(session.is(&store.load(session.name.id).await.unwrap().unwrap()));
    assert_eq!(store.failures(), 0);
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn a_redis_that_went_is_told_at_once_and_found_again() {
    let redis = Redis::start();
    let port = redis.port;
    let store = redis.store(SHORT).await;
    assert!(store.is_ready());
    assert_eq!(store.failures(), 0);
    Known::create(&store, 1, TTL).await;
    drop(redis);
    assert!(store.load(Uuid::from_u128(1)).await.is_err());
    assert!(!store.is_ready());
    let failures = store.failures();
    let asked = bagtrack_sessions::clock::now();
    let refused = store.load(Uuid::from_u128(1)).await.unwrap_err();
    assert!(refused.to_string().contains("lately"), "{refused}");
    println!("refused after {:?}", asked.elapsed());
    assert!(store.failures() > failures);
    let _redis = Redis::start_at(port);
    until("it is found again", || store.is_ready()).await;
    assert!(store.load(Uuid::from_u128(1)).await.unwrap().is_none());
    Known::create(&store, 1, TTL).await;
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn a_connection_that_says_nothing_any_more_is_left_for_another() {
    let redis = Redis::start();
    let link = Link::to(&redis);
    let store = store_at(link.port, SHORT).await;
    let mut session = Known::create(&store, 1, TTL).await;
    for _ in 0..2 {
        link.silence();
        assert!(store.load(session.name.id).await.is_err());
        until("another is made", || store.is_ready()).await;
        assert!(store.load(session.name.id).await.unwrap().is_some());
        session.advance(&store).await;
    }
}

/// A connection that was refused while it was made does not connect again by itself.
#[tokio::test]
#[ignore = "needs redis-server"]
async fn a_redis_that_has_refused_a_password_is_found_again_when_it_takes_it() {
    let redis = Redis::start();
    let set = |password: &str| redis.ask::<String>(&["CONFIG", "SET", "requirepass", password]);
    let url = format!("redis://:the-password@127.0.0.1:{}", redis.port);
    set("the-password");
    let address = RedisAddress::parse(&url, SHORT).unwrap();
    let store = RedisStore::connect(address, "suite", SHORT, Clock::default())
        .await
        .unwrap();
    let mut session = Known::create(&store, 1, TTL).await;

    let client = redis::Client::open(url).unwrap();
    let mut admin = client.get_connection().unwrap();
    for password in ["another", "the-password"] {
        let mut configure = redis::cmd("CONFIG");
        configure.arg(&["SET", "requirepass", password]);
        configure.exec(&mut admin).unwrap();
        let mut kill = redis::cmd("CLIENT");
        kill.arg(&["KILL", "TYPE", "normal", "SKIPME", "yes"]);
        kill.exec(&mut admin).unwrap();
        let takes = password == "the-password";
        until(password, || store.is_ready() == takes).await;
    }
    assert!(store.load(session.name.id).await.unwrap().is_some());
    session.advance(&store).await;
}

#[tokio::test]
#[ignore = "needs redis-server"]
async fn a_redis_without_room_takes_no_session_and_one_that_refuses_is_not_ready() {
    let redis = Redis::start();
    let store = redis.store(LONG).await;
    let mut session = Known::create(&store, 1, TTL).await;
    assert!(!store.is_full());
    let used: String = redis.ask(&["INFO", "memory"]);
    let used = used
        .lines()
        .find_map(|line| line.strip_prefix("used_memory:"));
    let used: u64 = used.unwrap().parse().unwrap();
    // Some 95 % are used: frames are taken.
    let most = (used + used / 20).to_string();
    let set = |most: &str| redis.ask::<String>(&["CONFIG", "SET", "maxmemory", most]);
    set(&most);
    until("it is known to be nearly full", || store.is_full()).await;
    let created = store
        .create(Uuid::from_u128(2), &record(2, 0, b"zero"))
        .await;
    assert_eq!(created.unwrap(), Outcome::Full);
    assert!(store.is_full() && store.is_ready());
    session.advance(&store).await;
    // All memory is used: the store finds that out without a session's call.
    set("1");
    until("it is known to refuse", || !store.is_ready()).await;
    let asked = bagtrack_sessions::clock::now();
    let refused = store.fence(session.name, session.version).await;
    assert!(refused.is_err(), "{refused:?}");
    assert!(asked.elapsed() < LONG, "it was asked again and again");
    set("0");
    until("it takes writes again", || store.is_ready()).await;
    let created = store
        .create(Uuid::from_u128(2), &record(2, 0, b"zero"))
        .await;
    assert!(is_committed(&created.unwrap()) && !store.is_full());
    session.advance(&store).await;
}

/// The store has to know this before the first session is opened.
#[tokio::test]
#[ignore = "needs redis-server"]
async fn a_redis_that_does_not_say_how_full_it_is_is_not_ready() {
    let redis = Redis::start();
    let store = redis.store(LONG).await;
    assert!(store.is_ready());
    let allow = |right: &str| redis.ask::<String>(&["ACL", "SETUSER", "default", right]);
    allow("-info");
    until("it is known to refuse", || !store.is_ready()).await;
    allow("+info");
    until("it answers again", || store.is_ready()).await;
}
