//! The clients: one task a session, each with a connection of its own.

use std::sync::Arc;
use std::time::Duration;

use bagtrack::tracker::Rect;
use bytes::Bytes;
use hdrhistogram::Histogram;
use reqwest::{Client, StatusCode};
use tokio::sync::Barrier;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until};

use crate::Outcome;

/// A failure that can pass between tasks.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What a run came to.
pub struct Done {
    /// Frames that were answered.
    pub frames: u64,
    /// Of them in a second.
    pub per_second: f64,
    /// In microseconds; in an open loop from when the frame was due.
    pub latencies: Histogram<u64>,
}

/// Sends pictures to a server.
pub struct Driver {
    /// The server.
    pub url: String,
    /// Where a session of the preset is opened with the first picture.
    pub create: String,
    /// What is sent, over and over.
    pub pictures: Vec<Bytes>,
}

impl Driver {
    /// Clients of the server at `url`.
    pub fn new(url: &str, pictures: Vec<Vec<u8>>, target: Rect, preset: &str) -> Self {
        let Rect {
            x,
            y,
            width,
            height,
        } = target;
        Self {
            url: url.to_owned(),
            create: format!("{url}/sessions?box={x},{y},{width},{height}&preset={preset}"),
            pictures: pictures.into_iter().map(Bytes::from).collect(),
        }
    }

    /// Opens `sessions` sessions, sends `frames` frames over all of them, ends the sessions. With a `rate`, that many
    /// frames fall due a second; otherwise each session sends its next when the last is answered. Stops after `limit`.
    pub async fn run(
        &self,
        sessions: u32,
        frames: u32,
        rate: Option<f64>,
        limit: Duration,
    ) -> Outcome<Done> {
        let ready = Arc::new(Barrier::new(sessions as usize));
        let mut tasks = JoinSet::new();
        for index in 0..sessions {
            let client = ClientSession {
                http: Client::builder().pool_max_idle_per_host(1).build()?,
                url: self.url.clone(),
                create: self.create.clone(),
                pictures: self.pictures.clone(),
                ready: ready.clone(),
            };
            let own = (frames + sessions - 1 - index) / sessions;
            let schedule = rate.map(|rate| Schedule {
                first: Duration::from_secs_f64(f64::from(index) / rate),
                every: Duration::from_secs_f64(f64::from(sessions) / rate),
            });
            tasks.spawn(client.run(own, schedule, limit));
        }
        let mut latencies = Histogram::new(3)?;
        let (mut first, mut last) = (None::<Instant>, None::<Instant>);
        while let Some(session) = tasks.join_next().await {
            let (own, from, until) = session?.map_err(|failure| failure.to_string())?;
            latencies.add(&own)?;
            first = Some(first.map_or(from, |first| first.min(from)));
            last = Some(last.map_or(until, |last| last.max(until)));
        }
        let (first, last) = first.zip(last).ok_or("no session ran")?;
        Ok(Done {
            frames: latencies.len(),
            per_second: latencies.len() as f64 / (last - first).as_secs_f64(),
            latencies,
        })
    }
}

/// When the frames of a session are due, from the start.
#[derive(Clone, Copy)]
struct Schedule {
    first: Duration,
    every: Duration,
}

struct ClientSession {
    http: Client,
    url: String,
    create: String,
    pictures: Vec<Bytes>,
    ready: Arc<Barrier>,
}

impl ClientSession {
    async fn run(
        self,
        frames: u32,
        schedule: Option<Schedule>,
        limit: Duration,
    ) -> Result<(Histogram<u64>, Instant, Instant), Failure> {
        let created = self.http.post(&self.create).body(self.pictures[0].clone());
        let created = created.send().await?.error_for_status()?;
        let session: serde_json::Value = serde_json::from_slice(&created.bytes().await?)?;
        let id = session["id"].as_str().ok_or("a session without an id")?;
        let session = format!("{}/sessions/{id}", self.url);
        let post = format!("{session}/frames");
        self.ready.wait().await;

        let mut latencies = Histogram::new(3)?;
        let start = Instant::now();
        for (index, picture) in (0..frames).zip(self.pictures.iter().cycle().skip(1)) {
            let due = match schedule {
                Some(schedule) => start + schedule.first + schedule.every * index,
                None => Instant::now(),
            };
            sleep_until(due).await;
            let answer = self.http.post(&post).body(picture.clone()).send().await?;
            let status = answer.status();
            let body = answer.bytes().await?;
            if status != StatusCode::OK {
                return Err(format!("{status}: {}", String::from_utf8_lossy(&body)).into());
            }
            latencies.record(due.elapsed().as_micros() as u64)?;
            if start.elapsed() > limit {
                break;
            }
        }
        let end = Instant::now();
        self.http.delete(&session).send().await?;
        Ok((latencies, start, end))
    }
}
