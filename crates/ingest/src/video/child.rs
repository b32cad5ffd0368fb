//! The decoder's process, and what it may take.

use super::error::VideoError;
use std::ffi::{OsStr, OsString};
use std::process::{Child, Command, Stdio};

/// Most bytes of addresses of a decoder, which needs some ten pictures of a video within the limits of frames.
pub const MAX_MEMORY: u64 = 768 << 20;
/// By how much lower its priority is: that of other slow work.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;
/// What the launcher ends with where it cannot start the program.
pub(super) const NOT_STARTED: i32 = 127;
/// Most processor time in seconds.
#[cfg(target_os = "linux")]
const MAX_CPU: u64 = 300;
/// Most bytes of a file that it writes: what it keeps of its input, to go back in it.
#[cfg(target_os = "linux")]
const MAX_FILE: u64 = 1 << 30;
#[cfg(target_os = "linux")]
const MAX_FILES: u64 = 64;

/// Starts the program with pipes; `launcher` and its arguments, where there is one, restrict themselves and become it. It
/// gets nothing of the environment, which may have secrets, but the path.
pub(super) fn start<A: AsRef<OsStr>>(
    launcher: &[OsString],
    program: &str,
    arguments: impl IntoIterator<Item = A>,
) -> Result<Child, VideoError> {
    let mut words = launcher.iter().map(OsString::as_os_str);
    let mut command = match words.next() {
        Some(first) => {
            let mut command = Command::new(first);
            command.args(words).arg(program);
            command
        }
        None => Command::new(program),
    };
    command.args(arguments).env_clear();
    if let Some(path) = std::env::var_os("PATH") {
        command.env("PATH", path);
    }
    // Ctrl-C goes to the whole group of the terminal. Whoever wants the pictures decides when this ends.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let pipes = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let child = pipes.stderr(Stdio::piped()).spawn();
    let child = child.map_err(|source| VideoError::NoProgram {
        program: program.to_owned(),
        source,
    })?;
    limit(&child);
    Ok(child)
}

/// Sets the limits. Where that fails the program has ended already.
#[cfg(target_os = "linux")]
fn limit(child: &Child) {
    use rustix::process::{Pid, Resource, Rlimit, prlimit, setpriority_process};
    let pid = Pid::from_child(child);
    let _ = setpriority_process(Some(pid), NICENESS);
    for (resource, most) in [
        (Resource::As, MAX_MEMORY),
        (Resource::Cpu, MAX_CPU),
        (Resource::Fsize, MAX_FILE),
        (Resource::Nofile, MAX_FILES),
        (Resource::Core, 0),
    ] {
        let limit = Rlimit {
            current: Some(most),
            maximum: Some(most),
        };
        let _ = prlimit(Some(pid), resource, limit);
    }
}

/// Elsewhere a process cannot be limited from outside.
#[cfg(not(target_os = "linux"))]
fn limit(_child: &Child) {}
