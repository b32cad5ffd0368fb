//! The service as a process: signals, exit statuses, and its log.

use crate::program::{self, Program};
use bagtrack_testing::service::server::Process;
use bagtrack_testing::within::within;
use reqwest::{Client, StatusCode};
use rustix::process::Signal;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use tokio::net::TcpListener;

/// A request whose body never comes, and which is inside when this returns.
async fn stuck(service: &Program) -> crate::helpers::raw::RawConnection {
    let target = "/sessions?box=1,2,3,4";
    crate::helpers::raw::RawConnection::hold(service.address, "POST", target, 1000).await
}

#[tokio::test]
async fn an_end_without_open_requests_has_status_0() {
    for (signal, flags) in [
        (Signal::TERM, &["--shutdown-delay", "0s"][..]),
        // SIGINT leaves the delay out.
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
    // A pipe that nobody writes to once stopped this reload and all later ones.
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

/// Keys and certificates may be exchanged while the start waits for a store. A hangup ended the process then.
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
    // The start waits for an answer, which does not come.
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
}
