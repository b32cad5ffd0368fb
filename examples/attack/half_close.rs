//! A client that closes its side after a whole request gets its answer; one that closes it within its request holds
//! nothing.

use crate::good::{frames, target_box};
use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};
use std::time::Duration;
use tokio::io::AsyncWriteExt;

pub const SETTINGS: &[&str] = &[];

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let frame = &frames()?[0];
    let head = format!(
        "POST /sessions?box={} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {}\r\n\r\n",
        target_box(),
        frame.len()
    );
    let mut stream = raw::send(target.address, [head.as_bytes(), frame].concat()).await?;
    stream.shutdown().await?;
    let answer = raw::read(&mut stream, Duration::from_secs(5)).await;
    let answered = answer.starts_with("HTTP/1.1 201");
    let ended = raw::ends(&mut stream, Duration::from_secs(5)).await;
    let start: String = answer.chars().take(20).collect();
    // Its last bytes never come.
    let part = [head.as_bytes(), &frame[..frame.len() / 2]].concat();
    let mut gone = raw::send(target.address, part).await?;
    gone.shutdown().await?;
    let part_ended = raw::ends(&mut gone, Duration::from_secs(5)).await;
    Ok(Verdict::new(
        answered && ended && part_ended,
        format!(
            "answered {start:?}, then closed: {ended}; half a request, then closed: {part_ended}"
        ),
    ))
}
