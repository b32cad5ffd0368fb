//! A client of a session's stream at one of several replicas.

use futures_util::{SinkExt, StreamExt};
use serde_json::Value;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async};
use uuid::Uuid;

/// Longer than any test waits for something that does happen.
const PATIENCE: Duration = Duration::from_secs(60);

pub struct StreamClient {
    socket: WebSocketStream<TcpStream>,
    /// The number of the next frame, as the service told.
    pub next: u64,
}

impl StreamClient {
    /// Opens the stream of a session, as soon as the service has the time for it. `query` may be empty.
    pub async fn open(address: SocketAddr, session: Uuid, query: &str) -> Self {
        let url = format!("ws://{address}/sessions/{session}/stream{query}");
        let socket = loop {
            let line = TcpStream::connect(address).await.expect("it listens");
            match client_async(&url, line).await {
                Ok((socket, _)) => break socket,
                Err(Error::Http(answer)) if answer.status() == 503 => {}
                Err(error) => panic!("{error}"),
            }
        };
        let mut client = Self { socket, next: 0 };
        client.next = client.message().await["next"].as_u64().expect("a number");
        client
    }

    /// Sends a frame.
    pub async fn send(&mut self, frame: &[u8]) {
        let message = Message::binary(frame.to_vec());
        self.socket.send(message).await.expect("the stream is open");
    }

    /// The next message, or the code that the stream is closed with.
    pub async fn receive(&mut self) -> Result<Value, u16> {
        loop {
            let next = timeout(PATIENCE, self.socket.next()).await;
            match next.expect("something comes") {
                Some(Ok(Message::Text(text))) => return Ok(serde_json::from_str(&text).unwrap()),
                Some(Ok(Message::Close(frame))) => {
                    return Err(frame.map_or(1005, |frame| frame.code.into()));
                }
                Some(Ok(_)) => {}
                other => panic!("{other:?} in place of a message"),
            }
        }
    }

    /// The next message.
    pub async fn message(&mut self) -> Value {
        let received = self.receive().await;
        received.unwrap_or_else(|code| panic!("closed with {code}"))
    }

    /// The answer to a frame that is sent now.
    pub async fn track(&mut self, frame: &[u8]) -> Value {
        self.send(frame).await;
        self.message().await
    }
}
