//! Sessions with the most expensive parameters, and as many frames in each request as the service accepts.

use crate::decode_bombs::flood;
use crate::good::{GoodClients, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict};

/// The query that opens such a session.
pub const QUERY: &str = "&preset=paper&parameters=%7B%22particles%22%3A260%2C%22patch_width%22%3A64%2C\
    %22patch_height%22%3A64%2C%22bag_size%22%3A32%2C%22update_every%22%3A1%2C%22history%22%3A10%2C%22basis_dim%22%3A6%7D";

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    let (sent, _) = flood(target, options, &frames()?[1], QUERY).await?;
    good.verdict(sent > 0, format!("{sent} requests with 64 costly frames"))
        .await
}
