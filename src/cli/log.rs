//! Where the log goes: to standard error, in large pieces.
//!
//! A line for each request, each with a system call of its own, is a good part of what a small request costs. So lines are
//! gathered, and a thread writes what there is ten times a second. What could go wrong: lines that are lost with the process;
//! so warnings and errors are written at once, with all lines before them, and the rest at the end.

use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;
use tracing::{Level, Metadata};
use tracing_subscriber::fmt::MakeWriter;

/// How long a line waits at most.
const DELAY: Duration = Duration::from_millis(100);
/// From so many bytes on, whoever logs writes them.
const MOST: usize = 256 << 10;

/// The lines that wait to be written. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct Log(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    lines: Mutex<Vec<u8>>,
    some: Condvar,
}

impl Log {
    /// Starts the thread that writes.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start() -> io::Result<Self> {
        let log = Self::default();
        let writer = log.clone();
        thread::Builder::new()
            .name("bagtrack-log".to_owned())
            .spawn(move || {
                loop {
                    writer.wait();
                    thread::sleep(DELAY);
                    writer.flush();
                }
            })?;
        Ok(log)
    }

    /// Writes what there is.
    pub fn flush(&self) {
        write(&mut self.lines());
    }

    fn wait(&self) {
        let lines = self
            .0
            .some
            .wait_while(self.lines(), |lines| lines.is_empty());
        drop(lines.unwrap_or_else(PoisonError::into_inner));
    }

    fn lines(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Nobody can be told where the log itself cannot be written.
fn write(lines: &mut Vec<u8>) {
    let _ = io::stderr().write_all(lines);
    lines.clear();
}

impl<'a> MakeWriter<'a> for Log {
    type Writer = Line<'a>;

    fn make_writer(&'a self) -> Line<'a> {
        Line {
            log: self,
            urgent: true,
        }
    }

    fn make_writer_for(&'a self, metadata: &Metadata<'_>) -> Line<'a> {
        Line {
            log: self,
            urgent: *metadata.level() <= Level::WARN,
        }
    }
}

/// Takes one line.
#[derive(Debug)]
pub struct Line<'a> {
    log: &'a Log,
    urgent: bool,
}

impl Write for Line<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut lines = self.log.lines();
        let first = lines.is_empty();
        lines.extend_from_slice(bytes);
        if self.urgent || lines.len() >= MOST {
            write(&mut lines);
        } else if first {
            self.log.0.some.notify_one();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
