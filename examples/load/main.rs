//! A load generator: `cargo build --release && cargo run --release --example load -- --help`.
//!
//! It starts a server of its own on a free loopback port and prints, from one run:
//! - the processor time of decoding and tracking a frame in this process, one thread, before and after each measurement: of
//!   one session over and over, all of whose data stays in the caches, and of as many sessions as are measured, in turns;
//! - what one session and what many can get through when each sends its next frame as soon as the last is answered;
//! - open loop: frames are due at fixed times whatever became of the frames before, and latency counts from when a
//!   frame was due, so a stall is not hidden by sending less (percentiles from an HDR histogram);
//! - the processor time of the server process for a frame against that of decoding and tracking.
//!
//! With `--memory` it opens the sessions, fills their bags, and prints what memory the server has come to.
//!
//! Frames, sessions and time are bounded. Linux only: processor time is read from `/proc`.

mod drive;
mod memory;
mod pictures;
mod process;

use std::path::PathBuf;
use std::time::Duration;

use bagtrack::ingest::{self, Limits};
use bagtrack::tracker::{Preset, Rect, Tracker};
use clap::Parser;
use process::{Server, cpu_seconds};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

#[derive(Debug, Parser)]
struct Options {
    /// Sessions at once.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    sessions: u32,
    /// Frames of each measurement.
    #[arg(long, default_value_t = 6000, value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    frames: u32,
    /// Frames a second in the open loop; otherwise half of what many sessions got through.
    #[arg(long)]
    rate: Option<f64>,
    /// Times 320 x 240 pixels.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=6))]
    zoom: u32,
    /// Preset of the sessions: paper or robust.
    #[arg(long, default_value = "robust")]
    preset: String,
    /// Seconds after which a measurement ends whatever was done.
    #[arg(long, default_value_t = 60)]
    seconds: u64,
    /// Print the resident memory of the server with 1000, 2000, 5000 … of these sessions, and nothing else.
    #[arg(long)]
    memory: bool,
    /// The server's binary; otherwise `bagtrack` beside this program's folder.
    #[arg(long)]
    server: Option<PathBuf>,
}

fn main() -> Outcome<()> {
    let options = Options::parse();
    let preset: Preset = serde_json::from_value(serde_json::json!(options.preset))?;
    let pictures = pictures::jpegs(options.zoom as usize)?;
    let target = pictures::target(options.zoom as usize);
    println!(
        "frames of {} x {}, {} KiB each, preset {}",
        pictures::WIDTH * options.zoom as usize,
        pictures::HEIGHT * options.zoom as usize,
        pictures.iter().map(|jpeg| jpeg.len()).sum::<usize>() / pictures.len() / 1024,
        options.preset
    );

    let server = Server::start(options.server.clone(), options.sessions)?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let driver = drive::Driver::new(server.url(), pictures.clone(), target, &options.preset);
    if options.memory {
        return runtime.block_on(memory::print(&driver, &server, preset, options.sessions));
    }
    let mut one = InProcess::new(pictures.clone(), target, preset, 1)?;
    let mut several = InProcess::new(pictures, target, preset, options.sessions)?;
    let limit = Duration::from_secs(options.seconds);
    let mut measure = |name: &str, sessions: u32, rate: Option<f64>| -> Outcome<f64> {
        // On a machine that others use too, before and after may differ much.
        let mut work = || -> Outcome<(f64, f64)> {
            let one = one.seconds_a_frame(options.frames / 8)?;
            match sessions {
                1 => Ok((one, one)),
                _ => Ok((one, several.seconds_a_frame(options.frames / 8)?)),
            }
        };
        let before = work()?;
        let used = cpu_seconds(server.pid())?;
        let done = runtime.block_on(driver.run(sessions, options.frames, rate, limit))?;
        let cpu = (cpu_seconds(server.pid())? - used) / done.frames as f64;
        let after = work()?;
        println!(
            "{name}: {} frames, {:.0} a second",
            done.frames, done.per_second
        );
        println!("    server {:.0} µs of processor time a frame", cpu * 1e6);
        let ratio = |what: &str, before: f64, after: f64| {
            println!(
                "    = {:.2} × (decode + step) of {what}, which took {:.0} before and {:.0} after",
                cpu / (before + after) * 2.0,
                before * 1e6,
                after * 1e6
            );
        };
        ratio("one session over and over", before.0, after.0);
        if sessions > 1 {
            ratio("as many sessions in turns", before.1, after.1);
        }
        let quantile = |q| done.latencies.value_at_quantile(q) as f64 / 1e3;
        println!(
            "    latency p50 {:.1} ms, p99 {:.1} ms, p99.9 {:.1} ms, most {:.1} ms",
            quantile(0.5),
            quantile(0.99),
            quantile(0.999),
            done.latencies.max() as f64 / 1e3
        );
        Ok(done.per_second)
    };
    let one = measure("1 session, closed loop", 1, None)?;
    let name = format!("{} sessions, closed loop", options.sessions);
    let many = measure(&name, options.sessions, None)?;
    println!("    throughput {:.2} × that of 1 session", many / one);
    let rate = options.rate.unwrap_or(many / 2.0);
    let name = format!(
        "{} sessions, open loop, {rate:.0} due a second",
        options.sessions
    );
    measure(&name, options.sessions, Some(rate))?;
    println!("server: {} MiB resident", server.resident()? >> 20);
    Ok(())
}

/// The work of a frame without a service.
struct InProcess {
    pictures: Vec<Vec<u8>>,
    trackers: Vec<Tracker>,
    done: usize,
}

impl InProcess {
    fn new(pictures: Vec<Vec<u8>>, target: Rect, preset: Preset, sessions: u32) -> Outcome<Self> {
        let first = ingest::decode(&pictures[0], &Limits::default())?;
        let tracker = Tracker::new(&first, target, preset.params())?;
        let mut work = Self {
            trackers: vec![tracker; sessions as usize],
            pictures,
            done: 0,
        };
        work.run(100 * sessions)?;
        Ok(work)
    }

    /// The next picture for each session in turn.
    fn run(&mut self, frames: u32) -> Outcome<()> {
        for _ in 0..frames {
            let sessions = self.trackers.len();
            let picture = &self.pictures[(self.done / sessions + 1) % self.pictures.len()];
            let frame = ingest::decode(picture, &Limits::default())?;
            self.trackers[self.done % sessions].step(&frame)?;
            ingest::recycle(frame);
            self.done += 1;
        }
        Ok(())
    }

    /// Seconds of processor time to decode and track a frame.
    fn seconds_a_frame(&mut self, frames: u32) -> Outcome<f64> {
        let before = cpu_seconds(std::process::id())?;
        self.run(frames)?;
        Ok((cpu_seconds(std::process::id())? - before) / f64::from(frames))
    }
}
