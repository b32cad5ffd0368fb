//! A client of a session's stream.

use crate::within::within;
use futures_util::{SinkExt, StreamExt};
use serde_json::Value;
use std::fmt::Display;
use std::net::SocketAddr;
use tokio::net::TcpStream;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::Response;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;
use tokio_tungstenite::tungstenite::{Error, Message};

pub struct StreamClient {
    socket: WebSocketStream<TcpStream>,
    /// The number of the next frame, which the service sent at the opening.
    pub next: u64,
}

/// A message from the service, or the close of the stream.
#[derive(Debug, PartialEq)]
pub enum Received {
    Message(Value),
    Closed(u16),
    Broken,
}

impl StreamClient {
    /// Opens the stream of a session at `address`.
    pub async fn try_open(
        address: SocketAddr,
        id: impl Display,
        query: &str,
        headers: &[(&'static str, &str)],
    ) -> Result<Self, Response<Option<Vec<u8>>>> {
        let url = format!("ws://{address}/sessions/{id}/stream{query}");
        let mut request = url.into_client_request().unwrap();
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().unwrap());
        }
        let stream = TcpStream::connect(address).await.unwrap();
        stream.set_nodelay(true).unwrap();
        let socket = match client_async(request, stream).await {
            Ok((socket, _)) => socket,
            Err(Error::Http(response)) => return Err(*response),
            Err(error) => panic!("{error}"),
        };
        let mut client = Self { socket, next: 0 };
        let hello = client.message().await;
        client.next = hello["next"].as_u64().unwrap();
        Ok(client)
    }

    pub async fn open(address: SocketAddr, id: impl Display, query: &str) -> Self {
        let opened = Self::try_open(address, id, query, &[]).await;
        opened.unwrap_or_else(|response| panic!("{response:?}"))
    }

    /// Opens the stream, and tries again while the service is too busy.
    pub async fn open_in_time(address: SocketAddr, id: impl Display, query: &str) -> Self {
        loop {
            match Self::try_open(address, &id, query, &[]).await {
                Ok(client) => return client,
                Err(response) if response.status() == 503 => {}
                Err(response) => panic!("{response:?}"),
            }
        }
    }

    pub async fn send(&mut self, frame: impl AsRef<[u8]>) {
        let message = Message::binary(frame.as_ref().to_vec());
        self.socket.send(message).await.expect("the stream is open");
    }

    /// Sends a frame, and returns its answer.
    pub async fn track(&mut self, frame: impl AsRef<[u8]>) -> Value {
        self.send(frame).await;
        self.message().await
    }

    pub async fn say(&mut self, text: impl Into<String>) {
        let text: String = text.into();
        self.socket
            .send(Message::text(text))
            .await
            .expect("the stream is open");
    }

    /// Sends raw bytes, without WebSocket framing.
    pub async fn send_raw(&mut self, bytes: &[u8]) {
        use tokio::io::AsyncWriteExt;
        let stream = self.socket.get_mut();
        stream.write_all(bytes).await.expect("the stream is open");
    }

    /// The next message or close. Answers pings meanwhile.
    pub async fn receive(&mut self) -> Received {
        loop {
            match within(self.socket.next(), "something comes").await {
                Some(Ok(Message::Text(text))) => {
                    return Received::Message(serde_json::from_str(&text).unwrap());
                }
                Some(Ok(Message::Close(frame))) => {
                    return Received::Closed(frame.map_or(1005, |frame| frame.code.into()));
                }
                Some(Ok(_)) => {}
                Some(Err(_)) | None => return Received::Broken,
            }
        }
    }

    pub async fn message(&mut self) -> Value {
        match self.receive().await {
            Received::Message(message) => message,
            other => panic!("{other:?} in place of a message"),
        }
    }

    /// Reads without answering pings. Returns the bytes that came.
    pub async fn ignore_pings(self) -> Vec<u8> {
        use tokio::io::AsyncReadExt;
        let mut stream = self.socket.into_inner();
        let mut bytes = Vec::new();
        let end = stream.read_to_end(&mut bytes);
        let _ = within(end, "the service closes the connection").await;
        bytes
    }

    /// The close code of the stream, which must be the next thing to come.
    pub async fn close_code(&mut self) -> u16 {
        match self.receive().await {
            Received::Closed(code) => code,
            other => panic!("{other:?} in place of a close"),
        }
    }

    /// Closes the stream by the closing handshake (RFC 6455, section 7.1.2), before the connection ends.
    pub async fn close(mut self) {
        let normal = CloseFrame {
            code: CloseCode::Normal,
            reason: "".into(),
        };
        self.socket.close(Some(normal)).await.unwrap();
        assert_eq!(self.close_code().await, 1000);
        let rest = within(self.socket.next(), "the line ends").await;
        assert!(rest.is_none(), "{rest:?}");
    }
}
