//! Frames with bytes changed, cut out or repeated, in the middle of a session.

use crate::good::{GoodClients, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::time::Instant;

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let frames = frames()?;
    let good = GoodClients::start(target, 4).await?;
    let session = target.open("198.51.100.1", &frames[0], "").await?;
    let path = format!("{session}/frames");
    let mut random = StdRng::seed_from_u64(1);
    let end = Instant::now() + options.duration();
    let (mut sent, mut failed, mut taken) = (0, 0, 0);
    while Instant::now() < end {
        let mut frame = frames[sent % frames.len()].clone();
        for _ in 0..random.random_range(1..6) {
            let at = random.random_range(0..frame.len());
            frame[at] = random.random();
        }
        if random.random_bool(0.3) {
            frame.truncate(random.random_range(0..frame.len()));
        }
        let answer = target
            .post("198.51.100.1", &path)
            .body(frame)
            .send()
            .await?;
        sent += 1;
        failed += u32::from(answer.status().is_server_error());
        taken += u64::from(answer.status().is_success());
    }
    let view = target
        .http
        .get(format!("{}{session}", target.url))
        .send()
        .await?;
    let view: serde_json::Value = serde_json::from_slice(&view.bytes().await?)?;
    let consistent = view["frames"] == 1 + taken;
    let seen = format!("{sent} damaged frames, {taken} still readable, {failed} answered with 5xx");
    good.verdict(failed == 0 && consistent, seen).await
}
