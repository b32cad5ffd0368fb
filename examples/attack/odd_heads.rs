//! Heads that are not HTTP, or that two programs might read differently.

use crate::target::Target;
use crate::{Options, Outcome, Verdict, raw};
use std::time::Duration;

pub const SETTINGS: &[&str] = &[];

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let long = format!(
        "GET / HTTP/1.1\r\nHost: localhost\r\nx: {}\r\n\r\n",
        "a".repeat(200_000)
    );
    let heads = [
        ("no host", "GET /healthz HTTP/1.1\r\n\r\n", "400"),
        (
            "two hosts",
            "GET /healthz HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
            "400",
        ),
        ("no HTTP", "NONSENSE\r\n\r\n", "400"),
        (
            "a space in a name",
            "GET / HTTP/1.1\r\nHost: localhost\r\nbad name: 1\r\n\r\n",
            "400",
        ),
        (
            "two lengths",
            "POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nab",
            "400",
        ),
        ("a huge head", long.as_str(), "431"),
    ];
    let mut wrong = Vec::new();
    for (name, head, status) in heads {
        let mut stream = raw::send(target.address, head).await?;
        let answer = raw::read(&mut stream, Duration::from_millis(300)).await;
        if !answer.starts_with(&format!("HTTP/1.1 {status}")) {
            let start: String = answer.chars().take(40).collect();
            wrong.push(format!("{name}: {start:?}"));
        }
    }
    let seen = match wrong.as_slice() {
        [] => "6 heads refused".to_owned(),
        wrong => wrong.join("; "),
    };
    Ok(Verdict::new(wrong.is_empty(), seen))
}
