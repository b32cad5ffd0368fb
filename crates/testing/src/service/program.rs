//! `bagtrack serve` as a process; its address is read from the log.

use crate::command::program;
use crate::processes::Process;
use crate::within::PATIENCE;
use rustix::process::Signal;
use std::io::{self, BufRead, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{ChildStderr, Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};

/// `bagtrack serve` on a free port; the process is killed when this is dropped.
///
/// Lines of the log are read only when a method waits for one. The others stay in the pipe; if it is full, the service
/// drops lines.
pub struct Program {
    process: Process,
    log: Log,
    said: Vec<String>,
    url: String,
    pub address: SocketAddr,
}

impl Program {
    pub fn start(flags: &[&str], variables: &[(&str, &str)]) -> Self {
        let mut command = serve(&program("bagtrack"));
        command.args(flags).envs(variables.iter().copied());
        Self::spawn(&mut command).unwrap_or_else(|error| panic!("{command:?}: {error}"))
    }

    /// Starts the program by a command such as that of [`serve`].
    ///
    /// # Errors
    /// The program does not exist, or ends before it listens.
    pub fn spawn(command: &mut Command) -> io::Result<Self> {
        let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = Process(command.spawn()?);
        let mut log = Log::of(process.0.stderr.take().expect("it is a pipe"));
        let mut said = Vec::new();
        let told = "listening on ";
        let Some(line) = log.until(told, &mut said) else {
            let ended = format!("it ends before it listens: {said:?}");
            return Err(io::Error::other(ended));
        };
        let (_, url) = line.split_once(told).expect("the line has it");
        // In a log in JSON, a quotation mark follows the address.
        let url = url.split(['"', ' ']).next().expect("a first part");
        let (_, address) = url.split_once("://").expect("an address has a scheme");
        Ok(Self {
            process,
            log,
            said,
            url: url.to_owned(),
            address: address.parse().expect("an address with a port"),
        })
    }

    /// The URL of this path, which may be empty.
    pub fn url(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }

    pub fn process_id(&self) -> u32 {
        self.process.0.id()
    }

    pub fn signal(&self, signal: Signal) {
        self.process.signal(signal);
    }

    /// The lines of the log that were read so far.
    pub fn said(&self) -> &[String] {
        &self.said
    }

    /// The next line of the log with this text.
    pub fn logs(&mut self, text: &str) -> String {
        let line = self.log.until(text, &mut self.said);
        line.unwrap_or_else(|| panic!("the log ends without {text}: {:?}", self.said))
    }

    /// Reads the rest of the log, and drops it.
    pub fn ignore_log(&mut self) {
        self.log.lines = None;
    }

    /// Waits until the process has ended. Returns the exit status, and the rest of the log.
    pub fn ends(mut self) -> (Option<i32>, Vec<String>) {
        let mut rest = Vec::new();
        while let Some(line) = self.log.next() {
            rest.push(line);
        }
        // The log ends with the process.
        let status = self.process.0.wait().expect("it was started");
        (status.code(), rest)
    }
}

/// The command that starts a program on a free port, with a log without colours.
pub fn serve(program: &Path) -> Command {
    let mut command = Command::new(program);
    set_up(&mut command);
    command
}

/// The command that starts this workspace's program after these shell commands, such as `ulimit`, in the same process.
pub fn serve_after(preparation: &str) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("{preparation}; exec \"$0\" \"$@\"")]);
    command.arg(program("bagtrack"));
    set_up(&mut command);
    command
}

/// Removes the settings of the program from the command's environment, which the user may have set.
pub fn without_settings(command: &mut Command) {
    for (name, _) in std::env::vars_os() {
        if name
            .to_str()
            .is_some_and(|name| name.starts_with("BAGTRACK_"))
        {
            command.env_remove(name);
        }
    }
}

fn set_up(command: &mut Command) {
    without_settings(command);
    // A flag may name another address.
    command.arg("serve").env("BAGTRACK_LISTEN", "127.0.0.1:0");
    command.env("NO_COLOR", "1");
}

/// The log of a process, read by a thread: a pipe has no time limit.
struct Log {
    /// `None` once the log is ignored. A line is read when the one before has been received. The lock only makes the
    /// type shareable between threads.
    lines: Option<Mutex<Receiver<String>>>,
}

impl Log {
    fn of(pipe: ChildStderr) -> Self {
        let (sender, lines) = sync_channel(0);
        std::thread::spawn(move || {
            for line in BufReader::new(pipe).lines() {
                // Sending fails once the log is ignored: the line is dropped.
                let _ = sender.send(line.expect("the log is text"));
            }
        });
        Self {
            lines: Some(Mutex::new(lines)),
        }
    }

    /// The next line; `None` at the end of the log.
    fn next(&mut self) -> Option<String> {
        let lines = self.lines.as_mut().expect("it is not ignored");
        let lines = lines.get_mut().expect("nobody has locked it");
        match lines.recv_timeout(PATIENCE) {
            Ok(line) => Some(line),
            Err(RecvTimeoutError::Disconnected) => None,
            Err(RecvTimeoutError::Timeout) => panic!("the log says nothing for a minute"),
        }
    }

    /// The next line with this text. Adds that line and those before it to `said`.
    fn until(&mut self, text: &str, said: &mut Vec<String>) -> Option<String> {
        loop {
            let line = self.next()?;
            said.push(line.clone());
            if line.contains(text) {
                return Some(line);
            }
        }
    }
}
