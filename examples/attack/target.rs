//! The attacked server.

use crate::good::target_box;
use crate::{Options, Outcome};
use bagtrack_testing::command::program;
use bagtrack_testing::memory;
use bagtrack_testing::service::program::{Program, serve};
use reqwest::{Client, RequestBuilder};
use std::net::SocketAddr;
use std::time::Duration;

/// What a server says of its resident memory, before the number.
const BOUND: &str = "resident memory stays below ";

pub struct Target {
    pub url: String,
    pub address: SocketAddr,
    pub http: Client,
    program: Option<Program>,
    /// The announced limit of the server's resident memory, in bytes.
    pub bound: Option<u64>,
}

impl Target {
    /// Starts a server with these flags, or takes the one at `--url`.
    pub async fn start(options: &Options, settings: &[&str]) -> Outcome<Self> {
        let http = Client::builder()
            .timeout(Duration::from_secs(60))
            .pool_max_idle_per_host(64)
            .build()?;
        if let Some(url) = &options.url {
            let address = url
                .strip_prefix("http://")
                .ok_or("--url is http://ADDRESS:PORT")?;
            return Ok(Self {
                address: address.trim_end_matches('/').parse()?,
                url: url.trim_end_matches('/').to_owned(),
                http,
                program: None,
                bound: None,
            });
        }
        let binary = options.server.clone();
        let binary = binary.unwrap_or_else(|| program("bagtrack"));
        let mut command = serve(&binary);
        command
            .args(["--log-format", "json"])
            .args(["--trusted-proxies", "127.0.0.0/8"])
            .args(settings);
        if options.short {
            command.args(["--write-timeout", "1s", "--header-timeout", "3s"]);
            command.args(["--body-grace", "1s"]);
        }
        let started = Program::spawn(&mut command);
        let mut program = started
            .map_err(|error| format!("{}: {error} (cargo build --release)", binary.display()))?;
        let line: serde_json::Value = serde_json::from_str(&program.logs(BOUND))?;
        let message = line["fields"]["message"].as_str().unwrap_or("");
        let bound = message.strip_prefix(BOUND).ok_or("no bound of memory")?;
        let mib: u64 = bound.trim_end_matches(" MiB").parse()?;
        program.ignore_log();
        Ok(Self {
            url: program.url(""),
            address: program.address,
            http,
            program: Some(program),
            bound: Some(mib << 20),
        })
    }

    /// Another handle of the same server, which does not end it when dropped.
    pub fn same(&self) -> Self {
        Self {
            url: self.url.clone(),
            address: self.address,
            http: self.http.clone(),
            program: None,
            bound: self.bound,
        }
    }

    /// A request of the client at this address.
    pub fn post(&self, client: &str, path: &str) -> RequestBuilder {
        let request = self.http.post(format!("{}{path}", self.url));
        request.header("x-forwarded-for", client)
    }

    /// Opens a session of this client. Returns the session's path.
    pub async fn open(&self, client: &str, frame: &[u8], query: &str) -> Outcome<String> {
        let query = format!("box={}{query}", target_box());
        self.open_with(client, frame, &query).await
    }

    /// The same with a query that has the box.
    pub async fn open_with(&self, client: &str, frame: &[u8], query: &str) -> Outcome<String> {
        let request = self.post(client, &format!("/sessions?{query}"));
        let answer = request.body(frame.to_vec()).send().await?;
        let status = answer.status();
        let path = answer.headers().get("location").cloned();
        let path = path.ok_or_else(|| format!("no session: {status}"))?;
        Ok(path.to_str()?.to_owned())
    }

    /// Whether `/healthz` answers, and after how long. A connection that was idle may be closed while it is used again;
    /// then another one is tried.
    pub async fn health(&self) -> Outcome<Duration> {
        let sent = std::time::Instant::now();
        let mut tries = 0;
        loop {
            let answer = self.http.get(format!("{}/healthz", self.url)).send().await;
            tries += 1;
            if answer.is_ok() || tries == 5 {
                answer?.error_for_status()?;
                return Ok(sent.elapsed());
            }
        }
    }

    /// Whether this program has started the server.
    pub fn is_own(&self) -> bool {
        self.program.is_some()
    }

    /// A value of `/proc/PID/status` in bytes, of a server of this program's own.
    pub fn memory(&self, field: &str) -> Option<u64> {
        memory::of_process(self.program.as_ref()?.process_id(), field)
    }

    /// What the server used at most, against what it said, in words; and whether it kept to that.
    pub fn peak(&self) -> (bool, String) {
        match (self.memory("VmHWM:"), self.bound) {
            (Some(peak), Some(bound)) => {
                let text = format!("at most {} MiB resident of {}", peak >> 20, bound >> 20);
                (peak <= bound, text)
            }
            // That of a server that runs elsewhere cannot be.
            _ => (!self.is_own(), "memory not measured".to_owned()),
        }
    }
}
