//! Good clients: each sends 25 numbered frames a second, and sends a frame again when it is refused.

use crate::target::Target;
use crate::{Outcome, Verdict};
use bagtrack_testing::bench_pictures as pictures;
use hdrhistogram::Histogram;
use reqwest::StatusCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval, timeout};

/// The time from one frame of a client to its next.
pub const PERIOD: Duration = Duration::from_millis(40);
/// The time after which a frame counts as lost.
const LOST: Duration = Duration::from_secs(10);

pub struct GoodClients {
    stop: Arc<AtomicBool>,
    clients: JoinSet<Outcome<Tally>>,
}

/// What became of the frames of the good clients.
#[derive(Debug)]
pub struct Tally {
    pub answered: u64,
    /// Answers that were refusals, after which the frame was sent again.
    pub refused: u64,
    pub lost: u64,
    /// The text of the first refusal.
    pub why_refused: Option<String>,
    pub micros: Histogram<u64>,
}

/// The frames that good clients send, of 320 x 240 pixels.
pub fn frames() -> Outcome<Vec<Vec<u8>>> {
    Ok(pictures::jpegs(1)?)
}

/// The box of the target in the first frame.
pub fn target_box() -> String {
    let target = pictures::target(1);
    format!(
        "{},{},{},{}",
        target.x, target.y, target.width, target.height
    )
}

impl GoodClients {
    /// So many of them, each with a session.
    pub async fn start(target: &Target, count: u8) -> Outcome<Self> {
        Self::start_at(target, count, PERIOD).await
    }

    /// The same, with so long from one frame of a client to its next.
    pub async fn start_at(target: &Target, count: u8, period: Duration) -> Outcome<Self> {
        let frames = Arc::new(frames()?);
        let stop = Arc::new(AtomicBool::new(false));
        let mut clients = JoinSet::new();
        for number in 0..count {
            let client = format!("203.0.113.{}", number + 1);
            let session = target.open(&client, &frames[0], "").await?;
            let url = format!("{}{session}/frames", target.url);
            let (stop, frames, http) = (stop.clone(), frames.clone(), target.http.clone());
            clients.spawn(async move { follow(http, url, client, frames, period, stop).await });
        }
        Ok(Self { stop, clients })
    }

    /// Stops the clients, and waits for their last answers.
    pub async fn stop(mut self) -> Outcome<Tally> {
        self.stop.store(true, Ordering::Relaxed);
        let mut all = Tally::new()?;
        while let Some(tally) = self.clients.join_next().await {
            let tally = tally??;
            all.answered += tally.answered;
            all.refused += tally.refused;
            all.lost += tally.lost;
            all.why_refused = all.why_refused.or(tally.why_refused);
            all.micros.add(&tally.micros)?;
        }
        Ok(all)
    }

    /// Stops them; held, if they lost no frame and `holds`.
    pub async fn verdict(self, holds: bool, seen: impl std::fmt::Display) -> Outcome<Verdict> {
        let tally = self.stop().await?;
        Ok(Verdict::new(
            holds && tally.lost == 0,
            format!("{seen}; {tally}"),
        ))
    }
}

impl Tally {
    fn new() -> Outcome<Self> {
        Ok(Self {
            answered: 0,
            refused: 0,
            lost: 0,
            why_refused: None,
            micros: Histogram::new(3)?,
        })
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ms = |quantile| self.micros.value_at_quantile(quantile) as f64 / 1e3;
        write!(
            formatter,
            "good clients: {} frames, {} lost, {} refused and sent again, p50 {:.1} ms, p99 {:.1} ms",
            self.answered,
            self.lost,
            self.refused,
            ms(0.5),
            ms(0.99)
        )?;
        match &self.why_refused {
            Some(why) => write!(formatter, " (refused: {why})"),
            None => Ok(()),
        }
    }
}

/// Why a request was not answered with 200; `None` if it was.
async fn refusal(request: reqwest::RequestBuilder) -> Option<String> {
    let answer = match request.send().await {
        Ok(answer) if answer.status() == StatusCode::OK => return None,
        Ok(answer) => answer,
        Err(error) => return Some(format!("{error:?}")),
    };
    let status = answer.status();
    Some(match answer.text().await {
        Ok(text) => format!("{status} {text}"),
        Err(error) => format!("{status} {error:?}"),
    })
}

async fn follow(
    http: reqwest::Client,
    url: String,
    client: String,
    frames: Arc<Vec<Vec<u8>>>,
    period: Duration,
    stop: Arc<AtomicBool>,
) -> Outcome<Tally> {
    let mut tally = Tally::new()?;
    let mut due = interval(period);
    due.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut number = 1;
    while !stop.load(Ordering::Relaxed) {
        due.tick().await;
        let frame = &frames[number % frames.len()];
        let sent = Instant::now();
        let answered = async {
            loop {
                let request = http.post(format!("{url}?frame={number}"));
                let request = request
                    .header("x-forwarded-for", &client)
                    .body(frame.clone());
                let Some(why) = refusal(request).await else {
                    return;
                };
                tally.refused += 1;
                tally.why_refused.get_or_insert(why);
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
        };
        if timeout(LOST, answered).await.is_err() {
            tally.lost += 1;
        } else {
            tally.answered += 1;
            tally.micros.record(sent.elapsed().as_micros() as u64)?;
            number += 1;
        }
    }
    Ok(tally)
}
