//! `bagtrack serve`: the HTTP service until SIGTERM or SIGINT.

use super::log::Log;
use bagtrack::http::{Application, Config};
use std::error::Error;
use std::io::IsTerminal;
use tracing_subscriber::EnvFilter;

/// Flags of `serve`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    config: Config,
    /// What to log: a level, or levels by module.
    #[arg(long, env = "BAGTRACK_LOG", default_value = "info")]
    log: String,
    /// How to log.
    #[arg(long, env = "BAGTRACK_LOG_FORMAT", value_enum, default_value_t = LogFormat::Text)]
    log_format: LogFormat,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum LogFormat {
    /// One readable line an event.
    Text,
    /// One JSON object a line.
    Json,
}

/// Runs `serve`.
pub fn run(args: Args) -> Result<(), Box<dyn Error>> {
    let log = start_log(&args.log, args.log_format)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(args.config.network_threads())
        .on_thread_park(bagtrack::sessions::rested)
        .enable_all()
        .build()?;
    // Work that did not end in time does not hold up the exit: its threads end with the process.
    let served = runtime.block_on(serve(args.config));
    log.flush();
    served
}

async fn serve(config: Config) -> Result<(), Box<dyn Error>> {
    let application = Application::bind(config).await?;
    let shutdown = shutdown_signal()?;
    tracing::info!("listening on http://{}", application.local_addr()?);
    let ended = application.serve(shutdown).await;
    tracing::info!(ended, "bye");
    Ok(())
}

fn start_log(filter: &str, format: LogFormat) -> Result<Log, Box<dyn Error>> {
    let filter = EnvFilter::try_new(filter)
        .map_err(|error| format!("--log (BAGTRACK_LOG) cannot be read: {error}"))?;
    let lines = Log::start()?;
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(lines.clone());
    match format {
        LogFormat::Text => log.init(),
        LogFormat::Json => log.json().init(),
    }
    Ok(lines)
}

#[cfg(unix)]
fn shutdown_signal() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    Ok(async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    })
}

#[cfg(not(unix))]
fn shutdown_signal() -> std::io::Result<impl Future<Output = ()>> {
    Ok(async {
        if let Err(error) = tokio::signal::ctrl_c().await {
            tracing::error!(%error, "cannot wait for ctrl-c; end the process by other means");
            std::future::pending::<()>().await;
        }
    })
}
