//! Requests of some kilobytes with 64 images of 33 megapixels, for sessions of another size.

use crate::good::{GoodClients, frames};
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use bagtrack_testing::picture_files::bomb;
use reqwest::multipart::{Form, Part};
use std::time::Instant;
use tokio::task::JoinSet;

/// A form with a picture, repeated `count` times.
pub fn form(picture: &[u8], count: usize) -> Form {
    let part = || Part::bytes(picture.to_vec()).file_name("frame");
    (0..count).fold(Form::new(), |form, _| form.part("frame", part()))
}

/// Four clients post a picture 64 times in each request, to sessions that are opened so. Gives how many requests they
/// sent, and how many were not answered with 422.
pub async fn flood(
    target: &Target,
    options: &Options,
    picture: &[u8],
    query: &str,
) -> Outcome<(u32, u32)> {
    let frames = frames()?;
    let mut attackers = JoinSet::new();
    let end = Instant::now() + options.duration();
    for number in 0..4 {
        let client = format!("198.51.100.{number}");
        let session = target.open(&client, &frames[0], query).await?;
        let (http, picture) = (target.http.clone(), picture.to_vec());
        let url = format!("{}{session}/frames", target.url);
        attackers.spawn(async move {
            let (mut sent, mut taken) = (0u32, 0u32);
            while Instant::now() < end {
                let request = http.post(&url).header("x-forwarded-for", &client);
                let answer = request.multipart(form(&picture, 64)).send().await;
                sent += 1;
                taken += u32::from(answer.is_ok_and(|answer| answer.status() != 422));
            }
            (sent, taken)
        });
    }
    let counts = attackers.join_all().await;
    let sent = counts.iter().map(|count| count.0).sum();
    let taken = counts.iter().map(|count| count.1).sum();
    Ok((sent, taken))
}

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    let (sent, taken) = flood(target, options, &bomb(), "").await?;
    let seen = format!("{sent} requests with 64 bombs, {taken} not answered with 422");
    good.verdict(taken == 0 && sent > 0, seen).await
}
