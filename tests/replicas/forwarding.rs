//! What the configurations of docker/ tell the service of a request: the host that it names.

use crate::balancers::{Balancer, haproxy, nginx};
use crate::clip::Clip;
use crate::replica::Replica;
use reqwest::{Client, Response, StatusCode};
use std::net::SocketAddr;

type Balance = fn(&[SocketAddr]) -> Balancer;

/// Three replicas with these flags, and what stands before them.
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

/// A browser that asks over plain HTTP names no `Sec-Fetch-Site`: the host and its port are all there is to compare.
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
