//! One client with 50 sessions and 400 connections, flat out.

use crate::good::{GoodClients, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use std::time::Instant;
use tokio::task::JoinSet;

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let frames = frames()?;
    let mut urls = Vec::new();
    for _ in 0..50 {
        let session = target.open("198.51.100.1", &frames[0], "").await?;
        urls.push(format!("{}{session}/frames", target.url));
    }
    let good = GoodClients::start(target, 1).await?;
    let end = Instant::now() + options.duration();
    let mut attackers = JoinSet::new();
    for number in 0..400 {
        let (http, url) = (target.http.clone(), urls[number % urls.len()].clone());
        let frame = frames[1].clone();
        attackers.spawn(async move {
            let (mut answered, mut refused) = (0u32, 0u32);
            while Instant::now() < end {
                let request = http.post(&url).header("x-forwarded-for", "198.51.100.1");
                match request.body(frame.clone()).send().await {
                    Ok(answer) if answer.status().is_success() => answered += 1,
                    _ => refused += 1,
                }
            }
            (answered, refused)
        });
    }
    let counts = attackers.join_all().await;
    let answered: u32 = counts.iter().map(|count| count.0).sum();
    let refused: u32 = counts.iter().map(|count| count.1).sum();
    let tally = good.stop().await?;
    let seen = format!("{answered} of its frames answered, {refused} refused; {tally}");
    Ok(Verdict::new(tally.lost == 0 && tally.refused == 0, seen))
}
