//! Stores behind a password, TLS, a socket file, and in a cluster.

use crate::clip::Clip;
use crate::pair::json;
use crate::processes::{Process, ask_redis, free_port, redis_server};
use crate::replica::Replica;
use bagtrack_testing::within::within;
use reqwest::{Client, StatusCode};
use std::process::Command;
use tempfile::TempDir;
use uuid::Uuid;

const FRAMES: usize = 6;

fn run(command: &mut Command) {
    let output = command.output();
    let output = output.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {output:?}");
}

/// Tracks some sessions at two replicas with this store, which take the frames in turns.
async fn replicas_share_sessions(environment: &[(&str, &str)], store: &str) {
    let replica = || Replica::start_in(environment, &["--store", store]);
    let (replicas, clip, client) = ([replica(), replica()], Clip::of(0, FRAMES), Client::new());
    for replica in &replicas {
        // On a busy machine, connecting to the store may take a while.
        let found = async { while replica.readiness().await != StatusCode::OK {} };
        within(found, "the store is found").await;
    }
    for _ in 0..4 {
        let path = format!("/sessions/{}", Uuid::new_v4());
        let request = client.put(replicas[0].url(&format!("{path}?box={}", clip.first_box)));
        let opened = request.body(clip.frames[0].clone()).send().await.unwrap();
        json(opened, StatusCode::CREATED).await;
        for number in 1..FRAMES {
            let url = replicas[number % 2].url(&format!("{path}/frames?frame={number}"));
            let answer = client.post(url).body(clip.frames[number].clone()).send();
            let answer = answer.await.unwrap();
            assert_eq!(answer.headers()["checkpoint"], number.to_string().as_str());
            assert_eq!(json(answer, StatusCode::OK).await["frame"], number);
        }
    }
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_store_behind_a_password() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let flags = ["--port", &port.to_string(), "--requirepass", "s3cret"];
    let _server = redis_server(folder.path(), port, &flags);
    replicas_share_sessions(&[], &format!("redis://:s3cret@127.0.0.1:{port}/1")).await;
    let locked_out = Replica::with_store(&format!("redis://127.0.0.1:{port}"), &[]);
    assert_eq!(
        locked_out.readiness().await,
        StatusCode::SERVICE_UNAVAILABLE
    );
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_store_at_a_socket_file() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let flags = ["--port", &port.to_string(), "--unixsocket", "redis.sock"];
    let _server = redis_server(folder.path(), port, &flags);
    let url = format!("unix://{}", folder.path().join("redis.sock").display());
    replicas_share_sessions(&[], &url).await;
}

#[cfg(feature = "tls")]
#[tokio::test]
#[ignore = "needs redis and openssl"]
async fn a_store_behind_tls_whose_certificate_is_checked() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (key, certificate) = (path("key.pem"), path("certificate.pem"));
    let mut command = Command::new("openssl");
    command.args([
        "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
    ]);
    command.args(["-keyout", &key, "-out", &certificate, "-subj", "/CN=store"]);
    command.args(["-addext", "subjectAltName=IP:127.0.0.1"]);
    command.args(["-addext", "basicConstraints=critical,CA:FALSE"]);
    run(&mut command);
    let number = port.to_string();
    let mut flags = vec!["--port", "0", "--tls-port", &number];
    flags.extend(["--tls-cert-file", &certificate, "--tls-key-file", &key]);
    flags.extend(["--tls-auth-clients", "no"]);
    let _server = redis_server(folder.path(), port, &flags);
    let url = format!("rediss://127.0.0.1:{port}");
    replicas_share_sessions(&[("SSL_CERT_FILE", &certificate)], &url).await;
    // A replica without the root refuses the store's certificate.
    let wary = Replica::with_store(&url, &[]);
    assert_eq!(wary.readiness().await, StatusCode::SERVICE_UNAVAILABLE);
}

#[tokio::test]
#[ignore = "needs redis"]
async fn a_store_of_three_nodes() {
    let nodes: Vec<(TempDir, u16)> = (0..3)
        .map(|_| (tempfile::tempdir().unwrap(), free_port()))
        .collect();
    let start = |(folder, port): &(TempDir, u16)| {
        let (port_text, bus) = (port.to_string(), free_port().to_string());
        let flags = [
            "--port",
            &port_text,
            "--cluster-enabled",
            "yes",
            "--cluster-port",
            &bus,
        ];
        redis_server(folder.path(), *port, &flags)
    };
    let _servers: Vec<Process> = nodes.iter().map(start).collect();
    let mut create = Command::new("redis-cli");
    create.args(["--cluster", "create"]);
    create.args(nodes.iter().map(|(_, port)| format!("127.0.0.1:{port}")));
    run(create.arg("--cluster-yes"));
    // A node that has just started refuses keys for two seconds, even if the cluster is complete.
    for (_, port) in &nodes {
        while !ask_redis(*port, &["cluster", "info"]).contains("cluster_state:ok") {
            std::thread::yield_now();
        }
    }
    let url = format!(
        "redis-cluster://127.0.0.1:{},127.0.0.1:{}",
        nodes[0].1, nodes[1].1
    );
    replicas_share_sessions(&[], &url).await;
    let keys = nodes.iter().map(|(_, port)| {
        let answer = ask_redis(*port, &["dbsize"]);
        let keys = answer.trim().parse::<usize>();
        keys.unwrap_or_else(|_| panic!("{answer}"))
    });
    assert!(keys.sum::<usize>() >= 4);
}
