//! A body of 600 MiB is announced: refused before it is sent.

use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};
use std::time::{Duration, Instant};
use tokio::io::AsyncReadExt;

pub const SETTINGS: &[&str] = &[];

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let head = "POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 629145600\r\n\r\n";
    let sent = Instant::now();
    let mut stream = raw::send(target.address, head).await?;
    let mut status = [0; 12];
    let read = stream.read_exact(&mut status);
    let in_time = tokio::time::timeout(Duration::from_secs(5), read).await;
    let status = String::from_utf8_lossy(&status).into_owned();
    let holds = matches!(in_time, Ok(Ok(_))) && status == "HTTP/1.1 413";
    let took = sent.elapsed().as_secs_f64() * 1e3;
    Ok(Verdict::new(holds, format!("{status} after {took:.1} ms")))
}
