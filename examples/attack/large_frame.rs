//! A frame of 40 megapixels after a replay, which once was decoded on a network thread: `/healthz` answers beside it.

use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use image::{DynamicImage, GrayImage, ImageFormat, Luma};
use reqwest::StatusCode;
use std::io::Cursor;
use std::time::{Duration, Instant};

pub const SETTINGS: &[&str] = &[];

fn frame(value: u8) -> Outcome<Vec<u8>> {
    let picture = GrayImage::from_fn(8000, 5000, |x, y| {
        Luma([value + ((x / 80) ^ (y / 50)) as u8 % 90])
    });
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::ImageLuma8(picture).write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let (first, next) = (frame(10)?, frame(20)?);
    let (client, query) = ("198.51.100.1", "box=2000,1500,1600,1200");
    let path = target.open_with(client, &first, query).await?;
    let url = format!("{}{path}", target.url);
    let replay = target
        .http
        .put(format!("{url}/target?{query}&frame=0"))
        .body(first);
    let replayed = replay.header("x-forwarded-for", client).send().await?;
    let is_replayed = replayed.headers().contains_key("replayed");
    let (mut frames, mut slowest, mut asked, mut longest) = (0, Duration::ZERO, 0, Duration::ZERO);
    for number in 1..=3 {
        let sent = Instant::now();
        let post = target.post(client, &format!("{path}/frames?frame={number}"));
        let mut posted = tokio::spawn(post.body(next.clone()).send());
        let answer = loop {
            tokio::select! {
                answer = &mut posted => break answer??,
                health = target.health() => {
                    slowest = slowest.max(health?);
                    asked += 1;
                }
            }
        };
        longest = longest.max(sent.elapsed());
        frames += u32::from(answer.status() == StatusCode::OK);
    }
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let seen = format!(
        "{frames} frames in at most {:.0} ms; of {asked} answers of /healthz the slowest after {:.1} ms",
        ms(longest),
        ms(slowest)
    );
    let holds = is_replayed && frames == 3 && asked > 10 && slowest < longest / 2;
    Ok(Verdict::new(holds, seen))
}
