//! All at once, at more than the service can do: bombs, costly sessions, slow and silent clients, garbage, floods.
//!
//! The attackers are a process of their own at the lowest priority. They would be on other machines: here they take only
//! what the service and the good clients leave, which still keeps every worker busy.

use crate::costly_sessions::QUERY;
use crate::decode_bombs::{bomb, form};
use crate::good::{GoodClients, Tally, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};
use std::process::{Child, Command};
use std::time::{Duration, Instant};
use tokio::task::JoinSet;
use tokio::time::sleep;

pub const SETTINGS: &[&str] = &[];

/// How many times longer the good clients' slowest answers may take than without attackers (p99).
const MAX_RATIO: f64 = 3.0;

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let quiet = GoodClients::start(target, 8).await?;
    sleep(Duration::from_secs(options.seconds.min(30))).await;
    let quiet = quiet.stop().await?;

    let good = GoodClients::start(target, 8).await?;
    let mut attackers = start_attackers(target, options)?;
    while attackers.try_wait()?.is_none() {
        sleep(Duration::from_millis(100)).await;
    }
    let attacked = attackers.wait()?.success();
    let loud = good.stop().await?;
    let (kept, memory) = target.peak();
    let p99 = |tally: &Tally| tally.micros.value_at_quantile(0.99).max(1) as f64;
    let ratio = p99(&loud) / p99(&quiet);
    let seen = format!("quiet {quiet}; under attack {loud}; p99 × {ratio:.1}; {memory}");
    let holds = attacked && loud.lost == 0 && kept && ratio <= MAX_RATIO;
    Ok(Verdict::new(holds, seen))
}

fn start_attackers(target: &Target, options: &Options) -> Outcome<Child> {
    let mut command = Command::new("nice");
    command.args(["-n", "19"]).arg(std::env::current_exe()?);
    command.args(["--attackers-only", "--url", &target.url]);
    command.args(["--seconds", &options.seconds.to_string()]);
    Ok(command.spawn()?)
}

/// What the attackers do, for `options.seconds`.
pub async fn attackers(target: &Target, options: &Options) -> Outcome<()> {
    let end = Instant::now() + Duration::from_secs(options.seconds);
    let mut attackers = JoinSet::new();
    let (frames, bomb) = (frames()?, bomb()?);
    for number in 0..48 {
        let client = format!("198.51.100.{}", number % 12);
        let query = if number % 4 == 0 { QUERY } else { "" };
        let session = target.open(&client, &frames[0], query).await?;
        let (http, url) = (
            target.http.clone(),
            format!("{}{session}/frames", target.url),
        );
        let (frame, bomb) = (frames[1].clone(), bomb.clone());
        attackers.spawn(async move {
            while Instant::now() < end {
                let request = http.post(&url).header("x-forwarded-for", &client);
                let request = match number % 6 {
                    0 => request.multipart(form(&bomb, 64)),
                    1 => request.body(frame[..frame.len() / 2].to_vec()),
                    2 => request.multipart(form(&frame, 64)),
                    _ => request.body(frame.clone()),
                };
                let _ = request.send().await;
            }
        });
    }
    let address = target.address;
    for number in 0..40 {
        attackers.spawn(async move {
            while Instant::now() < end {
                let ask = match number % 4 {
                    0 => "POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 33554432\r\n\r\n"
                        .to_owned(),
                    1 => "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(200),
                    2 => "GET /healthz HTT".to_owned(),
                    _ => "NONSENSE\r\n\r\n".to_owned(),
                };
                if let Ok(held) = raw::send(address, ask).await {
                    raw::hold(held, end.into()).await;
                }
                sleep(Duration::from_millis(100)).await;
            }
        });
    }
    attackers.join_all().await;
    Ok(())
}
