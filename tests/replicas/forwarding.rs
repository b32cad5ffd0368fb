//! What the configurations of docker/ forward to the service: the host of a request, and the address of its client.

use crate::balancers::{Balancer, haproxy, haproxy_with, nginx};
use crate::clip::Clip;
use crate::replica::Replica;
use reqwest::{Client, Response, StatusCode};
use std::io::Read;
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

type Balance = fn(&[SocketAddr]) -> Balancer;

/// Three replicas with these flags, and a balancer before them.
fn behind(balance: Balance, flags: &[&str]) -> ([Replica; 3], Balancer) {
    let replicas = [(); 3].map(|()| Replica::start(flags));
    let front = balance(&replicas.each_ref().map(|replica| replica.address));
    (replicas, front)
}

async fn open(front: &Balancer, headers: &[(&str, &str)]) -> Response {
    let clip = Clip::of(0, 1);
    let url = format!("http://{}/sessions?box={}", front.address, clip.first_box);
    let mut request = Client::new().post(url).body(clip.frames[0].clone());
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    request.send().await.unwrap()
}

/// Over plain HTTP, browsers send no `Sec-Fetch-Site`, so the service can compare only `Origin` with host and port.
async fn pages_of_the_same_port_alone_may_call(balance: Balance) {
    let (_replicas, front) = behind(balance, &[]);
    let own = format!("http://{}", front.address);
    for (origin, status) in [
        (own.as_str(), StatusCode::CREATED),
        ("http://127.0.0.1", StatusCode::FORBIDDEN),
        ("http://127.0.0.1:1", StatusCode::FORBIDDEN),
    ] {
        let answer = open(&front, &[("origin", origin)]).await;
        assert_eq!(answer.status(), status, "{origin}");
    }
}

#[tokio::test]
#[ignore = "needs redis and nginx"]
async fn pages_of_the_same_port_alone_may_call_behind_nginx() {
    pages_of_the_same_port_alone_may_call(nginx).await;
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn pages_of_the_same_port_alone_may_call_behind_haproxy() {
    pages_of_the_same_port_alone_may_call(haproxy).await;
}

/// Each of three replicas allows a client one session: the fourth is refused, even if the client sends a false
/// `X-Forwarded-For`.
async fn a_client_cannot_name_itself_another(balance: Balance) {
    let flags = ["--trusted-proxies", "127.0.0.0/8", "--client-sessions", "1"];
    let (_replicas, front) = behind(balance, &flags);
    for name in ["x-forwarded-for", "forwarded"] {
        let mut statuses = Vec::new();
        for client in 1..=4 {
            let value = match name {
                "forwarded" => format!("for=198.51.100.{client}"),
                _ => format!("198.51.100.{client}"),
            };
            statuses.push(open(&front, &[(name, &value)]).await.status());
        }
        let refused = StatusCode::TOO_MANY_REQUESTS;
        assert!(statuses.contains(&refused), "{name}: {statuses:?}");
    }
}

#[tokio::test]
#[ignore = "needs redis and nginx"]
async fn a_client_cannot_name_itself_another_behind_nginx() {
    a_client_cannot_name_itself_another(nginx).await;
}

#[tokio::test]
#[ignore = "needs redis and haproxy"]
async fn a_client_cannot_name_itself_another_behind_haproxy() {
    a_client_cannot_name_itself_another(haproxy).await;
}

/// Tested with a smaller bound than the configuration's, which would need more open files than tests may have.
#[test]
#[ignore = "needs redis and haproxy"]
fn one_source_has_so_many_connections_at_haproxy() {
    const MOST: usize = 8;
    let bound = [("sc0_conn_cur gt 1024", format!("sc0_conn_cur gt {MOST}"))];
    let replicas = [(); 3].map(|()| Replica::start(&[]));
    let addresses = replicas.each_ref().map(|replica| replica.address);
    let front = haproxy_with(&addresses, &bound);
    let silent: Vec<TcpStream> = (0..MOST + 4)
        .map(|_| TcpStream::connect(front.address).unwrap())
        .collect();
    let is_closed = |mut stream: &TcpStream| {
        let short = Some(Duration::from_millis(300));
        stream.set_read_timeout(short).unwrap();
        match stream.read(&mut [0]) {
            Ok(read) => read == 0,
            Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
        }
    };
    let closed = silent.iter().filter(|stream| is_closed(stream)).count();
    // The probe that waited for HAProxy to listen may count, or be closed already.
    assert!((4..=5).contains(&closed), "{closed}");
}
