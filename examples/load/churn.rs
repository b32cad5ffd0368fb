//! Sessions that come and go for a long time: does the server's resident memory stay where it was?

use crate::Outcome;
use crate::drive::Driver;
use crate::process::Server;
use bagtrack_client::ClientError;
use std::time::Duration;
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};

/// After so long the server has met everything once, and memory is read for the first time.
const WARM_UP: Duration = Duration::from_secs(600);
/// Memory is the mean of readings over so long.
const READING: Duration = Duration::from_secs(60);
/// How far memory may move from the first reading to the last.
const TOLERANCE: f64 = 0.05;

/// Keeps `sessions` clients at work, `rate` frames a second together, and compares the memory after ten minutes, or at
/// a third of a shorter run, with that at the end.
pub async fn run(
    driver: &Driver,
    server: &Server,
    (sessions, rate, length): (u32, f64, Duration),
) -> Outcome<()> {
    let end = Instant::now() + length;
    let warm_up = WARM_UP.min(length / 3);
    let reading = READING.min(warm_up / 2);
    let mut clients = JoinSet::new();
    for number in 0..sessions {
        let client = ChurningClient {
            driver: driver.clone(),
            every: Duration::from_secs_f64(f64::from(sessions) / rate),
        };
        clients.spawn(client.run(number, end));
    }
    sleep_until(end - length + warm_up - reading).await;
    let first = resident(server, reading).await?;
    println!(
        "after {} s: {:.1} MiB resident",
        warm_up.as_secs(),
        first / 1048576.0
    );
    sleep_until(end - reading).await;
    let last = resident(server, reading).await?;
    let (mut opened, mut sent) = (0, 0);
    while let Some(client) = clients.join_next().await {
        let (sessions, frames) = client??;
        (opened, sent) = (opened + sessions, sent + frames);
    }
    let change = last / first - 1.0;
    println!(
        "after {} s: {:.1} MiB resident, {:+.1} %; {opened} sessions, {sent} frames",
        length.as_secs(),
        last / 1048576.0,
        100.0 * change
    );
    match change.abs() <= TOLERANCE {
        true => Ok(()),
        false => Err("the memory did not stay where it was".into()),
    }
}

/// The mean of the resident memory over so long, in bytes.
async fn resident(server: &Server, over: Duration) -> Outcome<f64> {
    let mut ticks = interval(over / 12);
    let mut sum = 0.0;
    for _ in 0..12 {
        ticks.tick().await;
        sum += server.resident()? as f64;
    }
    Ok(sum / 12.0)
}

/// Opens one session after the other.
struct ChurningClient {
    driver: Driver,
    every: Duration,
}

impl ChurningClient {
    /// Returns how many sessions it opened, and how many frames they took.
    async fn run(self, number: u32, end: Instant) -> Outcome<(u32, u32)> {
        let (mut opened, mut sent) = (0, 0);
        let mut due = interval(self.every);
        due.set_missed_tick_behavior(MissedTickBehavior::Delay);
        while Instant::now() < end {
            // A new connection for each session, as with clients that come and go.
            let mut session = self.driver.session(&self.driver.client(1)?).await?;
            let life = 20 + (37 * opened + 61 * number) % 180;
            opened += 1;
            for (t, picture) in (1..life).zip(self.driver.pictures.iter().cycle().skip(1)) {
                due.tick().await;
                if t % 40 == 0 {
                    let damaged = picture.slice(..picture.len() / 2);
                    match session.track(damaged).await {
                        Err(ClientError::Refused(problem)) if problem.status == 422 => {}
                        other => return Err(format!("a damaged frame: {other:?}").into()),
                    }
                }
                session.track(picture.clone()).await?;
                sent += 1;
                if Instant::now() >= end {
                    break;
                }
            }
            // Every fifth client goes away without ending its session.
            if !(opened + number).is_multiple_of(5) {
                session.end().await?;
            }
        }
        Ok((opened, sent))
    }
}
