//! Requests that a replica reads and does not answer: which ones the configurations of docker/ send to another one.

use crate::balancers::{Balancer, haproxy, nginx};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

const BODY: &[u8] = &[b'x'; 100];

/// A replica that reads requests and breaks off, but says that it is ready. It ends with the test's process.
fn breaks_off(read: &Arc<AtomicUsize>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let read = read.clone();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut request = Vec::new();
            let mut byte = [0];
            while !request.ends_with(b"\r\n\r\n") && stream.read(&mut byte).unwrap_or(0) > 0 {
                request.extend(byte);
            }
            if request.starts_with(b"GET /readyz") || request.starts_with(b"GET /healthz") {
                let ready = b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
                stream.write_all(ready).unwrap_or_default();
            } else if stream.read_exact(&mut [0; BODY.len()]).is_ok() {
                read.fetch_add(1, Ordering::Relaxed);
            }
        }
    });
    address
}

/// How many replicas read this request, and the status that its sender gets.
fn readers(balance: fn(&[SocketAddr]) -> Balancer, method: &str, path: &str) -> (usize, u16) {
    let read = Arc::new(AtomicUsize::new(0));
    // Anew for each request: a replica that broke off is left out for a while.
    let front = balance(&[(); 3].map(|()| breaks_off(&read)));
    let mut stream = TcpStream::connect(front.address).unwrap();
    let length = BODY.len();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: test\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).unwrap();
    stream.write_all(BODY).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let status = String::from_utf8_lossy(&answer);
    let status = status.split(' ').nth(1).expect("a status");
    (read.load(Ordering::Relaxed), status.parse().unwrap())
}

/// Without a number a frame counts each time that a replica has it.
fn a_frame_without_a_number_goes_to_one_replica_alone(balance: fn(&[SocketAddr]) -> Balancer) {
    for (method, path) in [
        ("PUT", "/sessions/a/target?box=1,2,30,40"),
        ("PUT", "/video/sessions/a/target?box=1,2,30,40"),
        ("POST", "/sessions/a/frames"),
    ] {
        assert_eq!(readers(balance, method, path), (1, 502), "{method} {path}");
    }
}

#[test]
#[ignore = "needs nginx"]
fn a_frame_without_a_number_goes_to_one_replica_alone_behind_nginx() {
    a_frame_without_a_number_goes_to_one_replica_alone(nginx);
    // A session that is opened twice is one: this goes on to the others.
    assert_eq!(readers(nginx, "PUT", "/sessions/a"), (3, 502));
}

#[test]
#[ignore = "needs haproxy"]
fn a_frame_without_a_number_goes_to_one_replica_alone_behind_haproxy() {
    a_frame_without_a_number_goes_to_one_replica_alone(haproxy);
}
