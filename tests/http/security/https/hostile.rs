//! Clients that make no handshake, or make it slowly, and clients that do not read.

use super::certificates::{Authority, Files, kinds};
use super::client::{Client, trusting};
use bagtrack_testing::within::within;
use std::net::IpAddr;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinSet;

/// The head of a TLS record of 512 bytes, and the head of the hello in it.
const HELLO_BEGUN: [u8; 9] = [22, 3, 1, 2, 0, 1, 0, 1, 252];

fn issued() -> (Authority, Files) {
    let authority = Authority::new();
    let files = authority.issue(kinds()[0].1);
    (authority, files)
}

#[tokio::test]
async fn a_handshake_has_to_end_in_time() {
    let (authority, files) = issued();
    let limit = Duration::from_secs(1);
    let service = files.service(|config| config.header_timeout = limit).await;
    let started = Instant::now();
    let mut slow = Vec::new();
    for begun in [0, 1, HELLO_BEGUN.len()] {
        let mut stream = TcpStream::connect(service.address).await.unwrap();
        stream.write_all(&HELLO_BEGUN[..begun]).await.unwrap();
        slow.push(Client(stream));
    }
    // A handshake of single bytes with pauses is ended, too.
    let trickle = async {
        let mut stream = TcpStream::connect(service.address).await.unwrap();
        stream.write_all(&HELLO_BEGUN).await.unwrap();
        while stream.write_all(&[0]).await.is_ok() {
            tokio::time::sleep(limit / 20).await;
        }
    };
    within(trickle, "it is cut off").await;
    for client in &mut slow {
        client.ends().await;
    }
    assert!(started.elapsed() >= limit);
    // On a busy machine, a handshake may take longer than this service waits: try again.
    let connector = trusting(&authority.root, &[]);
    let opened = async {
        loop {
            if let Ok(client) = Client::try_open(&connector, service.address).await {
                break client;
            }
        }
    };
    let mut client = within(opened, "a handshake is made in time").await;
    assert_eq!(client.call("GET", "/healthz", b"").await.status(), "200");
    assert!(service.end().await);
}

#[tokio::test]
async fn handshakes_count_as_connections_and_make_room_for_others() {
    let (authority, files) = issued();
    let service = files.service(|config| {
        config.max_connections = 3;
        config.limits.client_connections = Some(3);
        config.header_timeout = Duration::from_secs(600);
    });
    let service = service.await;
    let mut slow = Vec::new();
    for _ in 0..3 {
        let mut stream = TcpStream::connect(service.address).await.unwrap();
        stream.write_all(&HELLO_BEGUN).await.unwrap();
        slow.push(Client(stream));
    }
    let connector = trusting(&authority.root, &[]);
    let mut served = Vec::new();
    for _ in 0..3 {
        let mut client = Client::open(&connector, service.address).await;
        assert_eq!(client.call("GET", "/healthz", b"").await.status(), "200");
        served.push(client);
    }
    for client in &mut slow {
        assert_eq!(client.ends().await, b"");
    }
    let metrics = served[2].call("GET", "/metrics", b"").await;
    let metrics = String::from_utf8(metrics.body).unwrap();
    let shed = metrics
        .lines()
        .find(|line| line.contains("shed") && !line.starts_with('#'));
    assert!(shed.is_some_and(|line| line.ends_with(" 3")), "{shed:?}");
    assert!(service.end().await);
}

#[tokio::test]
async fn a_connection_over_its_share_is_for_probes_alone() {
    let (authority, files) = issued();
    let service = files.service(|config| {
        config.limits.client_connections = Some(1);
    });
    let service = service.await;
    let connector = trusting(&authority.root, &[]);
    let mut busy = Client::open(&connector, service.address).await;
    let head = "POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\nExpect: 100-continue\r\n\r\n";
    busy.0.write_all(head.as_bytes()).await.unwrap();
    let mut asked = [0; 25];
    busy.0.read_exact(&mut asked).await.unwrap();
    assert!(asked.starts_with(b"HTTP/1.1 100"));
    for (path, status) in [("/healthz", "200"), ("/metrics", "429")] {
        let mut second = Client::open(&connector, service.address).await;
        assert_eq!(second.call("GET", path, b"").await.status(), status);
    }
    drop(busy);
    assert!(service.end().await);
}

/// Handshakes are limited because each costs the network thread a signature.
#[tokio::test]
async fn an_address_makes_so_many_handshakes_a_second_and_others_do_not_wait_for_them() {
    const AT_ONCE: usize = 64;
    const A_SECOND: usize = 25;
    let (authority, files) = issued();
    let service = files.service(|_| ()).await;
    let (connector, address) = (trusting(&authority.root, &[]), service.address);
    let started = Instant::now();
    for _ in 0..AT_ONCE + 2 * A_SECOND {
        Client::open(&connector, address).await;
    }
    let took = started.elapsed();
    assert!(took >= Duration::from_millis(1_950), "{took:?}");
    let mut waiting = JoinSet::new();
    for _ in 0..8 * A_SECOND {
        let connector = connector.clone();
        waiting.spawn(async move { Client::open(&connector, address).await });
    }
    let mut other = Client::open_from(IpAddr::from([127, 0, 0, 9]), &connector, address).await;
    assert_eq!(other.call("GET", "/healthz", b"").await.status(), "200");
    let mut ended = 0;
    while waiting.try_join_next().is_some() {
        ended += 1;
    }
    assert!(ended < 8 * A_SECOND, "{ended}");
    waiting.shutdown().await;
    assert!(service.end().await);
}

#[tokio::test]
async fn a_handshake_does_not_hold_up_the_end() {
    let (_, files) = issued();
    let service = files.service(|config| {
        config.header_timeout = Duration::from_secs(600);
        config.shutdown_timeout = Duration::from_secs(600);
    });
    let service = service.await;
    let mut stream = TcpStream::connect(service.address).await.unwrap();
    stream.write_all(&HELLO_BEGUN).await.unwrap();
    assert!(within(service.end(), "it ends").await);
}

#[tokio::test]
async fn a_client_that_never_reads_loses_its_connection() {
    let (authority, files) = issued();
    let service = files.service(|config| {
        config.limits.write_timeout = Duration::from_millis(100);
    });
    let service = service.await;
    let connector = trusting(&authority.root, &[]);
    let mut client = Client::open(&connector, service.address).await;
    let ask = "GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(50);
    // Sends without end; sending fails when the service has closed the connection.
    let refused = async {
        while client.0.write_all(ask.as_bytes()).await.is_ok() && client.0.flush().await.is_ok() {}
    };
    within(refused, "the connection ends").await;
    let mut client = Client::open(&connector, service.address).await;
    assert_eq!(client.call("GET", "/healthz", b"").await.status(), "200");
    // The service ends without waiting for the client's `close_notify`.
    assert!(within(service.end(), "it ends").await);
}
