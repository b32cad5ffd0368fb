//! Other programs that tests start, on free ports, with their files in temporary folders.

use rustix::process::{Pid, Signal, kill_process};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

pub fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("it is bound").port()
}

/// Waits until the process listens at this address.
pub fn wait_for(address: SocketAddr, process: &mut Child) {
    while TcpStream::connect(address).is_err() {
        if let Some(status) = process.try_wait().expect("it was started") {
            panic!("the program at {address} has ended: {status}");
        }
        std::thread::yield_now();
    }
}

/// A process that is killed when this is dropped.
pub struct Process(pub Child);

impl Process {
    pub fn start(command: &mut Command) -> Self {
        let started = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        Self(started.unwrap_or_else(|error| panic!("{command:?}: {error}")))
    }

    pub fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.0.id()).expect("a process id");
        let id = Pid::from_raw(id).expect("a process id");
        kill_process(id, signal).expect("it runs");
    }

    pub fn kill(&mut self) {
        self.0.kill().expect("it was started");
        self.0.wait().expect("it was started");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A Redis in this folder. It writes nothing to disk, unless the flags say so.
pub fn redis_server(folder: &Path, port: u16, flags: &[&str]) -> Process {
    let mut command = Command::new("redis-server");
    command.current_dir(folder).args(["--bind", "127.0.0.1"]);
    command.args(["--save", ""]).args(flags);
    let mut process = Process::start(&mut command);
    wait_for(SocketAddr::from(([127, 0, 0, 1], port)), &mut process.0);
    process
}

/// The answer of the Redis at this port to a command.
pub fn ask_redis(port: u16, words: &[&str]) -> String {
    let mut command = Command::new("redis-cli");
    let output = command.args(["-p", &port.to_string()]).args(words).output();
    let output = output.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {output:?}");
    String::from_utf8(output.stdout).expect("redis-cli writes UTF-8")
}

/// A Redis with an append-only file, which it syncs before each answer.
pub struct Redis {
    process: Process,
    folder: TempDir,
    pub address: SocketAddr,
}

impl Redis {
    pub fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let address = SocketAddr::from(([127, 0, 0, 1], free_port()));
        let process = Self::process(folder.path(), address);
        Self {
            process,
            folder,
            address,
        }
    }

    fn process(folder: &Path, address: SocketAddr) -> Process {
        let port = address.port().to_string();
        let flags = [
            "--port",
            &port,
            "--appendonly",
            "yes",
            "--appendfsync",
            "always",
        ];
        redis_server(folder, address.port(), &flags)
    }

    pub fn url(&self) -> String {
        format!("redis://{}", self.address)
    }

    pub fn stop(&mut self) {
        self.process.kill();
    }

    /// Stops the process: it accepts connections, but does not answer.
    pub fn pause(&self) {
        self.process.signal(Signal::STOP);
    }

    pub fn go_on(&self) {
        self.process.signal(Signal::CONT);
    }

    /// The answer to a command.
    pub fn ask(&self, words: &[&str]) -> String {
        ask_redis(self.address.port(), words)
    }

    pub fn start_again(&mut self) {
        self.process = Self::process(self.folder.path(), self.address);
    }
}
