//! Clients that ask for large answers and read none.

use crate::good::GoodClients;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use std::time::Duration;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::timeout;

pub const SETTINGS: &[&str] = &["--max-connections", "60"];

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    let patience = Duration::from_secs(if options.short { 15 } else { 60 });
    let mut attackers = JoinSet::new();
    for _ in 0..50 {
        let address = target.address;
        attackers.spawn(async move {
            let Ok(mut stream) = TcpStream::connect(address).await else {
                return true;
            };
            let ask = "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(200);
            let refused = async { while stream.write_all(ask.as_bytes()).await.is_ok() {} };
            timeout(patience, refused).await.is_ok()
        });
    }
    let ended = attackers.join_all().await;
    let held = ended.iter().filter(|ended| !**ended).count();
    let health = target.health().await?.as_secs_f64() * 1e3;
    let seen = format!(
        "{} clients, {held} still connected at the end, /healthz in {health:.1} ms",
        ended.len()
    );
    good.verdict(held == 0, seen).await
}
