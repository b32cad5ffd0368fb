//! `bagtrack serve`: the HTTP service until SIGTERM or SIGINT.

use super::log::{Log, LogFormat};
use super::open_files;
use bagtrack::http::{Application, Config, MemoryBound};
use std::error::Error;

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

/// Runs `serve`.
pub fn run(args: Args) -> Result<(), Box<dyn Error>> {
    let log = Log::start(&args.log, args.log_format)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(args.config.network_threads())
        .enable_all()
        .build()?;
    // Work that does not end in time does not delay the exit: its threads end with the process.
    runtime.block_on(serve(args.config, &log))
}

async fn serve(mut config: Config, log: &Log) -> Result<(), Box<dyn Error>> {
    open_files::fit(&mut config);
    let bound = MemoryBound::of(&config);
    let application = Application::bind(config).await?;
    let shutdown = shutdown_signal()?;
    tracing::info!("listening on http://{}", application.local_addr()?);
    let mib = |bytes: u64| bytes >> 20;
    tracing::info!(
        uploads = mib(bound.uploads),
        work = mib(bound.work),
        sessions = mib(bound.sessions),
        connections = mib(bound.connections),
        "resident memory stays below {} MiB",
        mib(bound.total())
    );
    let reports = tokio::spawn(log.dropped().report_regularly());
    let ended = application.serve(shutdown).await;
    reports.abort();
    log.dropped().report();
    tracing::info!(ended, "bye");
    Ok(())
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
