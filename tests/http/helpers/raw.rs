//! A client that writes HTTP to a socket by hand, to send slowly or in part.

use bagtrack_testing::within::within;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};

pub struct RawConnection {
    stream: TcpStream,
}

impl RawConnection {
    pub async fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).await.unwrap();
        Self { stream }
    }

    /// Connects from another address of this machine.
    pub async fn open_from(from: IpAddr, address: SocketAddr) -> Self {
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind(SocketAddr::new(from, 0)).unwrap();
        let stream = socket.connect(address).await.unwrap();
        Self { stream }
    }

    pub async fn send(&mut self, bytes: impl AsRef<[u8]>) {
        self.stream.write_all(bytes.as_ref()).await.unwrap();
    }

    /// Sends bytes; fails if the service has closed the connection.
    pub async fn try_send(&mut self, bytes: impl AsRef<[u8]>) -> std::io::Result<()> {
        self.stream.write_all(bytes.as_ref()).await
    }

    /// Sends `ask`, and reads the answers by at most `bytes` at a time, with a pause before each read. Returns the
    /// number of bytes that came until the connection ended.
    pub async fn trickle(self, ask: String, bytes: usize, pause: Duration) -> usize {
        let (mut reading, mut writing) = self.stream.into_split();
        let asking = tokio::spawn(async move {
            let _ = writing.write_all(ask.as_bytes()).await;
            writing
        });
        let (mut buffer, mut all) = (vec![0; bytes], 0);
        loop {
            tokio::time::sleep(pause).await;
            match reading.read(&mut buffer).await {
                Ok(count @ 1..) => all += count,
                _ => break,
            }
        }
        asking.abort();
        all
    }

    /// Reads until `count` answers have begun.
    pub async fn read_answers(&mut self, count: usize) -> String {
        let mut bytes = Vec::new();
        loop {
            let text = String::from_utf8_lossy(&bytes);
            if text.matches("HTTP/1.1 ").count() >= count {
                return text.into_owned();
            }
            let read = self.stream.read_buf(&mut bytes);
            let read = within(read, "answers come").await;
            assert_ne!(read.unwrap(), 0, "it ended early: {bytes:?}");
        }
    }

    /// Sends without awaiting, so that no other task runs meanwhile.
    pub fn send_now(&self, bytes: impl AsRef<[u8]>) {
        let bytes = bytes.as_ref();
        assert_eq!(self.stream.try_write(bytes).unwrap(), bytes.len());
    }

    /// How many answers have arrived, without awaiting.
    pub fn answers_now(&self) -> usize {
        let (mut bytes, mut buffer) = (Vec::new(), [0; 4096]);
        while let Ok(count @ 1..) = self.stream.try_read(&mut buffer) {
            bytes.extend_from_slice(&buffer[..count]);
        }
        String::from_utf8_lossy(&bytes).matches("HTTP/1.1 ").count()
    }

    /// Closes the client's side of the connection.
    pub async fn close_sending(&mut self) {
        self.stream.shutdown().await.unwrap();
    }

    /// The next bytes; empty if the connection was closed.
    pub async fn read_some(&mut self) -> String {
        let mut bytes = Vec::new();
        let read = self.stream.read_buf(&mut bytes);
        let _ = within(read, "something comes").await;
        String::from_utf8(bytes).unwrap()
    }

    /// Announces a body of `length` bytes, and waits until the service asks for it by `100 Continue`. The service then
    /// handles the request until the body is sent.
    pub async fn hold(address: SocketAddr, method: &str, target: &str, length: usize) -> Self {
        Self::hold_with(
            address,
            method,
            target,
            &format!("Content-Length: {length}"),
        )
        .await
    }

    /// Like [`Self::hold`], with these header lines instead of a length.
    pub async fn hold_with(address: SocketAddr, method: &str, target: &str, lines: &str) -> Self {
        let mut connection = Self::open(address).await;
        let head = format!(
            "{method} {target} HTTP/1.1\r\nHost: localhost\r\n{lines}\r\n\
             Expect: 100-continue\r\nConnection: close\r\n\r\n"
        );
        connection.send(head).await;
        let expected = b"HTTP/1.1 100 Continue\r\n\r\n";
        let mut got = [0; 25];
        let read = connection.stream.read_exact(&mut got);
        within(read, "the body is asked for").await.unwrap();
        assert_eq!(&got, expected);
        connection
    }

    /// The next answer, which must have a `Content-Length`; the connection may stay open.
    pub async fn read_answer(&mut self) -> String {
        let mut bytes = Vec::new();
        loop {
            let text = String::from_utf8_lossy(&bytes);
            if let Some((head, body)) = text.split_once("\r\n\r\n") {
                let mut lines = head.lines().filter_map(|line| line.split_once(": "));
                let length = lines.find(|(name, _)| name.eq_ignore_ascii_case("content-length"));
                let length: usize = length.expect("an announced length").1.parse().unwrap();
                if body.len() >= length {
                    return text.into_owned();
                }
            }
            let read = self.stream.read_buf(&mut bytes);
            let read = within(read, "an answer comes").await;
            assert_ne!(read.unwrap(), 0, "it ended early: {bytes:?}");
        }
    }

    /// All bytes until the service closes the connection.
    pub async fn read_to_end(&mut self) -> String {
        let mut bytes = Vec::new();
        let read = self.stream.read_to_end(&mut bytes);
        // A connection that is cut off counts as closed.
        let _ = within(read, "the connection ends").await;
        String::from_utf8(bytes).unwrap()
    }
}
