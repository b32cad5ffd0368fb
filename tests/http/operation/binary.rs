//! The program itself: `bagtrack serve`, `bagtrack health`, SIGTERM.
#![cfg(unix)]

use crate::application::BOX;
use crate::pictures;
use crate::program::{self, Program};
use bagtrack_testing::within::within;
use reqwest::{Client, StatusCode};
use rustix::process::Signal;
use serde_json::Value;
use std::process::{Command, Output};
use std::time::SystemTime;

fn bagtrack() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
    program::without_settings(&mut command);
    command
}

/// The service, with a log in JSON.
fn serve() -> Program {
    Program::start(&["--log-format", "json"], &[])
}

/// The message of a line of the log.
fn message(line: &str) -> String {
    let line: Value = serde_json::from_str(line).unwrap();
    line["fields"]["message"].as_str().unwrap_or("").to_owned()
}

fn health(url: &str) -> Output {
    let mut command = bagtrack();
    command.args(["health", "--url", url]).output().unwrap()
}

#[test]
fn serves_answers_health_and_ends_on_sigterm() {
    let service = serve();
    let url = service.url("");
    let healthy = health(&url);
    service.signal(Signal::TERM);
    let (status, _) = service.ends();
    assert!(healthy.status.success(), "{healthy:?}");
    assert_eq!(status, Some(0));
    let gone = health(&url);
    assert_eq!(gone.status.code(), Some(1));
    let line = String::from_utf8(gone.stderr).unwrap();
    assert!(
        line.starts_with("bagtrack: no answer from 127.0.0.1:"),
        "{line}"
    );
    assert_eq!(line.lines().count(), 1);
}

#[test]
fn every_request_has_its_line_in_the_log_when_the_service_has_ended() {
    // Probes are logged at the level `debug`.
    let flags = ["--log-format", "json", "--log", "bagtrack=debug"];
    let service = Program::start(&flags, &[]);
    for _ in 0..3 {
        assert!(health(&service.url("")).status.success());
    }
    service.signal(Signal::TERM);
    let (status, log) = service.ends();
    assert_eq!(status, Some(0));
    let messages: Vec<String> = log.iter().map(|line| message(line)).collect();
    let answered = messages.iter().filter(|message| *message == "answered");
    assert_eq!(answered.count(), 3, "{messages:?}");
    assert_eq!(messages.last().unwrap(), "bye");
}

#[tokio::test]
async fn a_log_that_nobody_reads_stops_nothing_and_its_lost_lines_are_counted() {
    const REQUESTS: u64 = 6000;
    // Requests of a trusted proxy itself have no rate limit.
    let flags = ["--log-format", "json", "--trusted-proxies", "127.0.0.1"];
    let service = Program::start(&flags, &[]);

    // From here on nobody reads the pipe of the log, which stays open. The requests have a line in the log each,
    // together more than the buffers of the pipe and of the service hold.
    let client = Client::new();
    let nowhere = service.url("/nowhere");
    let all = async {
        for _ in 0..REQUESTS / 10 {
            let ask = || async { client.get(&nowhere).send().await.unwrap().status() };
            let statuses = futures_util::future::join_all((0..10).map(|_| ask())).await;
            assert!(statuses.iter().all(|status| *status == 404), "{statuses:?}");
        }
        assert!(
            client
                .get(service.url("/healthz"))
                .send()
                .await
                .unwrap()
                .status()
                .is_success()
        );
    };
    within(all, "requests that do not wait for the log").await;

    service.signal(Signal::TERM);
    let (status, log) = service.ends();
    assert_eq!(status, Some(0));
    let lines: Vec<Value> = log
        .iter()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let dropped = lines
        .iter()
        .filter_map(|line| line["fields"]["total"].as_u64());
    let dropped = dropped.max().expect("it says that lines were dropped");
    let of_requests = lines
        .iter()
        .filter(|line| line["span"]["path"] == "/nowhere");
    let written = of_requests.count() as u64;
    assert!(written > 1000 && dropped > 0, "{written} and {dropped}");
    assert!(written + dropped >= REQUESTS, "{written} and {dropped}");
}

#[test]
fn a_setting_out_of_its_range_is_named_in_one_line() {
    let output = bagtrack().env("BAGTRACK_QUEUE", "0").output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        line,
        "bagtrack: --queue (BAGTRACK_QUEUE) must be from 1 to 2^61 - 1\n"
    );
    // A message, and no panic with a backtrace.
    for flag in ["--queue", "--max-sessions"] {
        let mut command = bagtrack();
        let output = command.args(["serve", flag, "18446744073709551615"]);
        let output = output.output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{flag}");
        let lines = String::from_utf8(output.stderr).unwrap();
        let line = lines.lines().next_back().unwrap_or_default();
        assert!(line.starts_with(&format!("bagtrack: {flag} (")), "{lines}");
    }
}

#[test]
fn a_setting_before_the_command_is_refused_not_dropped() {
    let output = bagtrack().args(["--queue", "5", "serve"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("'--queue <QUEUE>'"), "{error}");
}

#[test]
fn too_few_open_files_are_said_at_the_start_and_the_service_answers() {
    let mut command = program::serve_after("ulimit -n 128");
    command.args(["--log-format", "json"]);
    let mut service = Program::spawn(&mut command).unwrap();
    let lines = service.said().iter();
    let mut lines = lines.map(|line| serde_json::from_str::<Value>(line).unwrap());
    let warned = lines.rfind(|line| line["level"] == "WARN").map(|line| {
        let fields = &line["fields"];
        (fields["limit"].clone(), fields["connections"].clone())
    });
    let bound = message(&service.logs(""));
    let silent: Vec<_> = (0..300)
        .map_while(|_| std::net::TcpStream::connect(service.address).ok())
        .collect();
    let healthy = health(&service.url(""));
    assert_eq!(warned, Some((128.into(), 32.into())));
    assert!(bound.starts_with("resident memory stays below "), "{bound}");
    assert_eq!(silent.len(), 300);
    assert!(healthy.status.success(), "{healthy:?}");
}

#[tokio::test]
async fn a_host_name_and_bare_seconds_are_taken() {
    let times = ["--session-idle", "10", "--session-first", "10"];
    let flags = [&["--listen", "localhost:0"], &times[..]].concat();
    let service = Program::start(&flags, &[]);
    assert!(service.address.ip().is_loopback());
    let request = Client::new().post(service.url(&format!("/sessions?box={BOX}")));
    let created = request.body(pictures::png(0)).send().await.unwrap();
    assert_eq!(created.status(), StatusCode::CREATED);
    let created: Value = created.json().await.unwrap();
    let expires = humantime::parse_rfc3339(created["expires_at"].as_str().unwrap()).unwrap();
    let left = expires
        .duration_since(SystemTime::now())
        .map_or(0, |left| left.as_secs());
    assert!(left <= 10, "{left} s");
}
