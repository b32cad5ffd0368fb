//! Snapshots with bytes changed, cut off or added: none may open a session.

use crate::good::frames;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::time::Instant;

pub const SETTINGS: &[&str] = &[];

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let session = target.open("198.51.100.1", &frames()?[0], "").await?;
    let url = format!("{}{session}/snapshot", target.url);
    let whole = target.http.get(url).send().await?.bytes().await?.to_vec();
    let mut random = StdRng::seed_from_u64(1);
    let end = Instant::now() + options.duration();
    let (mut sent, mut opened, mut failed) = (0, 0, 0);
    while Instant::now() < end {
        let mut forged = whole.clone();
        match sent % 3 {
            0 => {
                let at = random.random_range(0..forged.len());
                forged[at] ^= random.random_range(1..=255u8);
            }
            1 => forged.truncate(random.random_range(16..forged.len())),
            _ => forged.extend(vec![random.random::<u8>(); 1 << random.random_range(0..20)]),
        }
        let status = target
            .post("198.51.100.1", "/sessions")
            .body(forged)
            .send()
            .await?
            .status();
        sent += 1;
        opened += u32::from(status.is_success());
        failed += u32::from(status.is_server_error());
    }
    let original = target
        .post("198.51.100.1", "/sessions")
        .body(whole)
        .send()
        .await?
        .status();
    let (kept, memory) = target.peak();
    let seen = format!(
        "{sent} forged snapshots, {opened} opened, {failed} answered with 5xx; the original {original}; {memory}"
    );
    let holds = opened == 0 && failed == 0 && original.is_success() && kept && sent > 0;
    Ok(Verdict::new(holds, seen))
}
