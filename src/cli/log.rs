//! Where the log of `serve` goes: to standard error, by a thread of its own.
//!
//! What can go wrong: the reader of standard error stalls. No thread that logs ever waits for it: up to [`MAX_LINES`]
//! lines are kept, further ones are dropped and counted, and the log tells how many as soon as it is read again.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::{self, BufWriter, IsTerminal};
use std::panic::PanicHookInfo;
use std::time::Duration;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, fmt, registry};

/// Lines that wait to be written. A line has some hundred bytes.
const MAX_LINES: usize = 4096;
/// Bytes that are written at once.
const BUFFER_BYTES: usize = 64 << 10;
/// How often dropped lines are told.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// How to log.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum LogFormat {
    /// One readable line an event.
    Text,
    /// One JSON object a line.
    Json,
}

/// The log. Lines that wait are written when it is dropped, if that takes no longer than a second.
#[derive(Debug)]
pub struct Log {
    /// Dropped before the writer, since the export may still log.
    #[cfg(feature = "otel")]
    _export: Option<super::export::Export>,
    _writer: WorkerGuard,
    dropped: DroppedLines,
}

/// Tells how many lines were dropped.
#[derive(Debug, Clone)]
pub struct DroppedLines {
    counter: ErrorCounter,
    told: usize,
}

impl Log {
    /// Sends all events that `filter` lets through, and all panics, to standard error.
    ///
    /// # Errors
    /// The filter or the variables of the export cannot be read.
    pub fn start(filter: &str, format: LogFormat) -> Result<Self, String> {
        let filter = read_filter(filter)?;
        let stderr = BufWriter::with_capacity(BUFFER_BYTES, io::stderr());
        let (lines, writer) = NonBlockingBuilder::default()
            .buffered_lines_limit(MAX_LINES)
            .lossy(true)
            .thread_name("bagtrack-log")
            .finish(stderr);
        let counter = lines.error_counter();
        let log = fmt::layer()
            .with_ansi(io::stderr().is_terminal())
            .with_writer(lines);
        let events = registry().with(filter);
        #[cfg(feature = "otel")]
        let export = super::export::Export::start()?;
        #[cfg(feature = "otel")]
        let events = events.with(export.as_ref().map(super::export::Export::layer));
        match format {
            LogFormat::Text => events.with(log).init(),
            // The current span is enough: a list of all spans would repeat it.
            LogFormat::Json => events.with(log.json().with_span_list(false)).init(),
        }
        // The default hook writes to standard error itself, and would wait for the reader.
        std::panic::set_hook(Box::new(log_panic));
        Ok(Self {
            #[cfg(feature = "otel")]
            _export: export,
            _writer: writer,
            dropped: DroppedLines { counter, told: 0 },
        })
    }

    /// The counter of dropped lines, which reports them.
    pub fn dropped(&self) -> DroppedLines {
        self.dropped.clone()
    }
}

impl DroppedLines {
    /// Logs how many lines were dropped, if that is more than at the last time. Where this line is dropped too, the
    /// next report counts it.
    pub fn report(&mut self) {
        let total = self.counter.dropped_lines();
        if total > self.told {
            let dropped = total - self.told;
            tracing::warn!(
                dropped,
                total,
                "log lines were dropped: they were not read in time"
            );
            self.told = total;
        }
    }

    /// Reports for ever, from time to time.
    pub async fn report_regularly(mut self) {
        let mut ticks = tokio::time::interval(REPORT_EVERY);
        loop {
            ticks.tick().await;
            self.report();
        }
    }
}

/// Levels of chatty libraries. The client of Redis logs each attempt to connect, hundreds a second; the service itself
/// logs when the store goes away and comes back. The database of a store in a folder logs each step of being opened.
const QUIET: &str = "redis=off,fjall=warn,lsm_tree=warn";

/// The filter of this text. A word alone must be a level: a mistyped level would count as the name of a module, and
/// then nothing would be logged.
fn read_filter(text: &str) -> Result<EnvFilter, String> {
    let words = text.split(',').map(str::trim);
    let mut words = words.filter(|word| !word.is_empty() && !word.contains(['=', '[']));
    if let Some(word) = words.find(|word| word.parse::<LevelFilter>().is_err()) {
        return Err(format!(
            "--log (BAGTRACK_LOG): `{word}` is no level; write error, warn, info, debug, trace or off, or \
             MODULE=LEVEL, as in `info,bagtrack=debug`"
        ));
    }
    EnvFilter::try_new(format!("{QUIET},{text}"))
        .map_err(|error| format!("--log (BAGTRACK_LOG) cannot be read: {error}"))
}

fn log_panic(panic: &PanicHookInfo<'_>) {
    let place = panic
        .location()
        .map(ToString::to_string)
        .unwrap_or_default();
    let message = panic.payload_as_str().unwrap_or("a value that is not text");
    let backtrace = Backtrace::capture();
    if backtrace.status() == BacktraceStatus::Captured {
        tracing::error!(place, message, %backtrace, "panicked");
    } else {
        tracing::error!(place, message, "panicked");
    }
}
