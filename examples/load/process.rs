//! The server as a process of its own, and what `/proc` says about a process.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use crate::Outcome;
use bagtrack_testing::command::program;

/// Clock ticks of `/proc/<pid>/stat` in a second: fixed by the Linux interface.
const TICKS: f64 = 100.0;

/// Processor time that a process has used, in user and system mode, in seconds.
pub fn cpu_seconds(pid: u32) -> Outcome<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat"))?;
    // The command's name, in parentheses, may hold anything; fields 14 and 15 are the 12th and 13th after it.
    let (_, fields) = stat.rsplit_once(')').ok_or("/proc: no command name")?;
    let mut fields = fields.split_whitespace().skip(11);
    let mut ticks =
        || -> Outcome<f64> { Ok(fields.next().ok_or("/proc: too few fields")?.parse()?) };
    Ok((ticks()? + ticks()?) / TICKS)
}

/// A server that ends with this value.
pub struct Server {
    child: Child,
    url: String,
}

impl Server {
    /// Starts `binary` with room for so many sessions and these flags, and waits until it listens.
    pub fn start(binary: Option<PathBuf>, sessions: u32, flags: &[&str]) -> Outcome<Self> {
        let binary = binary.unwrap_or_else(|| program("bagtrack"));
        let room = (3 * sessions + 16).to_string();
        let mut child = Command::new(&binary)
            .args(["serve", "--listen", "127.0.0.1:0", "--max-sessions", &room])
            .args(["--queue", &room, "--max-connections", &room])
            // All clients have one address.
            .args(["--client-sessions", &room, "--client-requests", &room])
            .args(["--client-connections", &room])
            .args(flags)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{}: {error} (cargo build --release)", binary.display()))?;
        let log = child.stderr.take().ok_or("the log is piped")?;
        let mut lines = BufReader::new(log).lines();
        let url = loop {
            let line = lines
                .next()
                .ok_or("the server ended before it listened")??;
            if let Some(at) = line.find("http://127.0.0.1:") {
                let end = line[at..]
                    .find(['"', ' ', '}'])
                    .map_or(line.len(), |end| at + end);
                break line[at..end].to_owned();
            }
        };
        std::thread::spawn(move || lines.for_each(drop));
        Ok(Self { child, url })
    }

    /// Where it listens.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Its resident memory in bytes.
    pub fn resident(&self) -> Outcome<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid()))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = line.and_then(|line| line.split_whitespace().next());
        Ok(kib.ok_or("/proc: no VmRSS")?.parse::<u64>()? * 1024)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
