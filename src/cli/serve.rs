//! `bagtrack serve`: the HTTP service until SIGTERM or SIGINT.
//!
//! The exit status is 0 when all open requests have ended in time, and 1 when some were cut off, or when a second
//! signal ended the service at once.

use super::address::Addresses;
use super::confined;
use super::log::{Log, LogFormat};
use super::memory_limit;
use super::open_files;
use super::signals::{self, Hangups, Reloaded, Signals};
use super::variables;
use bagtrack::http::{Application, BasePath, Config, MemoryBound};
use bagtrack_config::OFF;
use bagtrack_ingest::video::Launcher;
use std::error::Error;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Flags of `serve`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: Config,
    /// What to log: a level, or levels by module.
    #[arg(
        long,
        env = "BAGTRACK_LOG",
        default_value = "info",
        help_heading = "Logging"
    )]
    log: String,
    /// How to log.
    #[arg(long, env = "BAGTRACK_LOG_FORMAT", value_enum, default_value_t = LogFormat::Text, help_heading = "Logging")]
    log_format: LogFormat,
}

pub fn run(args: Args) -> Result<(), Box<dyn Error>> {
    own_new_files();
    let log = Log::start(&args.log, args.log_format)?;
    variables::check(&super::command());
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(args.config.network_threads())
        .enable_all()
        .build()?;
    let result = runtime.block_on(serve(args.config, &log));
    // Work that does not end in time does not delay the exit: its threads end with the process.
    runtime.shutdown_background();
    result
}

/// Files that the process makes are for its own user alone: states of sessions contain parts of the pictures, and other
/// users may be able to read the folder of a store.
#[cfg(unix)]
fn own_new_files() {
    use rustix::fs::Mode;
    use rustix::process::umask;
    let others = Mode::RWXG | Mode::RWXO;
    let before = umask(others);
    umask(before | others);
}

#[cfg(not(unix))]
fn own_new_files() {}

async fn serve(mut config: Config, log: &Log) -> Result<(), Box<dyn Error>> {
    open_files::fit(&mut config);
    confine_decoders(&mut config);
    signals::outlive_file_limit()?;
    let bound = MemoryBound::of(&config);
    if config.store.lacks_store() {
        tracing::warn!(
            "there are settings of a store, and no --store: sessions end with this process"
        );
    }
    let (no_auth, listen) = (config.access.no_auth, config.listen);
    let (base_path, ffmpeg) = (config.base_path.clone(), config.limits.ffmpeg.clone());
    // The start may wait for a store. A SIGHUP that comes meanwhile must not end the process.
    let hangups = Hangups::listen()?;
    let application = Application::bind(config).await?;
    let reloaded = Reloaded::of(&application);
    let mut signals = Signals::listen()?;
    let (mut first, again) = (signals.clone(), &mut signals);
    if no_auth && !listen.ip().is_loopback() {
        tracing::warn!("everybody who reaches this address may use the service (--no-auth)");
    }
    let (scheme, address) = (application.scheme(), application.local_addr()?);
    tracing::info!("listening on {scheme}://{address}");
    let mib = |bytes: u64| bytes >> 20;
    tracing::info!(
        uploads = mib(bound.uploads),
        work = mib(bound.work),
        sessions = mib(bound.sessions),
        connections = mib(bound.connections),
        store = mib(bound.store),
        videos = mib(bound.videos),
        "resident memory stays below {} MiB",
        mib(bound.total())
    );
    memory_limit::check(bound.total());
    tokio::task::spawn_blocking(move || check_ffmpeg(&ffmpeg));
    tell_addresses(scheme, address, &base_path);
    let reports = tokio::spawn(log.dropped().report_regularly());
    let reloads = tokio::spawn(signals::reload(hangups, reloaded));
    let ended = tokio::select! {
        ended = application.serve(first.shutdown()) => ended,
        () = again.second_shutdown() => {
            tracing::warn!("a second signal: ending at once");
            false
        }
    };
    reports.abort();
    reloads.abort();
    log.dropped().report();
    tracing::info!(ended, "bye");
    match ended {
        true => Ok(()),
        false => Err("requests were cut off".into()),
    }
}

/// Warns where videos will be refused, since ffmpeg cannot be started.
fn check_ffmpeg(program: &str) {
    if program == OFF {
        return;
    }
    let mut version = Command::new(program);
    let version = version.arg("-version").stdin(Stdio::null()).output();
    match version {
        Err(error) => {
            tracing::warn!(%error, "videos are refused, for want of {program} (--ffmpeg)")
        }
        Ok(said) if !said.stdout.starts_with(b"ffmpeg ") => {
            tracing::warn!(
                "videos are refused: {program} (--ffmpeg) is no ffmpeg, by what it says of its version"
            );
        }
        Ok(_) => {}
    }
}

/// Lets ffmpeg be started through this program, which gives up rights first.
fn confine_decoders(config: &mut Config) {
    let hides_files = confined::works();
    match own_program() {
        Ok(program) => {
            let words = vec![program.into(), confined::NAME.into()];
            config.limits.ffmpeg_launcher = Launcher { words, hides_files };
        }
        Err(error) => tracing::warn!(%error, "ffmpeg has the rights of the service"),
    }
    if !hides_files {
        tracing::warn!(
            "Landlock or seccomp is not to be had here: ffmpeg has more rights than it needs"
        );
    }
}

/// The file of this running program, even where an upgrade has replaced it on the disk.
fn own_program() -> io::Result<PathBuf> {
    let running = PathBuf::from("/proc/self/exe");
    match running.exists() {
        true => Ok(running),
        false => std::env::current_exe(),
    }
}

/// Logs what to open in a browser.
fn tell_addresses(scheme: &str, listen: SocketAddr, base_path: &BasePath) {
    let Addresses { here, elsewhere } = Addresses::of(scheme, listen, base_path);
    if let Some(url) = elsewhere {
        tracing::info!("on other machines, open {url}");
        if scheme == "http" {
            tracing::info!(
                "a phone's browser gives its camera to https only: see --tls-cert and docs/HTTPS.md"
            );
        }
    }
    if let Some(url) = here {
        tracing::info!("open {url} in a browser");
    }
}
