//! One client opens sessions until it gets no more; another still gets one.

use crate::good::frames;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};

pub const SETTINGS: &[&str] = &["--max-sessions", "200"];

pub async fn attack(target: &Target, _: &Options) -> Outcome<Verdict> {
    let frame = &frames()?[0];
    let mut opened = 0;
    let refusal = loop {
        match target.open("198.51.100.1", frame, "").await {
            Ok(_) => opened += 1,
            Err(refusal) => break refusal,
        }
        if opened > 5000 {
            return Ok(Verdict::new(
                false,
                format!("{opened} sessions for one client"),
            ));
        }
    };
    let other = target.open("203.0.113.1", frame, "").await;
    let seen = format!(
        "{opened} sessions, then «{refusal}»; another client {} one",
        if other.is_ok() {
            "gets"
        } else {
            "gets not even"
        }
    );
    Ok(Verdict::new(other.is_ok(), seen))
}
