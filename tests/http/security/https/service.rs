//! The service in this process, with a certificate or without.

use super::certificates::Files;
use bagtrack::http::{Application, Config, TlsConfig};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

pub struct Service {
    pub address: SocketAddr,
    stop: oneshot::Sender<()>,
    served: JoinHandle<bool>,
}

impl Service {
    pub async fn start(files: Option<&Files>, change: impl FnOnce(&mut Config)) -> Self {
        let mut config = Config {
            listen: "127.0.0.1:0".parse().unwrap(),
            workers: Some(2),
            shutdown_delay: Duration::ZERO,
            ..Config::default()
        };
        if let Some(files) = files {
            config.tls = TlsConfig {
                tls_cert: Some(files.certificate()),
                tls_key: Some(files.key()),
            };
        }
        change(&mut config);
        let application = Application::bind(config).await.expect("a free port");
        let expected = if files.is_some() { "https" } else { "http" };
        assert_eq!(application.scheme(), expected);
        let (stop, stopped) = oneshot::channel::<()>();
        Self {
            address: application.local_addr().unwrap(),
            stop,
            served: tokio::spawn(application.serve(async {
                let _ = stopped.await;
            })),
        }
    }

    /// Asks it to end; gives whether all requests ended in time.
    pub async fn end(self) -> bool {
        self.stop.send(()).unwrap();
        self.served.await.unwrap()
    }
}
