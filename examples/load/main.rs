//! A load generator: `cargo build --release && cargo run --release --example load -- --help`.
//!
//! It starts a server of its own on a free loopback port and prints, from one run:
//! - the processor time of decoding and tracking a frame in this process, one thread: of one session over and over,
//!   all of whose data stays in the caches, and of as many sessions as are measured, in turns;
//! - what one session and what many can get through when each sends its next frame as soon as the last is answered;
//! - open loop: frames are due at fixed times, however late earlier answers are, and latency counts from when a
//!   frame was due, so a stall is not hidden by sending less (percentiles from an HDR histogram);
//! - the processor time of the server process for a frame against that of decoding and tracking. The speed of a
//!   shared machine varies, so a measurement has parts, and the two are measured in turns.
//!
//! With `--overload TIMES` more frames come than get done, and it prints what becomes of them. The server has a lower
//! priority then, as clients would have machines of their own.
//!
//! With `--churn SECONDS` sessions come and go, and it compares the server's memory at the end with that before. With
//! `--memory` it opens the sessions, fills their bags, and prints what memory the server has come to.
//!
//! Frames, sessions and time are bounded. Linux only: processor time is read from `/proc`.

mod churn;
mod drive;
mod in_process;
mod memory;
mod overload;
mod process;

use bagtrack_testing::bench_pictures as pictures;
use std::path::PathBuf;
use std::time::Duration;

use bagtrack_tracker::Preset;
use clap::Parser;
use drive::{Done, Driver};
use in_process::InProcess;
use process::Server;
use tokio::runtime::Runtime;

/// Parts of a measurement.
const PARTS: u32 = 10;

/// No server here gets through more in a second.
const MOST_FRAMES: f64 = 2_000.0;

type Outcome<T> = Result<T, Box<dyn std::error::Error + Send + Sync>>;

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
    /// Seconds for which sessions come and go at `--rate`; then compare the resident memory with that after ten
    /// minutes, and do nothing else.
    #[arg(long)]
    churn: Option<u64>,
    /// So many times the frames that `--sessions` sessions get through, from cameras of ten frames a second, for
    /// `--seconds` each; and nothing else.
    #[arg(long, value_delimiter = ',')]
    overload: Vec<f64>,
    /// The server's binary; otherwise `bagtrack` beside this program's folder.
    #[arg(long)]
    server: Option<PathBuf>,
}

impl Options {
    /// Sessions that the server must have room for, and its flags.
    fn room_and_flags<'a>(&self, idle: &'a str) -> (u32, Vec<&'a str>) {
        let overload = match self.overload.is_empty() {
            // Many sessions of one client wait for each other.
            true => ["--queue-delay", "0s"],
            false => ["--trusted-proxies", "127.0.0.1"],
        };
        let cameras = self
            .overload
            .iter()
            .map(|times| (times * MOST_FRAMES / 10.0) as u32);
        let room = cameras.fold(self.sessions, u32::max);
        (room, [&["--session-idle", idle], &overload[..]].concat())
    }
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

    // No session ends while others are still being opened, except where that is what is measured.
    let idle = if options.churn.is_some() { "1m" } else { "1d" };
    let (room, flags) = options.room_and_flags(idle);
    let server = Server::start(options.server.clone(), room, &flags)?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let driver = Driver::new(&server.url(), pictures.clone(), target, preset);
    if options.memory {
        return runtime.block_on(memory::print(&driver, &server, preset, options.sessions));
    }
    if !options.overload.is_empty() {
        server.lower_priority()?;
        let length = Duration::from_secs(options.seconds);
        let load = (options.sessions, options.frames, length);
        return runtime.block_on(overload::run(&driver, load, &options.overload));
    }
    if let Some(seconds) = options.churn {
        let rate = options.rate.unwrap_or(40.0);
        let length = Duration::from_secs(seconds);
        return runtime.block_on(churn::run(
            &driver,
            &server,
            (options.sessions, rate, length),
        ));
    }
    let mut load = Load {
        one: InProcess::new(pictures.clone(), target, preset, 1)?,
        several: InProcess::new(pictures, target, preset, options.sessions)?,
        runtime,
        driver,
        server,
        frames: options.frames,
        limit: Duration::from_secs(options.seconds) / PARTS,
    };
    let one = load.measure("1 session, closed loop", 1, None)?;
    let name = format!("{} sessions, closed loop", options.sessions);
    let many = load.measure(&name, options.sessions, None)?;
    println!("    throughput {:.2} × that of 1 session", many / one);
    let rate = options.rate.unwrap_or(many / 2.0);
    let name = format!(
        "{} sessions, open loop, {rate:.0} due a second",
        options.sessions
    );
    load.measure(&name, options.sessions, Some(rate))?;
    println!("server: {} MiB resident", load.server.resident()? >> 20);
    Ok(())
}

/// What is measured, and what with.
struct Load {
    one: InProcess,
    several: InProcess,
    runtime: Runtime,
    driver: Driver,
    server: Server,
    frames: u32,
    limit: Duration,
}

impl Load {
    /// Measures `sessions` sessions and prints the results; returns how many frames they get through in a second.
    fn measure(&mut self, name: &str, sessions: u32, rate: Option<f64>) -> Outcome<f64> {
        let mut done = Done::new()?;
        let (mut alone, mut in_turns) = (Vec::new(), Vec::new());
        let mut used = 0.0;
        let mut clients = self.runtime.block_on(self.driver.open(sessions))?;
        let frames = self.frames.div_ceil(PARTS);
        for _ in 0..PARTS {
            alone.push(self.one.seconds_a_frame(frames / 2)?);
            if sessions > 1 {
                in_turns.push(self.several.seconds_a_frame(frames / 2)?);
            }
            let before = self.server.cpu_seconds();
            let run = clients.run(frames, rate, self.limit, &mut done);
            self.runtime.block_on(run)?;
            used += self.server.cpu_seconds() - before;
        }
        self.runtime.block_on(clients.close())?;
        let sent = done.latencies.len();
        let cpu = used / sent as f64;
        println!("{name}: {sent} frames, {:.0} a second", done.per_second());
        println!("    server {:.0} µs of processor time a frame", cpu * 1e6);
        print_ratio(cpu, "one session over and over", &alone);
        if sessions > 1 {
            print_ratio(cpu, "as many sessions in turns", &in_turns);
        }
        let quantile = |q| done.latencies.value_at_quantile(q) as f64 / 1e3;
        println!(
            "    latency p50 {:.1} ms, p99 {:.1} ms, p99.9 {:.1} ms, most {:.1} ms",
            quantile(0.5),
            quantile(0.99),
            quantile(0.999),
            done.latencies.max() as f64 / 1e3
        );
        Ok(done.per_second())
    }
}

/// The server's time for a frame against that of decoding and tracking, which took `parts`.
fn print_ratio(cpu: f64, what: &str, parts: &[f64]) {
    let mean = parts.iter().sum::<f64>() / parts.len() as f64;
    let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
    let most = parts.iter().copied().fold(0.0, f64::max);
    println!(
        "    = {:.2} × (decode + step) of {what}, which took {:.0} (in parts {:.0} to {:.0})",
        cpu / mean,
        mean * 1e6,
        least * 1e6,
        most * 1e6
    );
}
