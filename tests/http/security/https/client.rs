//! A client that writes HTTP by hand over TLS.

use bagtrack_testing::within::within;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore, crypto::ring};
use serde_json::Value;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;

/// A connector that trusts this root, and offers these protocols (ALPN).
pub fn trusting(root: &CertificateDer<'static>, protocols: &[&str]) -> TlsConnector {
    let mut roots = RootCertStore::empty();
    roots.add(root.clone()).unwrap();
    let provider = Arc::new(ring::default_provider());
    let mut config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    config.alpn_protocols = protocols.iter().map(|it| it.as_bytes().to_vec()).collect();
    TlsConnector::from(Arc::new(config))
}

/// A connection over which HTTP is spoken.
pub struct Client<S>(pub S);

/// An answer: its head, and its body.
pub struct Answer {
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn status(&self) -> &str {
        self.head.split(' ').nth(1).unwrap()
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        let mut lines = self.head.lines().filter_map(|line| line.split_once(": "));
        let line = lines.find(|(other, _)| other.eq_ignore_ascii_case(name));
        line.map(|(_, value)| value)
    }

    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }
}

impl Client<TlsStream<TcpStream>> {
    /// # Errors
    /// The handshake fails, or the connection.
    pub async fn try_open(connector: &TlsConnector, address: SocketAddr) -> io::Result<Self> {
        Self::over(TcpStream::connect(address).await?, connector).await
    }

    async fn over(stream: TcpStream, connector: &TlsConnector) -> io::Result<Self> {
        let name = ServerName::try_from("localhost").unwrap();
        let connected = within(connector.connect(name, stream), "the handshake ends");
        connected.await.map(Self)
    }

    /// Connects from another address of this machine.
    pub async fn open_from(from: IpAddr, connector: &TlsConnector, address: SocketAddr) -> Self {
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind(SocketAddr::new(from, 0)).unwrap();
        let stream = socket.connect(address).await.unwrap();
        Self::over(stream, connector).await.unwrap()
    }

    pub async fn open(connector: &TlsConnector, address: SocketAddr) -> Self {
        Self::try_open(connector, address).await.unwrap()
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> Client<S> {
    /// Sends a request and reads its answer, which must have a `Content-Length`.
    pub async fn call(&mut self, method: &str, target: &str, body: &[u8]) -> Answer {
        let head = format!(
            "{method} {target} HTTP/1.1\r\nHost: localhost:8443\r\nContent-Length: {}\r\n\r\n",
            body.len()
        );
        self.0.write_all(head.as_bytes()).await.unwrap();
        self.0.write_all(body).await.unwrap();
        self.0.flush().await.unwrap();
        within(self.answer(), "an answer").await
    }

    async fn answer(&mut self) -> Answer {
        let mut bytes = Vec::new();
        loop {
            let head = bytes.windows(4).position(|four| four == b"\r\n\r\n");
            if let Some(end) = head {
                let mut answer = Answer {
                    head: String::from_utf8(bytes[..end].to_vec()).unwrap(),
                    body: bytes[end + 4..].to_vec(),
                };
                let length = answer.header("content-length").map_or("0", |it| it);
                if answer.body.len() >= length.parse().unwrap() {
                    return answer;
                }
                answer.body.clear();
            }
            let read = self.0.read_buf(&mut bytes).await.unwrap();
            assert_ne!(read, 0, "it ended early: {bytes:?}");
        }
    }

    /// Waits until the service closes the connection.
    pub async fn ends(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        // A connection that is cut off counts as closed.
        let _ = within(self.0.read_to_end(&mut bytes), "the connection ends").await;
        bytes
    }
}
