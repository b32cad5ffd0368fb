//! The configurations of docker/ with replicas below a path of a shared host (`--base-path`).

use crate::balancers::{Balancer, haproxy, nginx};
use crate::clip::Clip;
use crate::pair::json;
use crate::replica::Replica;
use reqwest::{Client, StatusCode};
use std::net::SocketAddr;
use uuid::Uuid;

const BASE: &str = "/video/tracker";
const FRAMES: usize = 6;

/// Without a store, tracks sessions behind this balancer, which must send each to its own replica.
async fn sessions_stay_at_their_replicas(
    balance: fn(&[SocketAddr]) -> Balancer,
    client_makes_ids: bool,
) {
    let replicas = [(); 3].map(|()| Replica::start(&["--base-path", BASE]));
    let balancer = balance(&replicas.each_ref().map(|replica| replica.address));
    let url = |path: &str| format!("http://{}{path}", balancer.address);
    let (clip, client) = (Clip::of(0, FRAMES), Client::new());
    let target = format!("box={}", clip.first_box);
    let mut sessions_at = [0; 3];
    for _ in 0..9 {
        let request = match client_makes_ids {
            true => client.put(url(&format!("{BASE}/sessions/{}?{target}", Uuid::new_v4()))),
            false => client.post(url(&format!("{BASE}/sessions?{target}"))),
        };
        let opened = request.body(clip.frames[0].clone()).send().await.unwrap();
        let location = opened.headers()["location"].to_str().unwrap().to_owned();
        json(opened, StatusCode::CREATED).await;
        for number in 1..FRAMES {
            let request = client.post(url(&format!("{location}/frames?frame={number}")));
            let answer = request.body(clip.frames[number].clone()).send().await;
            let answer = json(answer.unwrap(), StatusCode::OK).await;
            assert_eq!(answer["frame"], number);
        }
        for (replica, sessions) in replicas.iter().zip(&mut sessions_at) {
            let view = client.get(replica.url(&location)).send().await.unwrap();
            *sessions += usize::from(view.status() == StatusCode::OK);
        }
    }
    assert_eq!(sessions_at.iter().sum::<usize>(), 9);
    assert!(sessions_at.iter().max() < Some(&9), "{sessions_at:?}");
    for path in ["/", "/docs/", "/openapi.json", "/page/main.js"] {
        let answer = client.get(url(&format!("{BASE}{path}"))).send().await;
        assert_eq!(answer.unwrap().status(), StatusCode::OK, "{path}");
    }
}

#[tokio::test]
#[ignore = "needs haproxy"]
async fn sessions_below_a_path_stay_at_their_replicas_behind_haproxy() {
    sessions_stay_at_their_replicas(haproxy, false).await;
    sessions_stay_at_their_replicas(haproxy, true).await;
}

#[tokio::test]
#[ignore = "needs nginx"]
async fn sessions_below_a_path_stay_at_their_replicas_behind_nginx() {
    sessions_stay_at_their_replicas(nginx, true).await;
}
