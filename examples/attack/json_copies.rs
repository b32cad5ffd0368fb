//! Bodies of 32 MiB of JSON with base64, from many clients at once.

use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use reqwest::StatusCode;
use tokio::task::JoinSet;

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    // Line breaks make a copy necessary.
    let line = "A".repeat(76) + "\\n";
    let text = line.repeat((31 << 20) / line.len());
    let body = format!("{{\"frame\": \"{text}\"}}");
    let rounds = if options.short { 1 } else { 4 };
    let mut counts = std::collections::BTreeMap::new();
    for _ in 0..rounds {
        let mut clients = JoinSet::new();
        for number in 0..16 {
            let request = target.post(&format!("198.51.100.{number}"), "/sessions?box=1,1,9,9");
            let request = request
                .header("content-type", "application/json")
                .body(body.clone());
            clients.spawn(request.send());
        }
        for answer in clients.join_all().await {
            let status = answer.map_or(StatusCode::IM_A_TEAPOT, |answer| answer.status());
            *counts.entry(status.as_u16()).or_insert(0) += 1;
        }
    }
    let (kept, memory) = target.peak();
    Ok(Verdict::new(
        kept,
        format!("answers by status {counts:?}, {memory}"),
    ))
}
