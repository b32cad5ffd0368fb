//! A TCP proxy that cuts connections, each after some random number of bytes.

use rand::RngExt;
use std::net::SocketAddr;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

/// The proxy; it ends when this is dropped.
pub struct Lossy {
    pub address: SocketAddr,
    pub cuts: Arc<AtomicUsize>,
    accepting: JoinHandle<()>,
}

impl Lossy {
    /// A proxy before these servers, which get connections in turns. Each is cut after a random number of `bytes`.
    pub async fn before(servers: Vec<SocketAddr>, bytes: Range<usize>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("it is bound");
        let cuts = Arc::new(AtomicUsize::new(0));
        let counted = cuts.clone();
        let accepting = tokio::spawn(async move {
            let mut turn = 0;
            while let Ok((client, _)) = listener.accept().await {
                turn += 1;
                let server = servers[turn % servers.len()];
                let left = rand::rng().random_range(bytes.clone());
                let counted = counted.clone();
                tokio::spawn(async move {
                    if pass(client, server, left).await {
                        counted.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
        });
        Self {
            address,
            cuts,
            accepting,
        }
    }
}

impl Drop for Lossy {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

/// Passes on up to `bytes` bytes of both directions together. Returns whether it then cut the connection.
async fn pass(client: TcpStream, server: SocketAddr, bytes: usize) -> bool {
    let Ok(server) = TcpStream::connect(server).await else {
        return false;
    };
    let (from_client, to_client) = client.into_split();
    let (from_server, to_server) = server.into_split();
    let left = Arc::new(AtomicUsize::new(bytes));
    let up = copy(from_client, to_server, left.clone());
    let down = copy(from_server, to_client, left.clone());
    tokio::select! {
        () = up => {}
        () = down => {}
    }
    left.load(Ordering::Relaxed) == 0
}

async fn copy(
    mut from: impl AsyncRead + Unpin,
    mut to: impl AsyncWrite + Unpin,
    left: Arc<AtomicUsize>,
) {
    let mut buffer = vec![0; 16 << 10];
    while let Ok(count @ 1..) = from.read(&mut buffer).await {
        let before = left.load(Ordering::Relaxed);
        let passed = count.min(before);
        left.fetch_sub(passed, Ordering::Relaxed);
        // Passes on a part of the bytes, so that the other side gets an incomplete message.
        if to.write_all(&buffer[..passed]).await.is_err() || passed < count || passed == before {
            return;
        }
    }
}
