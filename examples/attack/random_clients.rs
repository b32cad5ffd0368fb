//! Random clients beside four good ones. Each does all that a client may do, flat out, in an order that its seed gives:
//! posts, batches, streams, videos, creations, half bodies, answers that nobody reads, junk.
//!
//! This is a property and no list: whatever the seed, the good clients lose no frame, are never refused and hardly
//! wait, the service stays alive and within its memory, and gives back all that was held. A seed for which it fails
//! becomes an attack of its own.
//!
//! The attackers are a process of their own at the lowest priority. They would be on other machines: here they take
//! only what the service and the good clients leave, which still keeps every worker busy.

use crate::costly_sessions::QUERY;
use crate::decode_bombs::form;
use crate::good::{GoodClients, PERIOD, Tally, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};
use bagtrack_testing::picture_files::bomb;
use futures_util::{SinkExt, StreamExt};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::process::{Child, Command};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout, timeout_at};
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

/// Sessions expire soon, so that what they held is seen to come back.
pub const SETTINGS: &[&str] = &["--session-idle", "5s", "--session-first", "5s"];

const CLIENTS: u64 = 12;
const GOOD: u8 = 4;
/// How many times longer the good clients' answers may take than without attackers.
const MAX_P50: f64 = 3.0;
const MAX_P99: f64 = 5.0;
/// In a short run a handful of answers decides: there nobody notices what takes less, in milliseconds, or waits for one
/// work that nobody knew to be slow, which takes as long as so many frames. And `/healthz` is compared with how slow
/// the machine makes it anyway. A long run has none of this.
const SHORT_P50: f64 = 10.0;
const SHORT_P99: f64 = 100.0;
const SHORT_P99_FRAMES: f64 = 30.0;
/// The longest that `/healthz` may take.
const MAX_HEALTH: Duration = Duration::from_millis(250);
/// How long the service may take to give back all that was held, from the end of the attackers.
const GIVEN_BACK: Duration = Duration::from_secs(60);
/// What is held, by the names of its metrics.
const HELD: [&str; 7] = [
    "bagtrack_requests_inside",
    "bagtrack_workers_busy",
    "bagtrack_upload_bytes",
    "bagtrack_videos",
    "bagtrack_sessions",
    "bagtrack_session_bytes",
    "bagtrack_streams",
];

/// How often a good client sends, so that it asks for no more than its share of the workers beside the random ones. On
/// a slow machine, or in a build without optimisation, 25 frames a second would be more, and rightly be refused.
async fn fair_period(target: &Target) -> Outcome<Duration> {
    let clients = GoodClients::start(target, GOOD).await?;
    sleep(Duration::from_secs(3)).await;
    let taken = clients.stop().await?.micros.value_at_quantile(0.5);
    let workers = std::thread::available_parallelism()?.get() as u64;
    let fair = taken * (CLIENTS + u64::from(GOOD)) / workers;
    Ok(Duration::from_micros(fair).max(PERIOD))
}

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let seconds = if options.short { 15 } else { options.seconds };
    let period = fair_period(target).await?;
    let quiet = GoodClients::start_at(target, GOOD, period).await?;
    // Other work on the machine slows `/healthz` too.
    let (mut usual, end) = (
        Duration::ZERO,
        Instant::now() + Duration::from_secs(seconds.clamp(5, 30)),
    );
    while Instant::now() < end {
        usual = usual.max(target.health().await?);
        sleep(Duration::from_millis(50)).await;
    }
    let quiet = quiet.stop().await?;

    let good = GoodClients::start_at(target, GOOD, period).await?;
    let mut attackers = start_attackers(target, options, seconds)?;
    let mut slowest = Duration::ZERO;
    while attackers.try_wait()?.is_none() {
        slowest = slowest.max(target.health().await?);
        sleep(Duration::from_millis(50)).await;
    }
    let attacked = attackers.wait()?.success();
    let loud = good.stop().await?;
    let (kept, memory) = target.peak();
    let held = wait_until_given_back(target).await?;
    let ms = |tally: &Tally, quantile| tally.micros.value_at_quantile(quantile) as f64 / 1e3;
    let least = |short: f64| if options.short { short } else { 0.0 };
    let ratio = |quantile, short| ms(&loud, quantile) / ms(&quiet, quantile).max(least(short));
    let max_health = match options.short {
        true => MAX_HEALTH.max(usual.mul_f64(MAX_P99)),
        false => MAX_HEALTH,
    };
    let short_p99 = SHORT_P99.max(SHORT_P99_FRAMES * ms(&quiet, 0.5));
    let (p50, p99) = (
        ratio(0.5, SHORT_P50 / MAX_P50),
        ratio(0.99, short_p99 / MAX_P99),
    );
    let seen = format!(
        "seed {}; a frame each {} ms; quiet {quiet}; beside {CLIENTS} random clients {loud}; /healthz at most {:.0} ms; {memory}; {}",
        options.seed,
        period.as_millis(),
        slowest.as_secs_f64() * 1e3,
        match &held {
            None => "all given back".to_owned(),
            Some(held) => format!("still held: {held}"),
        }
    );
    let holds = attacked
        && loud.lost == 0
        && loud.refused == 0
        && p50 <= MAX_P50
        && p99 <= MAX_P99
        && slowest <= max_health
        && kept
        && held.is_none();
    Ok(Verdict::new(holds, seen))
}

/// Waits until nothing is held any more. Gives what still is.
async fn wait_until_given_back(target: &Target) -> Outcome<Option<String>> {
    let end = Instant::now() + GIVEN_BACK;
    loop {
        let metrics = target.http.get(format!("{}/metrics", target.url)).send();
        let metrics = metrics.await?.text().await?;
        let held = metrics.lines().filter(|line| {
            let (name, value) = line.split_once(' ').unwrap_or((line, "0"));
            HELD.contains(&name) && value.parse() != Ok(0.0)
        });
        let held: Vec<&str> = held.collect();
        if held.is_empty() {
            return Ok(None);
        }
        if Instant::now() >= end {
            return Ok(Some(held.join(", ")));
        }
        sleep(Duration::from_millis(200)).await;
    }
}

fn start_attackers(target: &Target, options: &Options, seconds: u64) -> Outcome<Child> {
    let mut command = Command::new("nice");
    command.args(["-n", "19"]).arg(std::env::current_exe()?);
    command.args(["--attackers-only", "--url", &target.url]);
    command.args(["--seconds", &seconds.to_string()]);
    command.args(["--seed", &options.seed.to_string()]);
    Ok(command.spawn()?)
}

/// What the attackers do, for `options.seconds`.
pub async fn attackers(target: &Target, options: &Options) -> Outcome<()> {
    let end = Instant::now() + Duration::from_secs(options.seconds);
    let uploads = Arc::new((frames()?, bomb()));
    let mut clients = JoinSet::new();
    for number in 0..CLIENTS {
        let target = target.same();
        let uploads = uploads.clone();
        let seed = options.seed.wrapping_mul(1_000).wrapping_add(number);
        clients.spawn(async move {
            let mut client = RandomClient {
                address: address_of(number),
                random: StdRng::seed_from_u64(seed),
                sessions: Vec::new(),
                target,
                uploads,
                end,
            };
            while Instant::now() < end {
                // Whatever is refused, the next thing is tried.
                let _ = timeout_at(end.into(), client.act()).await;
            }
        });
    }
    clients.join_all().await;
    Ok(())
}

/// Every third attacker is one of the same IPv6 network, the others have nothing in common.
fn address_of(number: u64) -> String {
    match number % 3 {
        0 => format!("2001:db8:0:{number:x}::1"),
        _ => format!("198.51.100.{number}"),
    }
}

struct RandomClient {
    address: String,
    random: StdRng,
    sessions: Vec<String>,
    target: Target,
    /// Frames, and a picture that costs far more than its bytes.
    uploads: Arc<(Vec<Vec<u8>>, Vec<u8>)>,
    end: Instant,
}

impl RandomClient {
    async fn act(&mut self) -> Outcome<()> {
        match self.random.random_range(0..10) {
            0..2 => self.create().await,
            2 => self.posts(64).await,
            3 => self.batches().await,
            4 => self.stream().await,
            5 => self.video().await,
            6 => self.half_bodies().await,
            7 => self.unread_answers().await,
            8 => self.junk().await,
            _ => self.posts(1).await,
        }
    }

    fn frame(&mut self) -> Vec<u8> {
        let frames = &self.uploads.0;
        frames[self.random.random_range(0..frames.len())].clone()
    }

    /// A session of its own; a new one where it has none.
    async fn session(&mut self) -> Outcome<String> {
        if self.sessions.is_empty() {
            self.create().await?;
        }
        let at = self.random.random_range(0..self.sessions.len().max(1));
        Ok(self.sessions.get(at).ok_or("it has none")?.clone())
    }

    async fn create(&mut self) -> Outcome<()> {
        for _ in 0..self.random.random_range(1..20) {
            let query = if self.random.random_bool(0.3) {
                QUERY
            } else {
                ""
            };
            let first = self.uploads.0[0].clone();
            let session = self.target.open(&self.address, &first, query).await?;
            self.sessions.push(session);
        }
        let kept = self.sessions.len().saturating_sub(8);
        self.sessions.drain(..kept);
        Ok(())
    }

    /// Posts of one frame, so many at once.
    async fn posts(&mut self, at_once: usize) -> Outcome<()> {
        let path = format!("{}/frames", self.session().await?);
        let mut posts = JoinSet::new();
        for _ in 0..at_once {
            let body = match self.random.random_range(0..8) {
                0 => self.uploads.1.clone(),
                1 => self.frame()[..500].to_vec(),
                2 => b"no image".to_vec(),
                _ => self.frame(),
            };
            posts.spawn(self.target.post(&self.address, &path).body(body).send());
        }
        posts.join_all().await;
        Ok(())
    }

    async fn batches(&mut self) -> Outcome<()> {
        let mut posts = JoinSet::new();
        for _ in 0..self.random.random_range(1..6) {
            let path = format!("{}/frames", self.session().await?);
            let count = self.random.random_range(2..=64);
            let frame = match self.random.random_bool(0.2) {
                true => self.uploads.1.clone(),
                false => self.frame(),
            };
            let post = self.target.post(&self.address, &path);
            posts.spawn(post.multipart(form(&frame, count)).send());
        }
        posts.join_all().await;
        Ok(())
    }

    /// A stream with messages of all kinds, whose answers are read, or not.
    async fn stream(&mut self) -> Outcome<()> {
        let session = self.session().await?;
        let drop = self.random.random_bool(0.5);
        let url = format!("ws://{}{session}/stream?drop={drop}", self.target.address);
        let mut request = url.into_client_request()?;
        let address = self.address.parse()?;
        request.headers_mut().insert("x-forwarded-for", address);
        let connection = TcpStream::connect(self.target.address).await?;
        let (mut stream, _) = client_async(request, connection).await?;
        let (reads, kind) = (self.random.random_bool(0.5), self.random.random_range(0..5));
        for _ in 0..self.random.random_range(1..20_000) {
            let message = match kind {
                0 => Message::text("{}"),
                1 => Message::Ping(Vec::new().into()),
                2 => Message::binary(vec![7; 2]),
                3 => Message::text("[".repeat(4_000)),
                _ => Message::binary(self.frame()),
            };
            stream.feed(message).await?;
            if reads {
                stream.flush().await?;
                let _ = timeout(Duration::from_millis(1), stream.next()).await;
            }
            if Instant::now() >= self.end {
                break;
            }
        }
        Ok(())
    }

    async fn video(&mut self) -> Outcome<()> {
        let path = format!("{}/frames", self.session().await?);
        let video = self
            .uploads
            .0
            .concat()
            .repeat(self.random.random_range(1..10));
        let post = self.target.post(&self.address, &path);
        let post = post.header("content-type", "video/x-motion-jpeg");
        let mut answer = post.body(video).send().await?;
        // It may leave in the middle.
        let lines = self.random.random_range(1..200);
        for _ in 0..lines {
            if answer.chunk().await?.is_none() {
                break;
            }
        }
        Ok(())
    }

    /// Heads that announce a body, and some of it, in pieces of any size.
    async fn half_bodies(&mut self) -> Outcome<()> {
        let session = self.session().await?;
        let mut held = JoinSet::new();
        for _ in 0..self.random.random_range(1..8) {
            let kind = match self.random.random_range(0..3) {
                0 => "Content-Type: multipart/form-data; boundary=b\r\nContent-Length: 33554432",
                1 => "Content-Type: application/json\r\nContent-Length: 33554432",
                _ => "Content-Length: 12000000",
            };
            let head = format!(
                "POST {session}/frames HTTP/1.1\r\nHost: localhost\r\nX-Forwarded-For: {}\r\n{kind}\r\n\r\n",
                self.address
            );
            let body = vec![b' '; self.random.random_range(0..8 << 20)];
            let time = Duration::from_millis(self.random.random_range(0..3_000));
            let (address, end) = (self.target.address, self.end);
            held.spawn(async move {
                let until = (Instant::now() + time).min(end);
                let sent = raw::send(address, [head.into_bytes(), body].concat());
                if let Ok(Ok(stream)) = timeout_at(until.into(), sent).await {
                    raw::hold(stream, until.into()).await;
                }
            });
        }
        held.join_all().await;
        Ok(())
    }

    async fn unread_answers(&mut self) -> Outcome<()> {
        let head = format!(
            "Host: localhost\r\nX-Forwarded-For: {}\r\n\r\n",
            self.address
        );
        let ask = format!("GET /openapi.json HTTP/1.1\r\n{head}").repeat(200);
        let time = Duration::from_millis(self.random.random_range(0..3_000));
        let until = (Instant::now() + time).min(self.end);
        if let Ok(held) = timeout_at(until.into(), raw::send(self.target.address, ask)).await {
            raw::hold(held?, until.into()).await;
        }
        Ok(())
    }

    /// Bytes that are no HTTP, or hardly.
    async fn junk(&mut self) -> Outcome<()> {
        for _ in 0..20 {
            let mut bytes = vec![0; self.random.random_range(1..3_000)];
            self.random.fill(&mut bytes[..]);
            let begin: &[u8] = match self.random.random_range(0..3) {
                0 => b"POST /sessions HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n",
                1 => b"GET /%ff HTTP/1.1\r\n",
                _ => b"",
            };
            let mut sent = raw::send(self.target.address, [begin, &bytes].concat()).await?;
            raw::read(&mut sent, Duration::from_millis(20)).await;
        }
        Ok(())
    }
}
