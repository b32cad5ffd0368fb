//! Three replicas, a Redis and lossy networks, while replicas are killed and Redis is started again.
//!
//! No track is lost, no answered frame is lost, and every box is that of an undisturbed run.

use crate::balancers::{haproxy, nginx};
use crate::clip::Clip;
use crate::lossy::Lossy;
use crate::replica::Replica;
use crate::server::Redis;
use crate::tracking_client::{Answer, Track};
use rand::RngExt;
use reqwest::Client;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::sync::Notify;
use tokio::task::JoinSet;

/// A number that the environment may set.
pub fn setting(name: &str, default: usize) -> usize {
    let text = std::env::var(name).ok();
    text.map_or(default, |text| text.parse().expect("a number"))
}

/// What the clients have reached together.
#[derive(Default)]
pub struct Progress {
    pub frames: AtomicUsize,
    pub moved: Notify,
}

impl Progress {
    pub async fn reaches(&self, frames: usize) {
        loop {
            let moved = self.moved.notified();
            if self.frames.load(Ordering::Acquire) >= frames {
                return;
            }
            moved.await;
        }
    }
}

/// With the same secret, snapshots of the same state are the same bytes.
pub const SECRET: [&str; 2] = ["--snapshot-keys", "a secret of these tests"];

/// The boxes without a store and without failures, which are rounded, and the states that they lead to, which are not.
pub async fn undisturbed(clips: &[Clip]) -> Vec<(Vec<Answer>, Vec<u8>)> {
    let alone = Replica::start(&SECRET);
    let mut tracks = Vec::new();
    for (number, clip) in clips.iter().enumerate() {
        let track = Track::open(alone.url(""), Client::new(), number, clip.clone());
        let mut track = track.await;
        while track.advance().await {}
        let state = track.snapshot().await;
        tracks.push((track.answers, state));
    }
    tracks
}

/// Kills and starts replicas, and Redis, while the clients go on.
async fn disturb(progress: &Progress, replicas: &mut [Replica], redis: &mut Redis, all: usize) {
    const STEPS: usize = 12;
    for step in 1..STEPS {
        progress.reaches(step * all / STEPS).await;
        tokio::task::block_in_place(|| match step {
            // A rolling restart.
            5 => replicas.iter_mut().for_each(|replica| {
                replica.end();
                replica.start_again();
            }),
            8 => {
                redis.stop();
                redis.start_again();
            }
            _ => {
                let replica = &mut replicas[rand::rng().random_range(0..3)];
                replica.kill();
                replica.start_again();
            }
        });
    }
}

/// Runs the clients through what `front` puts before the replicas.
async fn run<F>(front: impl FnOnce(Vec<SocketAddr>) -> F, keeps_connections: bool)
where
    F: Future<Output = (SocketAddr, Box<dyn Send>)>,
{
    let clients = setting("BAGTRACK_REPLICAS_CLIENTS", 20);
    let frames = setting("BAGTRACK_REPLICAS_FRAMES", 100);
    let clips: Vec<Clip> = (0..clients)
        .map(|client| Clip::of(client, frames + 1))
        .collect();
    let expected = undisturbed(&clips).await;

    let mut redis = Redis::start();
    let lossy_store = Lossy::before(vec![redis.address], 128 << 10..1 << 20).await;
    let url = format!("redis://{}", lossy_store.address);
    let flags = [&["--store-timeout", "2s"], &SECRET[..]].concat();
    let replica = || Replica::with_store(&url, &flags);
    let mut replicas = vec![replica(), replica(), replica()];
    let (address, _front) = front(replicas.iter().map(|replica| replica.address).collect()).await;
    // A connection for one frame is cut in the middle of it, or not at all.
    let bytes = match keeps_connections {
        true => 20 << 10..500 << 10,
        false => 1 << 10..400 << 10,
    };
    let lossy = Lossy::before(vec![address], bytes).await;

    let progress = Arc::new(Progress::default());
    let mut tracks = JoinSet::new();
    for (number, clip) in clips.into_iter().enumerate() {
        let client = Client::builder()
            .pool_max_idle_per_host(if keeps_connections { 1 } else { 0 })
            .connect_timeout(Duration::from_secs(2));
        let client = client.build().expect("a client");
        let (base, progress) = (format!("http://{}", lossy.address), progress.clone());
        tracks.spawn(async move {
            let mut track = Track::open(base, client, number, clip).await;
            while track.advance().await {
                progress.frames.fetch_add(1, Ordering::AcqRel);
                progress.moved.notify_waiters();
            }
            let state = track.snapshot().await;
            (number, track, state)
        });
    }
    let all = clients * frames;
    let mut done = Vec::new();
    let finish = async {
        while let Some(track) = tracks.join_next().await {
            done.push(track.expect("a track was lost"));
        }
    };
    tokio::join!(finish, disturb(&progress, &mut replicas, &mut redis, all));

    assert_eq!(done.len(), clients);
    for (number, track, state) in done {
        assert!(
            !track.went_back(),
            "client {number}: an answered frame was lost"
        );
        assert_eq!(track.answers.len(), frames, "client {number}");
        let (answers, last) = &expected[number];
        for (answer, expected) in track.answers.iter().zip(answers) {
            assert_eq!(answer, expected, "client {number}");
        }
        assert!(state == *last, "client {number}: another state");
    }
    let cuts = [&lossy, &lossy_store].map(|proxy| proxy.cuts.load(Ordering::Relaxed));
    println!("{clients} clients, {frames} frames each; connections cut: {cuts:?}");
    assert!(cuts[0] > 0, "the clients' network was not lossy");
    assert!(cuts[1] > 0, "the store's network was not lossy");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs redis"]
async fn no_track_is_lost_in_round_robin() {
    let front = async |replicas| {
        // Connections in turns, and a connection for every frame.
        let turns = Lossy::before(replicas, usize::MAX - 1..usize::MAX).await;
        (turns.address, Box::new(turns) as Box<dyn Send>)
    };
    run(front, false).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs redis and haproxy"]
async fn no_track_is_lost_behind_haproxy() {
    let front = async |replicas: Vec<SocketAddr>| {
        let balancer = haproxy(&replicas);
        (balancer.address, Box::new(balancer) as Box<dyn Send>)
    };
    run(front, true).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs redis and nginx"]
async fn no_track_is_lost_behind_nginx() {
    let front = async |replicas: Vec<SocketAddr>| {
        let balancer = nginx(&replicas);
        (balancer.address, Box::new(balancer) as Box<dyn Send>)
    };
    run(front, true).await;
}
