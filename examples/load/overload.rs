//! More frames than the server gets done: what becomes of those that it answers, and of the others?
//!
//! Cameras of ten frames a second, a tenth of a session's frames each, at clients of a network of their own. A camera
//! sends its newest frame, without a number, and goes on after a refusal: it does not wait as `Retry-After` asks. Where
//! the answer is late it skips the frames that were due meanwhile.

use std::time::Duration;

use hdrhistogram::Histogram;
use reqwest::{Client, StatusCode};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until};

use crate::Outcome;
use crate::drive::{Done, Driver};

/// Frames a second of a camera.
const RATE: f64 = 10.0;
/// Cameras of one client.
const OF_A_CLIENT: u32 = 10;
/// Frames in this time are not counted: the queue fills for the first time.
const WARM_UP: Duration = Duration::from_secs(2);

/// What became of the frames.
struct Answers {
    /// Latencies of the answered frames, in microseconds.
    latencies: Histogram<u64>,
    refused: u64,
    /// Refusals that do not say when to try again.
    without_time: u64,
    skipped: u64,
}

impl Answers {
    fn new() -> Outcome<Self> {
        Ok(Self {
            latencies: Histogram::new(3)?,
            refused: 0,
            without_time: 0,
            skipped: 0,
        })
    }

    fn add(&mut self, other: &Self) -> Outcome<()> {
        self.latencies.add(&other.latencies)?;
        self.refused += other.refused;
        self.without_time += other.without_time;
        self.skipped += other.skipped;
        Ok(())
    }
}

/// Prints how many of `frames` frames that many sessions get through in a second, and what becomes of so many `times`
/// as many, for so long each.
pub async fn run(
    driver: &Driver,
    (sessions, frames, length): (u32, u32, Duration),
    times: &[f64],
) -> Outcome<()> {
    let mut done = Done::new()?;
    let mut clients = driver.open(sessions).await?;
    clients.run(frames, None, length, &mut done).await?;
    clients.close().await?;
    let knee = done.per_second();
    println!("{sessions} sessions, closed loop: {knee:.0} frames a second");
    for times in times {
        send(driver, knee, *times, length).await?;
    }
    Ok(())
}

/// Sends `times` the frames that the server gets through in a second, `knee`, for so long, and prints what became of
/// them.
async fn send(driver: &Driver, knee: f64, times: f64, length: Duration) -> Outcome<()> {
    let cameras = (times * knee / RATE).ceil() as u32;
    let mut opened = Vec::new();
    for number in 0..cameras {
        opened.push(Camera::open(driver, number).await?);
    }
    let begin = Instant::now() + Duration::from_millis(100);
    let mut running = JoinSet::new();
    for camera in opened {
        running.spawn(camera.run(begin, length));
    }
    let mut all = Answers::new()?;
    while let Some(camera) = running.join_next().await {
        let answers = camera??;
        all.add(&answers)?;
    }
    let answered = all.latencies.len();
    let per_second = answered as f64 / (length - WARM_UP).as_secs_f64();
    let quantile = |q| all.latencies.value_at_quantile(q) as f64 / 1e3;
    println!(
        "{times} × the knee, {cameras} cameras: {per_second:.0} frames a second answered, {:.2} × the knee; p50 {:.1} ms, \
         p99 {:.1} ms, most {:.1} ms",
        per_second / knee,
        quantile(0.5),
        quantile(0.99),
        quantile(1.0)
    );
    println!(
        "    {} refused, {} of them without `Retry-After`; {} skipped by the cameras",
        all.refused, all.without_time, all.skipped
    );
    Ok(())
}

/// A session, whose frames fall due at a fixed rate.
struct Camera {
    http: Client,
    frames: String,
    driver: Driver,
    number: u32,
}

impl Camera {
    async fn open(driver: &Driver, number: u32) -> Outcome<Self> {
        // A network for each client, so that they do not share.
        let client = number / OF_A_CLIENT;
        let address = format!("10.{}.{}.1", client / 256, client % 256);
        let mut headers = reqwest::header::HeaderMap::new();
        headers.insert("x-forwarded-for", address.parse()?);
        let http = Client::builder().default_headers(headers).build()?;
        let opening = driver.opening();
        let opened = loop {
            let opened = http
                .post(&opening)
                .body(driver.pictures[0].clone())
                .send()
                .await?;
            if opened.status() != StatusCode::SERVICE_UNAVAILABLE {
                break opened.error_for_status()?;
            }
        };
        let location = opened
            .headers()
            .get("location")
            .ok_or("no location")?
            .to_str()?;
        let frames = format!("{}{location}/frames", driver.url());
        Ok(Self {
            http,
            frames,
            driver: driver.clone(),
            number,
        })
    }

    async fn run(self, begin: Instant, length: Duration) -> Outcome<Answers> {
        let mut answers = Answers::new()?;
        let every = Duration::from_secs_f64(1.0 / RATE);
        // The cameras begin at different moments.
        let mut due = begin + every.mul_f64(f64::from(self.number) * 0.618 % 1.0);
        let mut pictures = self.driver.pictures.iter().cycle().skip(1);
        while due < begin + length {
            sleep_until(due).await;
            let picture = pictures.next().expect("a cycle has no end").clone();
            let answer = self.http.post(&self.frames).body(picture).send().await?;
            let (status, told) = (
                answer.status(),
                answer.headers().contains_key("retry-after"),
            );
            answer.bytes().await?;
            if due > begin + WARM_UP {
                match status {
                    StatusCode::OK => answers.latencies.record(due.elapsed().as_micros() as u64)?,
                    StatusCode::SERVICE_UNAVAILABLE | StatusCode::TOO_MANY_REQUESTS => {
                        answers.refused += 1;
                        answers.without_time += u64::from(!told);
                    }
                    other => return Err(format!("a frame was answered {other}").into()),
                }
            }
            due += every;
            while due < Instant::now() {
                due += every;
                answers.skipped += 1;
            }
        }
        Ok(answers)
    }
}
