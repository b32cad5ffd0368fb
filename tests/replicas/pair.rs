//! Two replicas that share a session through a Redis.

use crate::clip::Clip;
use crate::processes::Redis;
use crate::replica::Replica;
use crate::tracking_client::{Answer, Track};
use bagtrack_testing::command::program;
use reqwest::{Client, Response, StatusCode};
use std::ops::Range;
use std::path::Path;
use uuid::Uuid;

pub use bagtrack_testing::service::application::expect as json;

pub struct Pair {
    pub redis: Redis,
    pub replicas: [Replica; 2],
    pub client: Client,
    pub clip: Clip,
    pub id: Uuid,
}

impl Pair {
    /// Two replicas, and a session that was opened at the first.
    pub async fn open(flags: &[&str], frames: usize) -> Self {
        let program = program("bagtrack");
        Self::of([&program, &program], flags, frames).await
    }

    /// Two replicas, each with its own build of the program.
    pub async fn of(programs: [&Path; 2], flags: &[&str], frames: usize) -> Self {
        let redis = Redis::start();
        let url = redis.url();
        let flags = [&["--store", &url], flags].concat();
        let pair = Self {
            replicas: programs.map(|program| Replica::start_program(program, &[], &flags)),
            redis,
            client: Client::new(),
            clip: Clip::of(0, frames),
            id: Uuid::new_v4(),
        };
        // On a busy machine, connecting to the store may take a while.
        while pair.put(0, 7).await.status() == StatusCode::SERVICE_UNAVAILABLE {}
        json(pair.put(0, 7).await, StatusCode::CREATED).await;
        pair
    }

    /// The answers of a single service without a store to the same frames.
    pub async fn undisturbed(&self) -> Vec<Answer> {
        let alone = Replica::start(&[]);
        let track = Track::open(alone.url(""), Client::new(), 7, self.clip.clone());
        track.await.follow().await
    }

    /// The key of the session's record in the Redis.
    pub fn key(&self) -> String {
        format!("bagtrack:session:{{{}}}", self.id)
    }

    pub fn url(&self, replica: usize, rest: &str) -> String {
        self.replicas[replica].url(&format!("/sessions/{}{rest}", self.id))
    }

    pub async fn put(&self, replica: usize, seed: u64) -> Response {
        let query = format!("?box={}&seed={seed}", self.clip.first_box);
        let request = self.client.put(self.url(replica, &query));
        let request = request.body(self.clip.frames[0].clone());
        request.send().await.unwrap()
    }

    pub async fn post(&self, replica: usize, number: usize) -> Response {
        self.post_as(replica, number, number).await
    }

    /// Posts these frames to a replica, which must accept them.
    pub async fn take(&self, replica: usize, numbers: Range<usize>) {
        for number in numbers {
            json(self.post(replica, number).await, StatusCode::OK).await;
        }
    }

    /// Posts these frames to a replica, and checks its answers. `expected` begins with frame 1.
    pub async fn follow(&self, replica: usize, numbers: Range<usize>, expected: &[Answer]) {
        for number in numbers {
            let answer = json(self.post(replica, number).await, StatusCode::OK).await;
            assert_eq!(answer, expected[number - 1], "frame {number}");
        }
    }

    /// Posts frame `file` of the clip under this number.
    pub async fn post_as(&self, replica: usize, number: usize, file: usize) -> Response {
        let url = self.url(replica, &format!("/frames?frame={number}"));
        let request = self.client.post(url).body(self.clip.frames[file].clone());
        request.send().await.unwrap()
    }

    /// Posts a frame without a number.
    pub async fn post_unnumbered(&self, replica: usize) -> Response {
        let request = self.client.post(self.url(replica, "/frames"));
        let request = request.body(self.clip.frames[1].clone());
        request.send().await.unwrap()
    }

    /// The session, by `GET` from a replica.
    pub async fn view(&self, replica: usize) -> Response {
        self.client.get(self.url(replica, "")).send().await.unwrap()
    }
}
