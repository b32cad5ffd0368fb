//! The service as a process: signals, exit statuses, and its log.

use reqwest::{Client, StatusCode};
use rustix::process::{Pid, Signal, kill_process};
use std::net::SocketAddr;
use std::process::Stdio;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, BufReader, Lines};
use tokio::process::{Child, ChildStderr, Command};
use tokio::time::timeout;

/// Longer than any test waits for something that does happen.
const PATIENCE: Duration = Duration::from_secs(60);

/// `bagtrack serve` on a free port.
pub struct Service {
    process: Child,
    log: Lines<BufReader<ChildStderr>>,
    pub address: SocketAddr,
    pub client: Client,
}

impl Service {
    pub async fn start(flags: &[&str]) -> Self {
        Self::start_in(flags, &[]).await
    }

    /// With these variables.
    pub async fn start_in(flags: &[&str], variables: &[(&str, &str)]) -> Self {
        Self::start_at("127.0.0.1:0", flags, variables).await
    }

    /// At this address.
    pub async fn start_at(listen: &str, flags: &[&str], variables: &[(&str, &str)]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_bagtrack"))
            .args(["serve", "--listen", listen, "--log", "info"])
            .args(flags)
            .env("NO_COLOR", "1")
            .envs(variables.iter().copied())
            .stderr(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .expect("cargo has built the binary");
        let mut log = BufReader::new(process.stderr.take().unwrap()).lines();
        let address = loop {
            let line = log.next_line().await.unwrap().expect("it starts");
            if let Some((_, rest)) = line.split_once("listening on http://") {
                let end = rest.find(|c: char| !c.is_ascii_digit() && !".:".contains(c));
                break rest[..end.unwrap_or(rest.len())].parse().unwrap();
            }
        };
        Self {
            process,
            log,
            address,
            client: Client::new(),
        }
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    pub fn process_id(&self) -> u32 {
        self.process.id().expect("it runs")
    }

    pub fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.process_id()).unwrap();
        let id = Pid::from_raw(id).unwrap();
        kill_process(id, signal).unwrap();
    }

    /// The next line of the log with this text.
    pub async fn logs(&mut self, text: &str) -> String {
        let found = async {
            loop {
                let line = self.log.next_line().await.unwrap();
                let line = line.unwrap_or_else(|| panic!("the log ends without {text}"));
                if line.contains(text) {
                    return line;
                }
            }
        };
        timeout(PATIENCE, found).await.expect(text)
    }

    /// The exit status, and the rest of the log.
    pub async fn ends(mut self) -> (Option<i32>, Vec<String>) {
        let mut rest = Vec::new();
        while let Some(line) = timeout(PATIENCE, self.log.next_line())
            .await
            .unwrap()
            .unwrap()
        {
            rest.push(line);
        }
        let status = timeout(PATIENCE, self.process.wait()).await.unwrap();
        (status.unwrap().code(), rest)
    }
}

/// A request whose body never comes, and which is inside when this returns.
async fn stuck(service: &Service) -> crate::raw::RawConnection {
    let target = "/sessions?box=1,2,3,4";
    crate::raw::RawConnection::hold(service.address, "POST", target, 1000).await
}

#[tokio::test]
async fn an_end_without_open_requests_has_status_0() {
    for (signal, flags) in [
        (Signal::TERM, &["--shutdown-delay", "0s"][..]),
        // SIGINT leaves the delay out.
        (Signal::INT, &["--shutdown-delay", "10m"][..]),
    ] {
        let service = Service::start(flags).await;
        service.signal(signal);
        let (status, log) = service.ends().await;
        assert_eq!(status, Some(0), "{log:?}");
    }
}

#[tokio::test]
async fn an_end_that_cuts_a_request_off_has_another_status() {
    let flags = ["--shutdown-delay", "0s", "--shutdown-timeout", "100ms"];
    let service = Service::start(&flags).await;
    let _held = stuck(&service).await;
    service.signal(Signal::TERM);
    let (status, log) = service.ends().await;
    assert_eq!(status, Some(1), "{log:?}");
    assert!(log.iter().any(|line| line.contains("cut off")), "{log:?}");
}

#[tokio::test]
async fn a_second_signal_ends_the_service_at_once() {
    let flags = ["--shutdown-delay", "10m", "--shutdown-timeout", "10m"];
    let mut service = Service::start(&flags).await;
    let _held = stuck(&service).await;
    service.signal(Signal::TERM);
    service.logs("shutting down").await;
    service.signal(Signal::TERM);
    let (status, log) = service.ends().await;
    assert_eq!(status, Some(1), "{log:?}");
}

#[tokio::test]
async fn a_hangup_reads_the_keys_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys");
    std::fs::write(&file, "ann:0123456789abcdef").unwrap();
    let flags = ["--api-keys-file", file.to_str().unwrap()];
    let mut service = Service::start(&flags).await;
    let url = service.url("/metrics");
    let client = service.client.clone();
    let status = async |key: &str| {
        let response = client.get(&url).bearer_auth(key).send().await;
        response.unwrap().status()
    };
    assert_eq!(status("0123456789abcdef").await, StatusCode::OK);
    assert_eq!(status("fedcba9876543210").await, StatusCode::UNAUTHORIZED);
    std::fs::write(&file, "ann:0123456789abcdef\nben:fedcba9876543210").unwrap();
    service.signal(Signal::HUP);
    service.logs("API keys read again").await;
    assert_eq!(status("fedcba9876543210").await, StatusCode::OK);
    std::fs::write(&file, "nonsense").unwrap();
    service.signal(Signal::HUP);
    service.logs("the API keys stay as they were").await;
    assert_eq!(status("fedcba9876543210").await, StatusCode::OK);
    // A pipe that nobody writes to once stopped this reload and all later ones.
    std::fs::remove_file(&file).unwrap();
    let made = std::process::Command::new("mkfifo").arg(&file).status();
    assert!(made.unwrap().success());
    service.signal(Signal::HUP);
    service.logs("the API keys stay as they were").await;
    std::fs::remove_file(&file).unwrap();
    std::fs::write(&file, "ann:0123456789abcdef").unwrap();
    service.signal(Signal::HUP);
    service.logs("API keys read again").await;
    assert_eq!(status("fedcba9876543210").await, StatusCode::UNAUTHORIZED);
}

#[tokio::test]
async fn a_limit_of_memory_below_the_bound_is_told_at_the_start() {
    let mut command = Command::new("sh");
    let start = "ulimit -v 1500000; exec \"$0\" serve --listen 127.0.0.1:0";
    command.args(["-c", start, env!("CARGO_BIN_EXE_bagtrack")]);
    command.stderr(Stdio::piped()).kill_on_drop(true);
    let mut process = command.spawn().unwrap();
    let mut log = BufReader::new(process.stderr.take().unwrap()).lines();
    let told = async {
        while let Some(line) = log.next_line().await.unwrap() {
            if line.contains("address space (ulimit -v) is below what the service may take") {
                return true;
            }
        }
        false
    };
    assert!(timeout(PATIENCE, told).await.unwrap());
}
