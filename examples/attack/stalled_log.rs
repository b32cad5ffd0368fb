//! Whoever reads the log stops reading: nothing may wait for it.

use crate::good::GoodClients;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use std::time::Duration;
use tokio::task::JoinSet;

pub const SETTINGS: &[&str] = &[];

/// With two lines each, many times what the pipe and the service keep.
const REQUESTS: usize = 4000;

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    target.stall_log();
    let mut requests = JoinSet::new();
    for number in 0..8 {
        let (http, url) = (target.http.clone(), format!("{}/nowhere", target.url));
        requests.spawn(async move {
            let mut answered = 0;
            for _ in number..REQUESTS / 8 + number {
                let answer = http.get(&url).timeout(Duration::from_secs(5)).send().await;
                answered += usize::from(answer.is_ok());
            }
            answered
        });
    }
    let answered: usize = requests.join_all().await.iter().sum();
    let health = target.health().await?;
    let ms = health.as_secs_f64() * 1e3;
    let seen = format!("{answered} of {REQUESTS} requests answered, /healthz in {ms:.1} ms");
    good.verdict(answered == REQUESTS && ms < 1000.0, seen)
        .await
}
