//! The decoder's process, and what it may take.

use super::error::{MAX_CPU, MAX_MEMORY, VideoError};
use std::ffi::{OsStr, OsString};
use std::io::{PipeReader, PipeWriter};
use std::process::{Child, Command, Stdio};

/// The decoder's niceness, which is that of other slow work.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;
/// The exit status of the launcher where it cannot start the program.
pub(super) const NOT_STARTED: i32 = 127;
/// Most bytes of a file that the decoder writes: its copy of the pipe, in which it can seek back.
#[cfg(target_os = "linux")]
const MAX_FILE: u64 = 1 << 30;
#[cfg(target_os = "linux")]
const MAX_FILES: u64 = 64;

/// The program that starts the decoder: it gives up rights and then executes the decoder, whose command line follows
/// its own arguments. Without words the decoder is started directly.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Launcher {
    /// The program and its arguments.
    pub words: Vec<OsString>,
    /// Whether the launcher lets the decoder open no files but the system's programs and libraries, and write none.
    /// Then the decoder may use the protocol for files, and gets the video as a file without a name. Otherwise it gets
    /// a pipe, and may only cache what it has read from it.
    pub hides_files: bool,
}

/// Whose video it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trust {
    /// Somebody else's: memory and processor time are limited.
    Foreign,
    /// A video of the person who runs the program, who may use all of the machine.
    Own,
}

/// The process, and the pipe of its standard error.
pub(super) struct Started {
    pub(super) child: Child,
    pub(super) said: PipeReader,
    /// The writing end of that pipe. As long as it is open, the reading end does not come to an end.
    pub(super) saying: PipeWriter,
}

/// Starts the program with this input, and with pipes for its output and its standard error. Of the environment, which
/// may have secrets, it gets only `PATH`.
pub(super) fn start<A: AsRef<OsStr>>(
    launcher: &Launcher,
    program: &str,
    arguments: impl IntoIterator<Item = A>,
    input: Stdio,
    trust: Trust,
) -> Result<Started, VideoError> {
    let not_started = |source| VideoError::NoProgram {
        program: program.to_owned(),
        source,
    };
    let mut words = launcher.words.iter().map(OsString::as_os_str);
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
    // Ctrl-C goes to the whole group of the terminal. The decoder has its own group, since the reader of the pictures
    // decides when it ends.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let (said, saying) = std::io::pipe().map_err(not_started)?;
    let own = saying.try_clone().map_err(not_started)?;
    let pipes = command.stdin(input).stdout(Stdio::piped()).stderr(saying);
    let child = pipes.spawn().map_err(not_started)?;
    limit(&child, trust);
    Ok(Started {
        child,
        said,
        saying: own,
    })
}

/// Sets the limits. Setting them fails only where the process has ended already.
#[cfg(target_os = "linux")]
fn limit(child: &Child, trust: Trust) {
    use rustix::process::{Pid, Resource, Rlimit, prlimit, setpriority_process};
    let pid = Pid::from_child(child);
    let _ = setpriority_process(Some(pid), NICENESS);
    let of_foreign = match trust {
        Trust::Foreign => &[(Resource::As, MAX_MEMORY), (Resource::Cpu, MAX_CPU)][..],
        Trust::Own => &[],
    };
    let of_all = [
        (Resource::Fsize, MAX_FILE),
        (Resource::Nofile, MAX_FILES),
        (Resource::Core, 0),
    ];
    for &(resource, most) in of_foreign.iter().chain(&of_all) {
        let limit = Rlimit {
            current: Some(most),
            maximum: Some(most),
        };
        let _ = prlimit(Some(pid), resource, limit);
    }
}

/// On other systems a process cannot be limited from outside.
#[cfg(not(target_os = "linux"))]
fn limit(_child: &Child, _trust: Trust) {}

/// A file of these bytes that has no name; `None` where the system has no such files.
#[cfg(target_os = "linux")]
pub(super) fn nameless(bytes: &[u8]) -> Option<Stdio> {
    use rustix::fs::{MemfdFlags, memfd_create};
    use std::io::Write;
    let mut file = std::fs::File::from(memfd_create("video", MemfdFlags::CLOEXEC).ok()?);
    file.write_all(bytes).ok()?;
    Some(file.into())
}

/// Other systems have no such files.
#[cfg(not(target_os = "linux"))]
pub(super) fn nameless(_bytes: &[u8]) -> Option<Stdio> {
    None
}
