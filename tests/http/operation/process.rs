//! The service as a process: signals, exit statuses, and its log.

use crate::application::expect;
use crate::pictures;
use crate::program::{self, Program};
use crate::stream_client::StreamClient;
use crate::streams::stream::problem_slug;
use bagtrack_testing::processes::Process;
use bagtrack_testing::within::within;
use reqwest::{Client, StatusCode};
use rustix::process::Signal;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use tokio::net::TcpListener;

/// A request whose body never comes. The service handles it when this function returns.
async fn stuck(service: &Program) -> crate::helpers::raw::RawConnection {
    let target = "/sessions?box=1,2,3,4";
    crate::helpers::raw::RawConnection::hold(service.address, "POST", target, 1000).await
}

#[tokio::test]
async fn an_end_without_open_requests_has_status_0() {
    for (signal, flags) in [
        (Signal::TERM, &["--shutdown-delay", "0s"][..]),
        // SIGINT skips `--shutdown-delay`.
        (Signal::INT, &["--shutdown-delay", "10m"][..]),
    ] {
        let service = Program::start(flags, &[]);
        service.signal(signal);
        let (status, log) = service.ends();
        assert_eq!(status, Some(0), "{log:?}");
    }
}

#[tokio::test]
async fn an_end_that_cuts_a_request_off_has_another_status() {
    let flags = ["--shutdown-delay", "0s", "--shutdown-timeout", "100ms"];
    let service = Program::start(&flags, &[]);
    let _held = stuck(&service).await;
    service.signal(Signal::TERM);
    let (status, log) = service.ends();
    assert_eq!(status, Some(1), "{log:?}");
    assert!(log.iter().any(|line| line.contains("cut off")), "{log:?}");
}

#[tokio::test]
async fn a_second_signal_ends_the_service_at_once() {
    let flags = ["--shutdown-delay", "10m", "--shutdown-timeout", "10m"];
    let mut service = Program::start(&flags, &[]);
    let _held = stuck(&service).await;
    service.signal(Signal::TERM);
    service.logs("shutting down");
    service.signal(Signal::TERM);
    let (status, log) = service.ends();
    assert_eq!(status, Some(1), "{log:?}");
}

#[tokio::test]
async fn a_hangup_reads_the_keys_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys");
    std::fs::write(&file, "ann:0123456789abcdef").unwrap();
    let flags = ["--api-keys-file", file.to_str().unwrap()];
    let mut service = Program::start(&flags, &[]);
    let url = service.url("/metrics");
    let client = Client::new();
    let status = async |key: &str| {
        let response = client.get(&url).bearer_auth(key).send().await;
        response.unwrap().status()
    };
    assert_eq!(status("0123456789abcdef").await, StatusCode::OK);
    assert_eq!(status("fedcba9876543210").await, StatusCode::UNAUTHORIZED);
    std::fs::write(&file, "ann:0123456789abcdef\nben:fedcba9876543210").unwrap();
    service.signal(Signal::HUP);
    service.logs("API keys read again");
    assert_eq!(status("fedcba9876543210").await, StatusCode::OK);
    std::fs::write(&file, "nonsense").unwrap();
    service.signal(Signal::HUP);
    service.logs("the API keys stay as they were");
    assert_eq!(status("fedcba9876543210").await, StatusCode::OK);
    // Reading a pipe without a writer must not block this reload, nor later ones.
    std::fs::remove_file(&file).unwrap();
    let made = Command::new("mkfifo").arg(&file).status();
    assert!(made.unwrap().success());
    service.signal(Signal::HUP);
    service.logs("the API keys stay as they were");
    std::fs::remove_file(&file).unwrap();
    std::fs::write(&file, "ann:0123456789abcdef").unwrap();
    service.signal(Signal::HUP);
    service.logs("API keys read again");
    assert_eq!(status("fedcba9876543210").await, StatusCode::UNAUTHORIZED);
}

#[test]
fn a_variable_that_is_no_setting_is_told_at_the_start() {
    let variables = [
        ("BAGTRACK_MAX_SESSION", "3"),
        ("BAGTRACK_MAX_SESSIONS", "3"),
        // Kubernetes sets such variables for a service that is called `bagtrack`.
        ("BAGTRACK_SERVICE_HOST", "10.0.0.1"),
        ("BAGTRACK_PORT_8080_TCP", "tcp://10.0.0.1:8080"),
    ];
    let service = Program::start(&[], &variables);
    let told: Vec<&String> = service.said().iter().collect();
    let of = |name: &str| told.iter().filter(|line| line.contains(name)).count();
    assert_eq!(of("BAGTRACK_MAX_SESSION is no setting"), 1, "{told:?}");
    assert_eq!(of("BAGTRACK_MAX_SESSIONS"), 0, "{told:?}");
    assert_eq!(of("BAGTRACK_SERVICE") + of("BAGTRACK_PORT"), 0, "{told:?}");
    assert_eq!(of("no --store"), 0, "{told:?}");
}

#[test]
fn what_is_set_and_has_no_effect_is_told_at_the_start() {
    let flags = ["--durability", "each", "--ffmpeg", "true"];
    let mut service = Program::start(&flags, &[]);
    let told = service
        .said()
        .iter()
        .any(|line| line.contains("no --store"));
    assert!(told, "{:?}", service.said());
    // The check of ffmpeg does not delay the start: its warning comes after the service listens.
    service.logs("true (--ffmpeg) is no ffmpeg");
}

/// The client of the cluster may try hundreds of times a second; these attempts are not logged.
#[test]
fn a_cluster_that_is_away_is_told_once() {
    // The service asks for the cluster at the start, before it listens.
    let service = Program::start(&["--store", "redis-cluster://127.0.0.1:1"], &[]);
    service.signal(Signal::TERM);
    let told = service.said().to_vec();
    let (_, rest) = service.ends();
    let lines = || told.iter().chain(&rest);
    let away = lines().filter(|line| line.contains("the store gives no answer"));
    assert_eq!(away.count(), 1, "{told:?} {rest:?}");
    assert_eq!(lines().find(|line| line.contains("redis::cluster")), None);
}

/// When a leaked key is replaced, the tokens and streams made with it must end.
#[tokio::test]
async fn a_replaced_key_ends_its_tokens_and_streams_though_its_name_stays() {
    const OLD: &str = "0123456789abcdef";
    const NEW: &str = "fedcba9876543210";
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), format!("ann:{OLD}\nann:{NEW}")).unwrap();
    let flags = ["--api-keys-file", file.path().to_str().unwrap()];
    let mut service = Program::start(&flags, &[]);
    let client = Client::new();
    let create = client.post(service.url("/sessions?box=10,10,24,24"));
    let create = create.bearer_auth(OLD).body(pictures::png(0)).send();
    let session = expect(create.await.unwrap(), StatusCode::CREATED).await;
    let id = session["id"].as_str().unwrap();
    let url = service.url(&format!("/sessions/{id}"));
    let mut tokens = Vec::new();
    for key in [OLD, NEW] {
        let made = client.post(format!("{url}/token")).bearer_auth(key);
        let made = expect(made.send().await.unwrap(), StatusCode::OK).await;
        tokens.push(made["token"].as_str().unwrap().to_owned());
    }
    let address = service.address;
    let stream = async |key: &str| {
        let key = format!("Bearer {key}");
        let headers = [("authorization", key.as_str())];
        let stream = StreamClient::try_open(address, id, "", &headers).await;
        stream.expect("it is let in")
    };
    let mut old = stream(OLD).await;
    let status = async |presented: &str| {
        let request = client.get(&url).bearer_auth(presented);
        request.send().await.unwrap().status()
    };
    for token in &tokens {
        assert_eq!(status(token).await, StatusCode::OK);
    }
    std::fs::write(file.path(), format!("ann:{NEW}")).unwrap();
    service.signal(Signal::HUP);
    service.logs("API keys read again");
    assert_eq!(status(OLD).await, StatusCode::UNAUTHORIZED);
    assert_eq!(status(&tokens[0]).await, StatusCode::UNAUTHORIZED);
    assert_eq!(status(&tokens[1]).await, StatusCode::OK);
    old.send(pictures::png(1)).await;
    assert_eq!(problem_slug(&old.message().await), "unauthorized");
    assert_eq!(old.close_code().await, 4401);
    let mut new = stream(NEW).await;
    new.send(pictures::png(1)).await;
    assert_eq!(new.message().await["frame"], 1);
}

/// Operators may exchange keys and certificates, and send SIGHUP, while the start waits for a store.
#[tokio::test]
async fn a_hangup_during_the_start_does_not_end_the_service() {
    let store = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("redis://{}", store.local_addr().unwrap());
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), "ann:0123456789abcdef").unwrap();
    let mut command = program::serve_after(":");
    command.args(["--store", &url, "--api-keys-file"]);
    command.arg(file.path()).stderr(Stdio::piped());
    let mut service = Process(command.spawn().unwrap());
    let log = service.0.stderr.take().unwrap();
    // The start waits for an answer of the store, which does not come.
    let (asked, _) = within(store.accept(), "the store is asked").await.unwrap();
    service.signal(Signal::HUP);
    drop((asked, store));
    let read = tokio::task::spawn_blocking(move || {
        let mut lines = BufReader::new(log).lines().map_while(Result::ok);
        lines.any(|line| line.contains("API keys read again"))
    });
    assert!(within(read, "the keys are read").await.unwrap(), "it ended");
}

#[test]
fn a_limit_of_memory_below_the_bound_is_told_at_the_start() {
    let mut command = program::serve_after("ulimit -v 1500000");
    let mut service = Program::spawn(&mut command).unwrap();
    service.logs("address space (ulimit -v) is below what the service may take");
    let mut service = Program::start(&["--max-sessions", "1000000000"], &[]);
    service.logs("the machine's memory is below what the service may take");
}
