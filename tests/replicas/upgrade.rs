//! Two builds of the program with the same sessions: that of the release before, which BAGTRACK_PREVIOUS names
//! (`tools/previous_release.sh` builds it), and the one under test.
//!
//! Replicas are replaced one by one, forth and back, while clients go on: no track and no answered frame is lost.

use crate::balancers::haproxy;
use crate::chaos::setting;
use crate::clip::Clip;
use crate::lossy::Lossy;
use crate::pair::{Pair, json};
use crate::processes::Redis;
use crate::replica::Replica;
use crate::stream_client::StreamClient;
use crate::tracking_client::Answer;
use crate::tracks::{SECRET, Tracks, check, undisturbed_by};
use bagtrack_testing::command::program;
use reqwest::StatusCode;
use serde_json::Value;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// The paths of the previous release's program and of the one under test.
fn programs() -> [PathBuf; 2] {
    let previous =
        std::env::var_os("BAGTRACK_PREVIOUS").expect("BAGTRACK_PREVIOUS names a program");
    let programs = [PathBuf::from(previous), program("bagtrack")];
    let [previous, new] = programs.each_ref().map(|program| {
        std::fs::read(program).unwrap_or_else(|error| panic!("{}: {error}", program.display()))
    });
    assert!(previous != new, "BAGTRACK_PREVIOUS names the same program");
    programs
}

/// How many frames a replica has answered.
async fn answered(replica: &Replica) -> u64 {
    let page = reqwest::get(replica.url("/metrics")).await.unwrap();
    let text = page.text().await.unwrap();
    let counts = text.lines().filter_map(|line| {
        let rest = line.strip_prefix("bagtrack_frames_total{")?;
        rest.split_once("} ")?.1.parse::<u64>().ok()
    });
    counts.sum()
}

/// Intersection over union of two boxes.
fn overlap(answers: [&Answer; 2]) -> f64 {
    let [a, b] = answers.map(|answer| {
        let side = |name: &str| answer["box"][name].as_f64().unwrap();
        ["x", "y", "width", "height"].map(side)
    });
    let common = |at: usize| {
        let end = f64::min(a[at] + a[at + 2], b[at] + b[at + 2]);
        (end - f64::max(a[at], b[at])).max(0.0)
    };
    let common = common(0) * common(1);
    common / (a[2] * a[3] + b[2] * b[3] - common)
}

/// Replacements of replicas: the index of the replica, and whether the new program replaces it.
type Steps = [(usize, bool)];

/// A rolling upgrade that is reverted in the middle, then completed, and finally reverted for one replica.
const ROLL: [(usize, bool); 7] = [
    (0, true),
    (1, true),
    (0, false),
    (0, true),
    (2, true),
    (1, false),
    (1, true),
];

/// Restarts a replica with another program, as documented: the old process drains and ends with status 0, and the new
/// one must become ready.
async fn replace(replica: &mut Replica, program: &Path) {
    tokio::task::block_in_place(|| {
        let status = replica.end();
        assert!(status.success(), "something was cut off: {status}");
        replica.change_program(program);
        replica.start_again();
    });
    while replica.readiness().await != StatusCode::OK {}
}

/// Replaces replicas while clients go on. In the first half of each phase all replicas run, in the second half one is
/// replaced. Returns how many frames each program has answered.
async fn roll(
    (tracks, frames): (&mut Tracks, usize),
    (replicas, programs): (&mut [Replica], &[PathBuf; 2]),
    steps: &Steps,
) -> [u64; 2] {
    let mut news = vec![false; replicas.len()];
    let mut counts = [0, 0];
    let phase = frames / (steps.len() + 1);
    assert!(phase >= 2, "too few frames");
    for (number, (at, new)) in steps.iter().enumerate() {
        tracks.allow(number * phase + phase / 2);
        tracks.reach(number * phase + phase / 2).await;
        counts[usize::from(news[*at])] += answered(&replicas[*at]).await;
        tracks.allow((number + 1) * phase);
        replace(&mut replicas[*at], &programs[usize::from(*new)]).await;
        news[*at] = *new;
    }
    tracks.allow(frames);
    tracks.reach(frames).await;
    for (replica, new) in replicas.iter().zip(news) {
        counts[usize::from(new)] += answered(replica).await;
    }
    counts
}

/// Compares the clients' results with those of each program alone.
async fn compare(tracks: Tracks, programs: &[PathBuf; 2], clips: &[Clip], every: u64) {
    let frames = clips[0].frames.len() - 1;
    let [old, new] = [
        undisturbed_by(&programs[0], clips).await,
        undisturbed_by(&programs[1], clips).await,
    ];
    for (number, (track, state)) in tracks.end().await.into_iter().enumerate() {
        assert!(!track.was_lost(), "client {number}: a track was lost");
        // Between two checkpoints, a replica that takes over asks for frames again.
        assert!(
            every > 1 || !track.went_back(),
            "client {number}: an answered frame was lost"
        );
        assert_eq!(track.answers.len(), frames, "client {number}");
        if old[number] == new[number] {
            check(number, (&track, &state), &new[number]);
            continue;
        }
        // If the trackers of the two programs differ, a mixed track equals neither: its boxes must be near one of them.
        for (at, answer) in track.answers.iter().enumerate() {
            let near = [&old, &new].map(|run| overlap([answer, &run[number].0[at]]));
            let near = near[0].max(near[1]);
            assert!(near >= 0.5, "client {number}: {near} at {answer}");
        }
    }
}

/// Which balancer stands before the replicas.
#[derive(Clone, Copy, PartialEq)]
enum Front {
    /// HAProxy, which keeps a session at one replica.
    Haproxy,
    /// Connections in turns, and a connection for every frame: each session is at all replicas.
    Turns,
}

fn clips() -> Vec<Clip> {
    let clients = setting("BAGTRACK_REPLICAS_CLIENTS", 6);
    let frames = setting("BAGTRACK_REPLICAS_FRAMES", 48);
    Clip::of_each(clients, frames)
}

async fn upgrade(front: Front, every: u64) {
    let (programs, clips, redis) = (programs(), clips(), Redis::start());
    let frames = clips[0].frames.len() - 1;
    let (url, every_text) = (redis.url(), every.to_string());
    let flags = ["--store", &url, "--store-every", &every_text];
    // HAProxy looks every half second.
    let drains = ["--shutdown-delay", "1500ms"];
    let flags = [&flags[..], &drains, &SECRET].concat();
    let replica = || Replica::start_program(&programs[0], &[], &flags);
    let mut replicas = [replica(), replica(), replica()];
    let addresses: Vec<SocketAddr> = replicas.iter().map(|replica| replica.address).collect();
    let (address, _front): (SocketAddr, Box<dyn Send>) = match front {
        Front::Haproxy => {
            let balancer = haproxy(&addresses);
            (balancer.address, Box::new(balancer))
        }
        Front::Turns => {
            let turns = Lossy::before(addresses, usize::MAX - 1..usize::MAX).await;
            (turns.address, Box::new(turns))
        }
    };
    let base = format!("http://{address}");
    let mut tracks = Tracks::start_with(0, &base, &clips, front == Front::Haproxy);
    let counts = roll((&mut tracks, frames), (&mut replicas, &programs), &ROLL);
    let counts = counts.await;
    // All replicas had the one program at first, and the other at last.
    let least = (clips.len() * (frames / (ROLL.len() + 1) / 2)) as u64;
    assert!(counts.iter().all(|count| *count >= least), "{counts:?}");
    compare(tracks, &programs, &clips, every).await;
    println!("frames answered by the program before, and by this one: {counts:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs BAGTRACK_PREVIOUS, a program of another version, and redis-server"]
async fn an_upgrade_loses_nothing_where_sessions_are_at_both_versions_in_turns() {
    upgrade(Front::Turns, 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs BAGTRACK_PREVIOUS, a program of another version, redis-server and haproxy"]
async fn an_upgrade_loses_nothing_behind_haproxy() {
    upgrade(Front::Haproxy, 1).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs BAGTRACK_PREVIOUS, a program of another version, redis-server and haproxy"]
async fn an_upgrade_loses_no_track_between_checkpoints() {
    upgrade(Front::Haproxy, 3).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs BAGTRACK_PREVIOUS, a program of another version"]
async fn a_folder_goes_from_one_version_to_the_other_and_back() {
    let (programs, clips) = (programs(), clips());
    let frames = clips[0].frames.len() - 1;
    let folder = tempfile::tempdir().unwrap();
    let store = format!("file:{}", folder.path().join("sessions").display());
    let flags = [&["--store", &store], &SECRET[..]].concat();
    let mut replicas = [Replica::start_program(&programs[0], &[], &flags)];
    let mut tracks = Tracks::start_with(0, &replicas[0].url(""), &clips, true);
    let steps = [(0, true), (0, false), (0, true)];
    let counts = roll((&mut tracks, frames), (&mut replicas, &programs), &steps);
    let counts = counts.await;
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
    compare(tracks, &programs, &clips, 1).await;
}

/// What passes between versions beside frames: sessions that are opened again, stored answers, snapshots, tokens,
/// streams, ends.
#[tokio::test]
#[ignore = "needs BAGTRACK_PREVIOUS, a program of another version, and redis-server"]
async fn what_one_version_has_made_the_other_takes() {
    let [previous, new] = programs();
    for programs in [[&*previous, &*new], [&*new, &*previous]] {
        let pair = Pair::of(programs, &SECRET, 6).await;
        let again = pair.put(1, 7).await;
        assert_eq!(again.headers()["replayed"], "true");
        json(again, StatusCode::CREATED).await;
        let first = json(pair.post(0, 1).await, StatusCode::OK).await;
        assert!(first["box"].is_object(), "{first}");
        let again = pair.post(1, 1).await;
        assert_eq!(again.headers()["replayed"], "true");
        assert_eq!(json(again, StatusCode::OK).await["box"], first["box"]);

        let mut stream = StreamClient::open_in_time(pair.replicas[0].address, pair.id, "").await;
        assert_eq!(stream.track(&pair.clip.frames[2]).await["frame"], 2);
        let mut other = StreamClient::open_in_time(pair.replicas[1].address, pair.id, "").await;
        assert_eq!(other.track(&pair.clip.frames[3]).await["frame"], 3);

        let snapshot = pair.client.get(pair.url(0, "/snapshot")).send().await;
        let snapshot = snapshot.unwrap().bytes().await.unwrap();
        let create = pair.client.post(pair.replicas[1].url("/sessions"));
        let create = create.body(snapshot).send().await.unwrap();
        let copy = json(create, StatusCode::CREATED).await;
        assert_eq!(copy["frame"], 3, "{copy}");

        let made = pair.client.post(pair.url(0, "/token")).send().await;
        let token = json(made.unwrap(), StatusCode::OK).await;
        let get = pair.client.get(pair.url(1, ""));
        let get = get.bearer_auth(token["token"].as_str().unwrap());
        json(get.send().await.unwrap(), StatusCode::OK).await;

        let delete = pair.client.delete(pair.url(1, "")).send().await.unwrap();
        assert_eq!(delete.status(), StatusCode::NO_CONTENT);
        json(pair.post(0, 4).await, StatusCode::NOT_FOUND).await;
    }
}

/// The format of a version to come.
const LATER: u8 = 99;

/// Another replica takes the record over, and writes a head whose first byte is this one. Gives the one it was.
fn take_over(pair: &Pair, format: u8) -> u8 {
    let script = "local head = redis.call('hget', KEYS[1], 'head') \
        redis.call('hset', KEYS[1], 'head', string.char(ARGV[1]) .. string.sub(head, 2)) \
        redis.call('hincrby', KEYS[1], 'generation', 1) \
        return string.byte(head)";
    let (key, format) = (pair.key(), format.to_string());
    let before = pair.redis.ask(&["eval", script, "1", &key, &format]);
    before.trim().parse().expect("a byte")
}

/// A version that writes another format is in the cluster: both programs refuse its records, and leave them.
#[tokio::test]
#[ignore = "needs BAGTRACK_PREVIOUS, a program of another version, and redis-server"]
async fn a_record_of_a_later_version_is_refused_and_goes_on_when_that_is_taken_back() {
    let [previous, new] = programs();
    let pair = Pair::of([&previous, &new], &SECRET, 8).await;
    for number in 1..4 {
        let answer = json(pair.post(number % 2, number).await, StatusCode::OK).await;
        assert_eq!(answer["frame"], number);
    }
    let format = take_over(&pair, LATER);
    let fields = || pair.redis.ask(&["--no-raw", "hgetall", &pair.key()]);
    let before = fields();
    // The second one answered the frame before, so it has the session in memory.
    for replica in [0, 1] {
        let refused = pair.post(replica, 4).await;
        assert!(refused.headers().contains_key("retry-after"));
        let problem: Value = json(refused, StatusCode::SERVICE_UNAVAILABLE).await;
        assert_eq!(problem["type"], "/docs/problems#store-unavailable");
        assert_eq!(fields(), before, "the record is left as it is");
        // Others go on.
        assert_eq!(pair.replicas[replica].readiness().await, StatusCode::OK);
        let query = format!("/sessions?box={}", pair.clip.first_box);
        let create = pair.client.post(pair.replicas[replica].url(&query));
        let create = create.body(pair.clip.frames[0].clone()).send().await;
        json(create.unwrap(), StatusCode::CREATED).await;
    }
    assert_eq!(take_over(&pair, format), LATER);
    for number in 4..8 {
        let answer = json(pair.post(number % 2, number).await, StatusCode::OK).await;
        assert_eq!(answer["frame"], number);
    }
}
