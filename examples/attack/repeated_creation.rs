//! Requests to open a session that are sent again, and clients that go before they have the answer.

use crate::good::{frames, target_box};
use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use tokio::task::JoinSet;
use tokio::time::sleep;

pub const SETTINGS: &[&str] = &["--session-first", "2s", "--session-idle", "4s"];

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let frame = &frames()?[0];
    let path = format!("/sessions?box={}", target_box());
    let mut requests = JoinSet::new();
    for _ in 0..16 {
        let request = target.post("198.51.100.1", &path).body(frame.clone());
        requests.spawn(request.header("idempotency-key", "again").send());
    }
    let mut ids = BTreeSet::new();
    for answer in requests.join_all().await {
        let location = answer?.headers().get("location").cloned();
        ids.insert(location.ok_or("no session")?.to_str()?.to_owned());
    }
    let one = sessions(target).await?;
    // Forty more, whose clients are gone before the answer.
    let head = format!(
        "POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {}\r\n\r\n",
        frame.len()
    );
    for _ in 0..40 {
        drop(raw::send(target.address, [head.as_bytes(), frame].concat()).await?);
    }
    let end = Instant::now() + Duration::from_secs(20);
    let mut left = sessions(target).await?;
    while left > 0 && Instant::now() < end {
        sleep(Duration::from_millis(200)).await;
        left = sessions(target).await?;
    }
    let seen = format!(
        "16 requests with one key opened {} session, of which {one} was there; {left} orphans left",
        ids.len()
    );
    Ok(Verdict::new(ids.len() == 1 && one == 1 && left == 0, seen))
}

/// Sessions in memory.
async fn sessions(target: &Target) -> Outcome<u64> {
    let text = target
        .http
        .get(format!("{}/metrics", target.url))
        .send()
        .await?
        .text()
        .await?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("bagtrack_sessions "));
    Ok(line.ok_or("no metric of sessions")?.trim().parse()?)
}
