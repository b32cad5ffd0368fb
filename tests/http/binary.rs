//! The program itself: `bagtrack serve`, `bagtrack health`, SIGTERM.
#![cfg(unix)]

use crate::application::BOX;
use crate::pictures;
use image::ImageFormat;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};

fn bagtrack() -> Command {
    Command::new(env!("CARGO_BIN_EXE_bagtrack"))
}

/// A running service and its address.
fn serve() -> (Child, String) {
    let mut command = bagtrack();
    command.args(["serve", "--log-format", "json"]);
    let mut child = command
        .env("BAGTRACK_LISTEN", "127.0.0.1:0")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap()).lines();
    let url = loop {
        let line = log.next().expect("it says where it listens").unwrap();
        let line: serde_json::Value = serde_json::from_str(&line).unwrap();
        let message = line["fields"]["message"].as_str().unwrap_or("").to_owned();
        if let Some(url) = message.strip_prefix("listening on ") {
            break url.to_owned();
        }
    };
    // What is not read is dropped, and then said so; nobody needs to see that here.
    std::thread::spawn(move || log.for_each(drop));
    (child, url)
}

fn health(url: &str) -> Output {
    let mut command = bagtrack();
    command.args(["health", "--url", url]).output().unwrap()
}

#[test]
fn serves_answers_health_and_ends_on_sigterm() {
    let (mut child, url) = serve();
    let healthy = health(&url);
    let ended = Command::new("kill").arg(child.id().to_string()).status();
    let status = child.wait().unwrap();
    assert!(healthy.status.success(), "{healthy:?}");
    assert!(ended.unwrap().success());
    assert!(status.success(), "{status}");
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
    let mut command = bagtrack();
    // Probes are logged at this level.
    let debug = ["serve", "--log-format", "json", "--log", "bagtrack=debug"];
    command.args(debug);
    command.env("BAGTRACK_LISTEN", "127.0.0.1:0");
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let log = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut messages = Vec::new();
    for line in log {
        let line: Value = serde_json::from_str(&line.unwrap()).unwrap();
        let message = line["fields"]["message"].as_str().unwrap_or("").to_owned();
        if let Some(url) = message.strip_prefix("listening on ") {
            for _ in 0..3 {
                assert!(health(url).status.success());
            }
            let ended = Command::new("kill").arg(child.id().to_string()).status();
            assert!(ended.unwrap().success());
        }
        messages.push(message);
    }
    assert!(child.wait().unwrap().success());
    let answered = messages.iter().filter(|message| *message == "answered");
    assert_eq!(answered.count(), 3, "{messages:?}");
    assert_eq!(messages.last().unwrap(), "bye");
}

#[tokio::test]
async fn frames_one_by_one_get_the_answers_of_frames_together() {
    let (mut child, url) = serve();
    let client = reqwest::Client::new();
    let jpeg = |t| pictures::encode(pictures::scene(t), ImageFormat::Jpeg);
    let open = async || {
        let create = format!("{url}/sessions?box={BOX}&seed=7");
        let created = client.post(create).body(jpeg(0)).send().await.unwrap();
        let created: Value = created.json().await.unwrap();
        format!("{url}/sessions/{}/frames", created["id"].as_str().unwrap())
    };
    let (one_by_one, together) = (open().await, open().await);
    let mut answers = Vec::new();
    let mut form = reqwest::multipart::Form::new();
    for t in 1..=20 {
        let answer = client.post(&one_by_one).body(jpeg(t)).send().await.unwrap();
        answers.push(answer.json::<Value>().await.unwrap());
        let part = reqwest::multipart::Part::bytes(jpeg(t)).file_name("frame.jpg");
        form = form.part("frame", part);
    }
    let all = client.post(&together).multipart(form).send().await.unwrap();
    let all: Value = all.json().await.unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(all["answers"], Value::from(answers));
}

#[tokio::test]
async fn a_log_that_nobody_reads_stops_nothing_and_its_lost_lines_are_counted() {
    const REQUESTS: u64 = 3000;
    let mut command = bagtrack();
    command.args(["serve", "--log-format", "json"]);
    command.env("BAGTRACK_LISTEN", "127.0.0.1:0");
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    log.read_line(&mut line).unwrap();
    let started: Value = serde_json::from_str(&line).unwrap();
    let message = started["fields"]["message"].as_str().unwrap();
    let url = message.strip_prefix("listening on ").unwrap().to_owned();

    // From here on the pipe is open and nobody reads it. Each of these requests has two lines in the log, together
    // many times what the pipe and the service keep.
    let client = reqwest::Client::new();
    let nowhere = format!("{url}/nowhere");
    let all = async {
        for _ in 0..REQUESTS / 10 {
            let ask = || async { client.get(&nowhere).send().await.unwrap().status() };
            let statuses = futures_util::future::join_all((0..10).map(|_| ask())).await;
            assert!(statuses.iter().all(|status| *status == 404), "{statuses:?}");
        }
        assert!(
            client
                .get(format!("{url}/healthz"))
                .send()
                .await
                .unwrap()
                .status()
                .is_success()
        );
    };
    let answered = tokio::time::timeout(std::time::Duration::from_secs(60), all).await;
    if answered.is_err() {
        child.kill().unwrap();
        panic!("requests wait for the log");
    }

    let reader = std::thread::spawn(move || {
        let lines = log
            .lines()
            .map(|line| serde_json::from_str(&line.unwrap()).unwrap());
        lines.collect::<Vec<Value>>()
    });
    let ended = Command::new("kill").arg(child.id().to_string()).status();
    assert!(ended.unwrap().success());
    assert!(child.wait().unwrap().success());
    let lines = reader.join().unwrap();
    let dropped = lines
        .iter()
        .filter_map(|line| line["fields"]["total"].as_u64());
    let dropped = dropped.max().expect("it says that lines were dropped");
    let of_requests = lines
        .iter()
        .filter(|line| line["span"]["path"] == "/nowhere");
    let written = of_requests.count() as u64;
    assert!(written > 1000 && dropped > 0, "{written} and {dropped}");
    assert!(written + dropped >= 2 * REQUESTS, "{written} and {dropped}");
}

#[test]
fn a_setting_out_of_its_range_is_named_in_one_line() {
    let output = bagtrack().env("BAGTRACK_QUEUE", "0").output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        line,
        "bagtrack: --queue (BAGTRACK_QUEUE) must be at least 1\n"
    );
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
    let mut command = Command::new("sh");
    let script = format!(
        "ulimit -n 128; exec {} serve --log-format json",
        env!("CARGO_BIN_EXE_bagtrack")
    );
    command
        .args(["-c", &script])
        .env("BAGTRACK_LISTEN", "127.0.0.1:0");
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut warned = None;
    let url = loop {
        let line: Value = serde_json::from_str(&log.next().unwrap().unwrap()).unwrap();
        let fields = &line["fields"];
        if line["level"] == "WARN" {
            warned = Some((fields["limit"].clone(), fields["connections"].clone()));
        }
        let message = fields["message"].as_str().unwrap_or("");
        if let Some(url) = message.strip_prefix("listening on ") {
            break url.to_owned();
        }
    };
    let bound: Value = serde_json::from_str(&log.next().unwrap().unwrap()).unwrap();
    std::thread::spawn(move || log.for_each(drop));
    let address = url.strip_prefix("http://").unwrap();
    let silent: Vec<_> = (0..300)
        .map_while(|_| std::net::TcpStream::connect(address).ok())
        .collect();
    let healthy = health(&url);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(warned, Some((128.into(), 64.into())));
    let message = bound["fields"]["message"].as_str().unwrap();
    assert!(
        message.starts_with("resident memory stays below "),
        "{message}"
    );
    assert_eq!(silent.len(), 300);
    assert!(healthy.status.success(), "{healthy:?}");
}
