//! Sessions with the most expensive parameters, and as many frames in each request as are taken.

use crate::decode_bombs::form;
use crate::good::{GoodClients, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use std::time::Instant;
use tokio::task::JoinSet;

/// The query that opens such a session.
pub const QUERY: &str = "&preset=paper&parameters=%7B%22particles%22%3A260%2C%22patch_width%22%3A64%2C\
    %22patch_height%22%3A64%2C%22bag_size%22%3A32%2C%22update_every%22%3A1%2C%22history%22%3A10%2C%22basis_dim%22%3A6%7D";

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let frames = frames()?;
    let good = GoodClients::start(target, 4).await?;
    let mut attackers = JoinSet::new();
    let end = Instant::now() + options.duration();
    for number in 0..4 {
        let client = format!("198.51.100.{number}");
        let session = target.open(&client, &frames[0], QUERY).await?;
        let (http, frame) = (target.http.clone(), frames[1].clone());
        let url = format!("{}{session}/frames", target.url);
        attackers.spawn(async move {
            let mut sent = 0u32;
            while Instant::now() < end {
                let request = http.post(&url).header("x-forwarded-for", &client);
                let _ = request.multipart(form(&frame, 64)).send().await;
                sent += 1;
            }
            sent
        });
    }
    let sent: u32 = attackers.join_all().await.iter().sum();
    good.verdict(sent > 0, format!("{sent} requests with 64 costly frames"))
        .await
}
