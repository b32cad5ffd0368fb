//! A connection between a client and the service that delays all bytes, and can be broken.

use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, sleep_until};

pub struct SlowLine {
    pub address: SocketAddr,
    broken: watch::Sender<u64>,
}

impl SlowLine {
    /// A line to the service at `target`, which delays bytes by `delay` each way.
    pub async fn to(target: SocketAddr, delay: Duration) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (broken, watched) = watch::channel(0);
        tokio::spawn(async move {
            while let Ok((client, _)) = listener.accept().await {
                let service = TcpStream::connect(target).await.unwrap();
                for stream in [&client, &service] {
                    stream.set_nodelay(true).unwrap();
                }
                let (from_client, to_client) = client.into_split();
                let (from_service, to_service) = service.into_split();
                let mut watched = watched.clone();
                tokio::spawn(async move {
                    tokio::select! {
                        () = carry(from_client, to_service, delay) => {}
                        () = carry(from_service, to_client, delay) => {}
                        _ = watched.changed() => {}
                    }
                });
            }
        });
        Self { address, broken }
    }

    /// Breaks all present connections. Clients can make new ones.
    pub fn cut(&self) {
        self.broken.send_modify(|count| *count += 1);
    }
}

async fn carry(mut from: OwnedReadHalf, mut to: OwnedWriteHalf, delay: Duration) {
    let (sent, mut arriving) = mpsc::channel::<(Instant, Vec<u8>)>(4096);
    let read = async move {
        let mut buffer = vec![0; 64 << 10];
        while let Ok(count @ 1..) = from.read(&mut buffer).await {
            let arrives = Instant::now() + delay;
            if sent
                .send((arrives, buffer[..count].to_vec()))
                .await
                .is_err()
            {
                return;
            }
        }
    };
    let write = async move {
        while let Some((arrives, bytes)) = arriving.recv().await {
            sleep_until(arrives).await;
            if to.write_all(&bytes).await.is_err() {
                return;
            }
        }
    };
    tokio::join!(read, write);
}
