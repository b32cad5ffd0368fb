//! The clients: one task a session, each with a connection of its own.

use std::time::Duration;

use bagtrack_client::{Client, ClientError, OpenOptions, Preset, Session};
use bagtrack_tracker::Rect;
use bytes::Bytes;
use hdrhistogram::Histogram;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until};

use crate::Outcome;

/// The results of the runs.
pub struct Done {
    /// Of each frame that was answered, in microseconds; in an open loop from when the frame was due.
    pub latencies: Histogram<u64>,
    pub seconds: f64,
}

impl Done {
    pub fn new() -> Outcome<Self> {
        Ok(Self {
            latencies: Histogram::new(3)?,
            seconds: 0.0,
        })
    }

    /// Frames that were answered in a second.
    pub fn per_second(&self) -> f64 {
        self.latencies.len() as f64 / self.seconds
    }
}

/// Sends pictures to a server.
#[derive(Clone)]
pub struct Driver {
    url: String,
    target: bagtrack_client::Rect,
    /// How sessions are opened with the first picture.
    pub options: OpenOptions,
    /// What is sent, over and over.
    pub pictures: Vec<Bytes>,
}

impl Driver {
    /// Clients of the server at `url`.
    pub fn new(
        url: &str,
        pictures: Vec<Vec<u8>>,
        target: Rect,
        preset: bagtrack_tracker::Preset,
    ) -> Self {
        let preset = match preset {
            bagtrack_tracker::Preset::Robust => Preset::Robust,
            bagtrack_tracker::Preset::Paper => Preset::Paper,
        };
        Self {
            url: url.to_owned(),
            target: [target.x, target.y, target.width, target.height].into(),
            options: OpenOptions::new().preset(preset),
            pictures: pictures.into_iter().map(Bytes::from).collect(),
        }
    }

    pub fn url(&self) -> &str {
        &self.url
    }

    /// The address that opens a session.
    pub fn opening(&self) -> String {
        format!("{}/sessions?box={}", self.url, self.target)
    }

    /// A client with so many connections. It sends every request once, so that a failure is seen and each latency is
    /// that of one request; and it takes no snapshots, which would be in some latencies.
    pub fn client(&self, connections: usize) -> Result<Client, ClientError> {
        let http = reqwest::Client::builder().pool_max_idle_per_host(connections);
        let client = Client::builder(&self.url).http(http.build()?);
        let client = client.retry_for(Duration::ZERO).snapshot_every(0);
        client.build()
    }

    pub async fn session(&self, client: &Client) -> Result<Session, ClientError> {
        let first = self.pictures[0].clone();
        client.open(first, self.target, &self.options).await
    }

    /// Opens so many sessions, each with a connection of its own.
    pub async fn open(&self, sessions: u32) -> Outcome<Clients> {
        let mut clients = Vec::new();
        for _ in 0..sessions {
            clients.push(ClientSession {
                session: self.session(&self.client(1)?).await?,
                pictures: self.pictures.clone(),
                next: 1,
            });
        }
        Ok(Clients(clients))
    }
}

pub struct Clients(Vec<ClientSession>);

impl Clients {
    /// Sends `frames` frames over all sessions and adds the results to `done`. With a `rate`, that many frames
    /// fall due a second; otherwise each session sends its next when the last is answered. Stops after `limit`.
    pub async fn run(
        &mut self,
        frames: u32,
        rate: Option<f64>,
        limit: Duration,
        done: &mut Done,
    ) -> Outcome<()> {
        let sessions = self.0.len() as u32;
        let mut tasks = JoinSet::new();
        let start = Instant::now();
        for (index, client) in (0..sessions).zip(self.0.drain(..)) {
            let own = (frames + sessions - 1 - index) / sessions;
            let schedule = rate.map(|rate| Schedule {
                first: start + Duration::from_secs_f64(f64::from(index) / rate),
                every: Duration::from_secs_f64(f64::from(sessions) / rate),
            });
            tasks.spawn(client.run(own, schedule, start + limit));
        }
        while let Some(client) = tasks.join_next().await {
            let (client, latencies) = client??;
            done.latencies.add(&latencies)?;
            self.0.push(client);
        }
        done.seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    pub async fn close(self) -> Outcome<()> {
        for client in self.0 {
            client.session.end().await?;
        }
        Ok(())
    }
}

/// When the frames of a session are due.
#[derive(Clone, Copy)]
struct Schedule {
    first: Instant,
    every: Duration,
}

struct ClientSession {
    session: Session,
    pictures: Vec<Bytes>,
    next: usize,
}

impl ClientSession {
    async fn run(
        mut self,
        frames: u32,
        schedule: Option<Schedule>,
        end: Instant,
    ) -> Outcome<(Self, Histogram<u64>)> {
        let mut latencies = Histogram::new(3)?;
        for index in 0..frames {
            let due = match schedule {
                Some(schedule) => schedule.first + schedule.every * index,
                None => Instant::now(),
            };
            sleep_until(due).await;
            let picture = self.pictures[self.next].clone();
            self.next = (self.next + 1) % self.pictures.len();
            self.session.track(picture).await?;
            latencies.record(due.elapsed().as_micros() as u64)?;
            if Instant::now() > end {
                break;
            }
        }
        Ok((self, latencies))
    }
}
