//! A service that gives the answers of a script, and keeps what it was asked.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;

/// What a request gets.
#[derive(Debug, Clone)]
pub enum Reply {
    /// A status, headers, and a body.
    Answer(u16, Vec<String>, String),
    /// The line breaks in the middle of the answer.
    Cut,
    /// Nothing.
    Silence,
}

impl Reply {
    pub fn new(status: u16, body: &str) -> Self {
        Self::Answer(status, Vec::new(), body.to_owned())
    }

    /// With this header in place of others of its name.
    pub fn with(self, header: &str) -> Self {
        let Self::Answer(status, mut headers, body) = self else {
            panic!("there is no header without an answer")
        };
        let name = header.split(':').next().unwrap();
        headers.retain(|other| !other.starts_with(name));
        headers.push(header.to_owned());
        Self::Answer(status, headers, body)
    }
}

const BOX: &str = r#"{"x": 1.0, "y": 2.0, "width": 30.5, "height": 40.0}"#;

/// The answer to what opens a session.
pub fn created(frame: u64) -> Reply {
    let body = format!(
        r#"{{"id": "00000000-0000-4000-8000-000000000000", "frame": {frame}, "box": {BOX},
            "image": {{"width": 320, "height": 240}}, "parameters": {{"seed": 7}},
            "expires_at": "2026-01-31T12:00:00Z"}}"#
    );
    Reply::new(201, &body)
}

/// The answer to a frame.
pub fn answer(frame: u64) -> Reply {
    let body = format!(r#"{{"frame": {frame}, "box": {BOX}, "score": 0.5, "status": "tracking"}}"#);
    Reply::new(200, &body)
}

/// A request as it came.
#[derive(Debug, Clone)]
pub struct Request {
    pub head: String,
    pub body: Vec<u8>,
}

impl Request {
    /// The value of a header; empty where there is none.
    pub fn header(&self, name: &str) -> &str {
        let mut lines = self.head.lines().filter_map(|line| line.split_once(": "));
        let found = lines.find(|(other, _)| other.eq_ignore_ascii_case(name));
        found.map_or("", |(_, value)| value)
    }
}

/// The service. Each request has a connection of its own.
pub struct Script {
    address: SocketAddr,
    requests: Arc<Mutex<Vec<Request>>>,
    silent: Arc<Notify>,
}

impl Script {
    pub async fn start<const N: usize>(replies: [Reply; N]) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let script = Self {
            address: listener.local_addr().unwrap(),
            requests: Arc::default(),
            silent: Arc::default(),
        };
        let (requests, silent) = (script.requests.clone(), script.silent.clone());
        tokio::spawn(async move {
            let mut held = Vec::new();
            for reply in replies {
                let (mut line, _) = listener.accept().await.unwrap();
                let request = read(&mut line).await;
                requests.lock().unwrap().push(request);
                match reply {
                    Reply::Answer(status, headers, body) => {
                        let length = body.len();
                        let headers: String =
                            headers.iter().map(|line| format!("{line}\r\n")).collect();
                        let fixed = format!("Connection: close\r\nContent-Length: {length}\r\n");
                        let text =
                            format!("HTTP/1.1 {status} Scripted\r\n{fixed}{headers}\r\n{body}");
                        line.write_all(text.as_bytes()).await.unwrap();
                    }
                    Reply::Cut => {
                        let text = "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n{\"frame\"";
                        line.write_all(text.as_bytes()).await.unwrap();
                    }
                    Reply::Silence => {
                        silent.notify_one();
                        held.push(line);
                    }
                }
            }
        });
        script
    }

    /// With a base path.
    pub fn url(&self) -> String {
        format!("http://{}/base/", self.address)
    }

    /// All requests up to now.
    pub fn requests(&self) -> Vec<Request> {
        self.requests.lock().unwrap().clone()
    }

    /// Waits until a request gets no answer.
    pub async fn is_silent(&mut self) {
        self.silent.notified().await;
    }
}

/// The request that comes over a connection.
pub async fn read(line: &mut TcpStream) -> Request {
    let mut bytes = Vec::new();
    loop {
        let head = bytes.windows(4).position(|four| four == b"\r\n\r\n");
        if let Some(end) = head {
            let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
            let mut lines = head.lines().filter_map(|line| line.split_once(": "));
            let length = lines.find(|(name, _)| name.eq_ignore_ascii_case("content-length"));
            let length = length.map_or(0, |(_, value)| value.parse().unwrap());
            if bytes.len() == end + 4 + length {
                let body = bytes.split_off(end + 4);
                return Request { head, body };
            }
        }
        assert_ne!(
            line.read_buf(&mut bytes).await.unwrap(),
            0,
            "half a request"
        );
    }
}
