//! Attacks on the service: `cargo build --release && cargo run --release --example attack -- --short`.
//!
//! Here are the attacks that need the program itself: its memory, and what good clients notice that send 25 frames a
//! second. The others are tests of `tests/http`. Each attack runs against a server of its own. It gets through when a
//! good client loses a frame, when the service answers what it should refuse, or when it takes more memory than it said
//! at its start. Then this program ends with status 1.
//!
//! The server believes `X-Forwarded-For` from this machine, so that attackers and good clients have addresses of their
//! own. `--url` attacks a server that runs already; give it `--trusted-proxies 127.0.0.0/8`. Its memory is not
//! measured.
//!
//! Linux only: memory is read from `/proc`.

mod costly_sessions;
mod decode_bombs;
mod good;
mod greedy_client;
mod idle_streams;
mod json_copies;
mod random_clients;
mod raw;
mod target;

use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use target::Target;

type Outcome<T> = Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// What an attack came to: what was seen, and what got through.
#[derive(Debug, Default)]
pub struct Verdict {
    seen: String,
    got_through: Option<String>,
}

impl Verdict {
    /// Held, where `holds`; otherwise `seen` is what got through.
    pub fn new(holds: bool, seen: impl Into<String>) -> Self {
        let seen = seen.into();
        let got_through = (!holds).then(|| seen.clone());
        Self { seen, got_through }
    }
}

/// What to attack, and for how long.
#[derive(Debug, Parser)]
pub struct Options {
    /// Each attack for some seconds, with shorter time limits of the server.
    #[arg(long)]
    short: bool,
    /// Only the attacks whose names contain this.
    #[arg(long)]
    only: Option<String>,
    /// Seconds of the random clients.
    #[arg(long, default_value_t = 120)]
    seconds: u64,
    /// What the random clients do.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Attack this server instead of one of its own.
    #[arg(long)]
    url: Option<String>,
    /// The server's binary; otherwise `bagtrack` beside this program's folder.
    #[arg(long)]
    server: Option<PathBuf>,
    /// The random clients alone, against `--url`, without good clients.
    #[arg(long, requires = "url")]
    attackers_only: bool,
}

impl Options {
    /// How long an attack goes on.
    pub fn duration(&self) -> Duration {
        Duration::from_secs(if self.short { 2 } else { 10 })
    }
}

#[tokio::main(worker_threads = 2)]
async fn main() -> ExitCode {
    let options = Options::parse();
    if options.attackers_only {
        return match attackers_only(&options).await {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("the attackers: {error}");
                ExitCode::FAILURE
            }
        };
    }
    let mut failed = 0;
    macro_rules! attack {
        ($($name:ident),*) => {$(
            let name = stringify!($name);
            let wanted = match &options.only {
                Some(only) => name.contains(only.as_str()),
                None => true,
            };
            if wanted {
                let begun = Instant::now();
                let settings = match name {
                    "random_clients" => random_clients::SETTINGS,
                    _ => &[],
                };
                let verdict = match Target::start(&options, settings).await {
                    Ok(target) => $name::attack(&target, &options).await,
                    Err(error) => Err(error),
                };
                failed += report(name, begun, verdict);
            }
        )*};
    }
    attack!(
        decode_bombs,
        costly_sessions,
        idle_streams,
        greedy_client,
        json_copies,
        random_clients
    );
    match failed {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

async fn attackers_only(options: &Options) -> Outcome<()> {
    let target = Target::start(options, random_clients::SETTINGS).await?;
    random_clients::attackers(&target, options).await
}

fn report(name: &str, begun: Instant, verdict: Outcome<Verdict>) -> u32 {
    let seconds = begun.elapsed().as_secs_f64();
    let (word, text, failed) = match verdict {
        Ok(Verdict {
            seen,
            got_through: None,
        }) => ("held", seen, 0),
        Ok(Verdict {
            got_through: Some(text),
            ..
        }) => ("GOT THROUGH", text, 1),
        Err(error) => ("FAILED", error.to_string(), 1),
    };
    println!("{name:<16} {word:<11} {seconds:5.1} s  {text}");
    failed
}
