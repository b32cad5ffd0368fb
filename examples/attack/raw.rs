//! A raw connection, which sends arbitrary bytes.

use crate::Outcome;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{Instant, sleep, timeout, timeout_at};

/// Sends `bytes` and returns the open connection.
pub async fn send(address: SocketAddr, bytes: impl AsRef<[u8]>) -> Outcome<TcpStream> {
    let mut stream = TcpStream::connect(address).await?;
    stream.write_all(bytes.as_ref()).await?;
    Ok(stream)
}

/// The bytes that come until the connection ends, or nothing comes for `patience`.
pub async fn read(stream: &mut TcpStream, patience: Duration) -> String {
    let mut bytes = Vec::new();
    while let Ok(Ok(1..)) = timeout(patience, stream.read_buf(&mut bytes)).await {}
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Holds the connection as long as the service does, and reads nothing. It sends more of what it has begun, which fails
/// when the service has closed the connection.
pub async fn hold(mut stream: TcpStream, until: Instant) {
    let hold = async {
        loop {
            sleep(Duration::from_millis(500)).await;
            if stream.write_all(b" ").await.is_err() {
                return;
            }
        }
    };
    let _ = timeout_at(until, hold).await;
}
