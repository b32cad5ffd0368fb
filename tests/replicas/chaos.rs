//! Three replicas, a Redis and lossy networks. Replicas are killed, and Redis is restarted.
//!
//! No track and no answered frame is lost, and every box equals that of an undisturbed run.

use crate::balancers::{haproxy, nginx};
use crate::clip::Clip;
use crate::lossy::Lossy;
use crate::processes::Redis;
use crate::replica::Replica;
use crate::tracks::{SECRET, Tracks, undisturbed};
use rand::RngExt;
use std::net::SocketAddr;
use std::sync::atomic::Ordering;

/// A number from a variable of the environment, or the default.
pub fn setting(name: &str, default: usize) -> usize {
    let text = std::env::var(name).ok();
    text.map_or(default, |text| text.parse().expect("a number"))
}

/// Kills and restarts replicas and Redis while the clients go on.
async fn disturb(tracks: &mut Tracks, replicas: &mut [Replica], redis: &mut Redis, all: usize) {
    const STEPS: usize = 12;
    for step in 1..STEPS {
        tracks.reach_together(step * all / STEPS).await;
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

/// Runs the clients, which connect to the balancer or proxy that `front` makes.
async fn run<F>(front: impl FnOnce(Vec<SocketAddr>) -> F, keeps_connections: bool)
where
    F: Future<Output = (SocketAddr, Box<dyn Send>)>,
{
    let clients = setting("BAGTRACK_REPLICAS_CLIENTS", 20);
    let frames = setting("BAGTRACK_REPLICAS_FRAMES", 100);
    let clips = Clip::of_each(clients, frames);
    let expected = undisturbed(&clips).await;

    let mut redis = Redis::start();
    let lossy_store = Lossy::before(vec![redis.address], 128 << 10..1 << 20).await;
    let url = format!("redis://{}", lossy_store.address);
    let flags = [&["--store-timeout", "2s"], &SECRET[..]].concat();
    let replica = || Replica::with_store(&url, &flags);
    let mut replicas = vec![replica(), replica(), replica()];
    let (address, _front) = front(replicas.iter().map(|replica| replica.address).collect()).await;
    // After how many bytes a connection is cut; if it carries one frame only, in the middle of that or not at all.
    let bytes = match keeps_connections {
        true => 20 << 10..500 << 10,
        false => 1 << 10..400 << 10,
    };
    let lossy = Lossy::before(vec![address], bytes).await;

    let base = format!("http://{}", lossy.address);
    let mut tracks = Tracks::start(&base, &clips, keeps_connections);
    let all = clients * frames;
    disturb(&mut tracks, &mut replicas, &mut redis, all).await;
    tracks.end_as(&expected).await;
    let cuts = [&lossy, &lossy_store].map(|proxy| proxy.cuts.load(Ordering::Relaxed));
    println!("{clients} clients, {frames} frames each; connections cut: {cuts:?}");
    assert!(cuts[0] > 0, "the clients' network was not lossy");
    assert!(cuts[1] > 0, "the store's network was not lossy");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs redis"]
async fn no_track_is_lost_in_round_robin() {
    let front = async |replicas| {
        // Connections go to the replicas in turns, and each frame has its own connection.
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
