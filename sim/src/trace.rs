//! What happened in a run, line by line. The same seed gives the same bytes.

use bagtrack_sessions::clock::{Instant, now};
use std::fmt;
use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// The lines so far. Clones write to the same ones.
#[derive(Debug, Clone)]
pub struct Trace {
    begin: Instant,
    lines: Arc<Mutex<Vec<u8>>>,
}

impl Trace {
    /// An empty trace, whose lines will have their times since now.
    pub fn begin() -> Self {
        Self {
            begin: now(),
            lines: Arc::default(),
        }
    }

    pub fn note(&self, line: fmt::Arguments) {
        let at = self.begin.elapsed().as_millis();
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        writeln!(lines, "{at:>8} ms  {line}").expect("memory takes it");
    }

    pub fn bytes(&self) -> Vec<u8> {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.clone()
    }
}
