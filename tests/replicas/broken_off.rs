//! Requests that a replica reads without answering: the configurations of docker/ send some of them to another one.

use crate::balancers::{Balancer, haproxy, nginx};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

const BODY: &[u8] = &[b'x'; 100];

/// A false replica that reports that it is ready, but closes the connection after it has read a request. It ends with
/// the process of the test.
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

/// How many replicas read this request, and the status of the balancer's answer.
fn readers(balance: fn(&[SocketAddr]) -> Balancer, method: &str, path: &str) -> (usize, u16) {
    let read = Arc::new(AtomicUsize::new(0));
    // A new balancer for each request: it avoids a replica for a while after it broke off.
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

/// A frame without a number would be tracked again by each replica that gets it.
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
    // Opening a session by its id is idempotent, so nginx sends it to the other replicas.
    assert_eq!(readers(nginx, "PUT", "/sessions/a"), (3, 502));
}

#[test]
#[ignore = "needs haproxy"]
fn a_frame_without_a_number_goes_to_one_replica_alone_behind_haproxy() {
    a_frame_without_a_number_goes_to_one_replica_alone(haproxy);
}
