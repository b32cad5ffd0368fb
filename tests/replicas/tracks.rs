//! Clients that track a clip each while the test disturbs the service.

use crate::clip::Clip;
use crate::replica::Replica;
use crate::tracking_client::{Answer, Track};
use bagtrack_testing::command::program;
use reqwest::Client;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::JoinSet;

/// The snapshot secret of all services: with the same secret, snapshots of the same state are equal bytes.
pub const SECRET: [&str; 2] = ["--snapshot-keys", "a secret of these tests"];

/// The result of a client: the answers, whose numbers are rounded, and the snapshot after the last one, with exact
/// numbers.
pub type Got = (Vec<Answer>, Vec<u8>);

/// The result of each client without a store and without failures.
pub async fn undisturbed(clips: &[Clip]) -> Vec<Got> {
    undisturbed_by(&program("bagtrack"), clips).await
}

/// Like [`undisturbed`], with another build of the program.
pub async fn undisturbed_by(program: &Path, clips: &[Clip]) -> Vec<Got> {
    let alone = Replica::start_program(program, &[], &SECRET);
    let mut all = Vec::new();
    for (number, clip) in clips.iter().enumerate() {
        let mut track = Track::open(alone.url(""), Client::new(), number, clip.clone()).await;
        while track.advance().await {}
        let state = track.snapshot().await;
        all.push((track.answers, state));
    }
    all
}

/// Clients at work.
pub struct Tracks {
    going: JoinSet<(usize, Track, Vec<u8>)>,
    ended: Vec<(usize, Track, Vec<u8>)>,
    /// How many frames each client may send.
    allowed: watch::Sender<usize>,
    /// How many frames of each client are answered.
    reached: watch::Receiver<Vec<usize>>,
}

impl Tracks {
    /// Clients that send all frames of their clips to this address.
    pub fn start(base: &str, clips: &[Clip], keeps_connections: bool) -> Self {
        Self::start_with(usize::MAX, base, clips, keeps_connections)
    }

    /// Like [`Self::start`], but each client stops after this number of frames until [`Self::allow`].
    pub fn start_with(allowed: usize, base: &str, clips: &[Clip], keeps_connections: bool) -> Self {
        let (allowed, allows) = watch::channel(allowed);
        let (tell, reached) = watch::channel(vec![0; clips.len()]);
        let (tell, mut going) = (Arc::new(tell), JoinSet::new());
        for (number, clip) in clips.iter().cloned().enumerate() {
            let client = Client::builder()
                .pool_max_idle_per_host(usize::from(keeps_connections))
                .connect_timeout(Duration::from_secs(2));
            let client = client.build().expect("a client");
            let (base, mut allows, tell) = (base.to_owned(), allows.clone(), tell.clone());
            going.spawn(async move {
                let frames = clip.frames.len();
                let mut track = Track::open(base, client, number, clip).await;
                for frame in 1..frames {
                    let allowed = allows.wait_for(|allowed| *allowed >= frame).await;
                    allowed.expect("the test goes on");
                    assert!(track.advance().await);
                    tell.send_modify(|reached| reached[number] = frame);
                }
                let state = track.snapshot().await;
                (number, track, state)
            });
        }
        Self {
            going,
            ended: Vec::new(),
            allowed,
            reached,
        }
    }

    /// Lets each client send up to this number of frames in all.
    pub fn allow(&self, frames: usize) {
        self.allowed.send_replace(frames);
    }

    /// Waits until each client has this number of answers.
    pub async fn reach(&mut self, frames: usize) {
        self.wait_for(|reached| reached.iter().all(|count| *count >= frames))
            .await;
    }

    /// Waits until all clients together have this number of answers.
    pub async fn reach_together(&mut self, frames: usize) {
        self.wait_for(|reached| reached.iter().sum::<usize>() >= frames)
            .await;
    }

    /// Waits for a condition on the numbers of answers; fails if a client fails.
    async fn wait_for(&mut self, is_reached: impl Fn(&[usize]) -> bool) {
        loop {
            tokio::select! {
                reached = self.reached.wait_for(|reached| is_reached(reached)) => {
                    reached.expect("there are no more frames");
                    return;
                }
                Some(track) = self.going.join_next() => {
                    self.ended.push(track.expect("a track was lost"));
                }
            }
        }
    }

    /// Waits for all clients to end. Returns the tracks and the last snapshots, in the order of the clips.
    pub async fn end(mut self) -> Vec<(Track, Vec<u8>)> {
        while let Some(track) = self.going.join_next().await {
            self.ended.push(track.expect("a track was lost"));
        }
        assert_eq!(self.ended.len(), self.reached.borrow().len());
        self.ended.sort_by_key(|(number, ..)| *number);
        let ended = self.ended.into_iter();
        ended.map(|(_, track, state)| (track, state)).collect()
    }

    /// Waits for all clients to end, and checks that no track and no answered frame is lost, and that the results are
    /// these.
    pub async fn end_as(self, expected: &[Got]) {
        let ended = self.end().await;
        for (number, ((track, state), expected)) in ended.iter().zip(expected).enumerate() {
            assert!(
                !track.went_back(),
                "client {number}: an answered frame was lost"
            );
            check(number, (track, state), expected);
        }
    }
}

/// Checks the result of a client.
pub fn check(number: usize, (track, state): (&Track, &[u8]), (answers, last): &Got) {
    assert_eq!(track.answers.len(), answers.len(), "client {number}");
    for (answer, expected) in track.answers.iter().zip(answers) {
        assert_eq!(answer, expected, "client {number}");
    }
    assert!(state == last, "client {number}: another state");
}
