//! The server as a process of its own.

use std::fs;
use std::path::PathBuf;

use crate::Outcome;
use bagtrack_testing::command::program;
use bagtrack_testing::service::program::{Program, serve};
use bagtrack_testing::{cpu_time, memory};
use rustix::process::{Pid, getpriority_process, setpriority_process};

/// A server that ends with this value.
pub struct Server(Program);

impl Server {
    /// Starts `binary` with room for so many sessions and these flags, and waits until it listens.
    pub fn start(binary: Option<PathBuf>, sessions: u32, flags: &[&str]) -> Outcome<Self> {
        let binary = binary.unwrap_or_else(|| program("bagtrack"));
        let room = (3 * sessions + 16).to_string();
        let mut command = serve(&binary);
        command
            .args(["--max-sessions", &room])
            .args(["--queue", &room, "--max-connections", &room])
            // All clients have one address.
            .args(["--client-sessions", &room, "--client-requests", &room])
            .args(["--client-connections", &room])
            .args(flags);
        let started = Program::spawn(&mut command);
        let mut program = started
            .map_err(|error| format!("{}: {error} (cargo build --release)", binary.display()))?;
        program.ignore_log();
        Ok(Self(program))
    }

    /// Gives the server a lower priority than this process, whose clients would run on other machines.
    pub fn lower_priority(&self) -> Outcome<()> {
        for task in fs::read_dir(format!("/proc/{}/task", self.0.process_id()))? {
            let task = task?.file_name().to_string_lossy().parse()?;
            let task = Pid::from_raw(task);
            setpriority_process(task, getpriority_process(task)? + 8)?;
        }
        Ok(())
    }

    pub fn url(&self) -> String {
        self.0.url("")
    }

    /// Seconds of processor time that the server has used.
    pub fn cpu_seconds(&self) -> f64 {
        cpu_time::of_process(self.0.process_id())
    }

    pub fn resident(&self) -> Outcome<u64> {
        let resident = memory::of_process(self.0.process_id(), "VmRSS:");
        Ok(resident.ok_or("/proc: no VmRSS")?)
    }
}
