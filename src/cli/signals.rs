//! The signals that `serve` listens to: SIGTERM and SIGINT end it, SIGHUP reads keys and the certificate again.

#[cfg(all(unix, feature = "tls"))]
use bagtrack::http::CertificateError;
#[cfg(all(unix, feature = "jwt"))]
use bagtrack::http::JwtError;
use bagtrack::http::{ApiKeys, Application, Shutdown};
use std::io;
#[cfg(unix)]
use std::sync::Arc;
use tokio::sync::watch;

/// The signals to end that have come so far. Clones share them.
#[derive(Clone)]
pub struct Signals(watch::Receiver<Vec<Shutdown>>);

impl Signals {
    /// Begins to listen.
    ///
    /// # Errors
    /// The system refuses to register the signal.
    pub fn listen() -> io::Result<Self> {
        let (came, seen) = watch::channel(Vec::new());
        let mut source = Source::new()?;
        tokio::spawn(async move {
            while let Some(how) = source.next().await {
                came.send_modify(|signals| signals.push(how));
            }
        });
        Ok(Self(seen))
    }

    /// Waits for the first signal to end.
    pub async fn shutdown(&mut self) -> Shutdown {
        self.nth(0).await
    }

    /// Waits for the second signal to end.
    pub async fn second_shutdown(&mut self) {
        self.nth(1).await;
    }

    async fn nth(&mut self, index: usize) -> Shutdown {
        match self.0.wait_for(|signals| signals.len() > index).await {
            Ok(signals) => signals[index],
            // The task that listens has ended, so no signal can come any more.
            Err(_) => std::future::pending().await,
        }
    }
}

/// The keys and the certificate, which are read again on a SIGHUP.
#[derive(Clone)]
pub struct Reloaded {
    keys: ApiKeys,
    #[cfg(all(unix, feature = "jwt"))]
    issuer_keys: Option<Arc<dyn Fn() -> Result<usize, JwtError> + Send + Sync>>,
    #[cfg(all(unix, feature = "tls"))]
    certificate: Option<Arc<dyn Fn() -> Result<(), CertificateError> + Send + Sync>>,
}

impl Reloaded {
    pub fn of(application: &Application) -> Self {
        Self {
            keys: application.api_keys(),
            #[cfg(all(unix, feature = "jwt"))]
            issuer_keys: application.issuer_keys().map(|read| Arc::new(read) as _),
            #[cfg(all(unix, feature = "tls"))]
            certificate: application.certificate().map(|read| Arc::new(read) as _),
        }
    }

    /// Reads all of them again. One that cannot be read stays as it was.
    #[cfg(unix)]
    fn reload(&self) {
        match self.keys.reload() {
            Ok(count) => tracing::info!(count, "API keys read again"),
            Err(error) => tracing::error!(%error, "the API keys stay as they were"),
        }
        #[cfg(feature = "jwt")]
        if let Some(read) = &self.issuer_keys {
            match read() {
                Ok(count) => tracing::info!(count, "keys of the issuer read again"),
                Err(error) => tracing::error!(%error, "the issuer's keys stay as they were"),
            }
        }
        #[cfg(feature = "tls")]
        if let Some(read) = &self.certificate {
            match read() {
                Ok(()) => tracing::info!("certificate read again"),
                Err(error) => tracing::error!(%error, "the certificate stays as it was"),
            }
        }
    }
}

/// Receives SIGHUPs. Before [`Hangups::listen`], a SIGHUP ends the process.
#[cfg(unix)]
pub struct Hangups(tokio::signal::unix::Signal);

#[cfg(unix)]
impl Hangups {
    /// Begins to listen.
    ///
    /// # Errors
    /// The system refuses to register the signal.
    pub fn listen() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        signal(SignalKind::hangup()).map(Self)
    }
}

/// Makes a write above the limit of a file's size (`ulimit -f`) fail, instead of ending the process.
///
/// # Errors
/// The system refuses to register the signal.
#[cfg(unix)]
pub fn outlive_file_limit() -> io::Result<()> {
    let seen = Arc::default();
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, seen).map(drop)
}

/// Other systems have no such limit.
#[cfg(not(unix))]
pub fn outlive_file_limit() -> io::Result<()> {
    Ok(())
}

/// Reads keys and certificate again on every SIGHUP.
#[cfg(unix)]
pub async fn reload(mut hangups: Hangups, reloaded: Reloaded) {
    while hangups.0.recv().await.is_some() {
        let reloaded = reloaded.clone();
        // The files may be on a slow file system.
        if let Err(error) = tokio::task::spawn_blocking(move || reloaded.reload()).await {
            tracing::error!(%error, "keys and certificate stay as they were");
        }
    }
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub struct Hangups;

#[cfg(not(unix))]
impl Hangups {
    pub fn listen() -> io::Result<Self> {
        Ok(Self)
    }
}

#[cfg(not(unix))]
pub async fn reload(_hangups: Hangups, _reloaded: Reloaded) {}

#[cfg(unix)]
struct Source {
    terminate: tokio::signal::unix::Signal,
    interrupt: tokio::signal::unix::Signal,
}

#[cfg(unix)]
impl Source {
    fn new() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
        })
    }

    async fn next(&mut self) -> Option<Shutdown> {
        tokio::select! {
            came = self.terminate.recv() => came.map(|()| Shutdown::Gradual),
            came = self.interrupt.recv() => came.map(|()| Shutdown::Prompt),
        }
    }
}

#[cfg(not(unix))]
struct Source;

#[cfg(not(unix))]
impl Source {
    fn new() -> io::Result<Self> {
        Ok(Self)
    }

    async fn next(&mut self) -> Option<Shutdown> {
        match tokio::signal::ctrl_c().await {
            Ok(()) => Some(Shutdown::Prompt),
            Err(error) => {
                tracing::error!(%error, "cannot wait for ctrl-c; end the process by other means");
                None
            }
        }
    }
}
