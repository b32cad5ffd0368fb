//! Many times more connections than are taken, all of them silent.

use crate::good::GoodClients;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;

pub const SETTINGS: &[&str] = &["--max-connections", "100"];

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    let end = Instant::now() + options.duration();
    let mut held = std::collections::VecDeque::new();
    let (mut opened, mut slowest) = (0, Duration::ZERO);
    while Instant::now() < end {
        for _ in 0..50 {
            held.push_back(TcpStream::connect(target.address).await?);
            opened += 1;
        }
        while held.len() > 400 {
            held.pop_front();
        }
        slowest = slowest.max(target.health().await?);
    }
    let ms = slowest.as_secs_f64() * 1e3;
    let seen = format!("{opened} connections for 100 places, slowest /healthz {ms:.1} ms");
    good.verdict(slowest < Duration::from_secs(2), seen).await
}
