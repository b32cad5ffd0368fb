//! `bagtrack serve` as a process, which can be killed and started again at its address.

use super::server::{Process, free_port, wait_for};
use crate::command::program;
use reqwest::StatusCode;
use rustix::process::Signal;
use std::net::SocketAddr;
use std::process::Command;

pub struct Replica {
    process: Process,
    flags: Vec<String>,
    environment: Vec<(String, String)>,
    pub address: SocketAddr,
}

impl Replica {
    pub fn start(flags: &[&str]) -> Self {
        Self::start_in(&[], flags)
    }

    /// With these variables.
    pub fn start_in(environment: &[(&str, &str)], flags: &[&str]) -> Self {
        let address = SocketAddr::from(([127, 0, 0, 1], free_port()));
        let flags: Vec<String> = flags.iter().map(|flag| (*flag).to_owned()).collect();
        let environment = environment.iter();
        let environment: Vec<(String, String)> = environment
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
            .collect();
        Self {
            process: Self::process(&environment, &flags, address),
            flags,
            environment,
            address,
        }
    }

    /// With the store at this URL.
    pub fn with_store(url: &str, flags: &[&str]) -> Self {
        Self::start(&[&["--store", url], flags].concat())
    }

    fn process(environment: &[(String, String)], flags: &[String], address: SocketAddr) -> Process {
        let mut command = Command::new(program("bagtrack"));
        command.envs(environment.iter().cloned());
        command.args(["serve", "--listen", &address.to_string()]);
        command.args([
            "--log",
            "warn",
            "--workers",
            "2",
            "--client-requests",
            "200",
        ]);
        if !flags.iter().any(|flag| flag == "--shutdown-delay") {
            command.args(["--shutdown-delay", "0s"]);
        }
        command.args(flags);
        let mut process = Process::start(&mut command);
        wait_for(address, &mut process.0);
        process
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// `kill -9`, and no start.
    pub fn kill(&mut self) {
        self.process.kill();
    }

    /// Asks it to end.
    pub fn ask_to_end(&self) {
        self.process.signal(Signal::TERM);
    }

    /// Asks it to end, and waits until it has.
    pub fn end(&mut self) {
        self.ask_to_end();
        self.process.0.wait().expect("it was started");
    }

    pub fn start_again(&mut self) {
        self.process = Self::process(&self.environment, &self.flags, self.address);
    }

    /// The status of `/readyz`.
    pub async fn readiness(&self) -> StatusCode {
        let answer = reqwest::get(self.url("/readyz")).await;
        answer.expect("it listens").status()
    }
}
