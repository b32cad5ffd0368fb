//! `bagtrack serve` as a process that can be killed and restarted at the same address.

use crate::command::program;
use crate::processes::{Process, free_port, wait_for};
use reqwest::StatusCode;
use rustix::process::Signal;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

pub struct Replica {
    process: Process,
    program: PathBuf,
    flags: Vec<String>,
    environment: Vec<(String, String)>,
    pub address: SocketAddr,
}

impl Replica {
    pub fn start(flags: &[&str]) -> Self {
        Self::start_in(&[], flags)
    }

    pub fn start_in(environment: &[(&str, &str)], flags: &[&str]) -> Self {
        Self::start_program(&program("bagtrack"), environment, flags)
    }

    /// Starts another build of the program.
    pub fn start_program(program: &Path, environment: &[(&str, &str)], flags: &[&str]) -> Self {
        let address = SocketAddr::from(([127, 0, 0, 1], free_port()));
        let flags: Vec<String> = flags.iter().map(|flag| (*flag).to_owned()).collect();
        let environment = environment.iter();
        let environment: Vec<(String, String)> = environment
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
            .collect();
        Self {
            process: Self::process(program, &environment, &flags, address),
            program: program.to_owned(),
            flags,
            environment,
            address,
        }
    }

    pub fn with_store(url: &str, flags: &[&str]) -> Self {
        Self::start(&[&["--store", url], flags].concat())
    }

    fn process(
        program: &Path,
        environment: &[(String, String)],
        flags: &[String],
        address: SocketAddr,
    ) -> Process {
        let mut command = Command::new(program);
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
        let has = |name: &str| flags.iter().any(|flag| flag == name);
        if !has("--shutdown-delay") {
            command.args(["--shutdown-delay", "0s"]);
        }
        // A long timeout, for a store on a slow disk.
        if has("--store") && !has("--store-timeout") {
            command.args(["--store-timeout", "5s"]);
        }
        command.args(flags);
        let mut process = Process::start(&mut command);
        wait_for(address, &mut process.0);
        process
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Kills the process by SIGKILL, without a restart.
    pub fn kill(&mut self) {
        self.process.kill();
    }

    pub fn ask_to_end(&self) {
        self.process.signal(Signal::TERM);
    }

    /// Asks the process to end, and waits until it has.
    pub fn end(&mut self) -> ExitStatus {
        self.ask_to_end();
        self.process.0.wait().expect("it was started")
    }

    pub fn start_again(&mut self) {
        let (environment, flags) = (&self.environment, &self.flags);
        self.process = Self::process(&self.program, environment, flags, self.address);
    }

    /// Uses another build of the program from the next start on.
    pub fn change_program(&mut self, program: &Path) {
        self.program = program.to_owned();
    }

    /// The status of `/readyz`.
    pub async fn readiness(&self) -> StatusCode {
        let answer = reqwest::get(self.url("/readyz")).await;
        answer.expect("it listens").status()
    }
}
