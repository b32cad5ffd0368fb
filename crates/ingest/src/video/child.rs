//! The decoder's process, and what it may take.

use super::error::{MAX_CPU, MAX_MEMORY, VideoError};
use std::ffi::{OsStr, OsString};
use std::io::{PipeReader, PipeWriter};
use std::process::{Child, Command, Stdio};

/// By how much lower its priority is: that of other slow work.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;
/// What the launcher ends with where it cannot start the program.
pub(super) const NOT_STARTED: i32 = 127;
/// Most bytes of a file that it writes: what it keeps of a pipe, to go back in it.
#[cfg(target_os = "linux")]
const MAX_FILE: u64 = 1 << 30;
#[cfg(target_os = "linux")]
const MAX_FILES: u64 = 64;

/// What starts the decoder: a program with its own arguments before the decoder's name, which gives up rights and
/// becomes it. Without words the decoder is started by itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Launcher {
    /// The program and its arguments.
    pub words: Vec<OsString>,
    /// Whether the decoder can open no file then but the system's programs and libraries, and write none at all. It
    /// gets the video as a file without a name, and may read files; otherwise it gets a pipe, and may only keep what it
    /// has read from that.
    pub hides_files: bool,
}

/// Whose video it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trust {
    /// Somebody else's: decoding may take so much, and no more.
    Foreign,
    /// That of the person who runs this, who may have all of the machine.
    Own,
}

/// The program, and the pipe for what it says.
pub(super) struct Started {
    pub(super) child: Child,
    pub(super) said: PipeReader,
    /// The end at which it says it. As long as this is here, the other one has no end.
    pub(super) saying: PipeWriter,
}

/// Starts the program with this input, and pipes for its pictures and what it says. It gets nothing of the environment,
/// which may have secrets, but the path.
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
    // Ctrl-C goes to the whole group of the terminal. Whoever wants the pictures decides when this ends.
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

/// Sets the limits. Where that fails the program has ended already.
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

/// Elsewhere a process cannot be limited from outside.
#[cfg(not(target_os = "linux"))]
fn limit(_child: &Child, _trust: Trust) {}

/// A file of these bytes that has no name; none where the system has no such files.
#[cfg(target_os = "linux")]
pub(super) fn nameless(bytes: &[u8]) -> Option<Stdio> {
    use rustix::fs::{MemfdFlags, memfd_create};
    use std::io::Write;
    let mut file = std::fs::File::from(memfd_create("video", MemfdFlags::CLOEXEC).ok()?);
    file.write_all(bytes).ok()?;
    Some(file.into())
}

/// Elsewhere there are none.
#[cfg(not(target_os = "linux"))]
pub(super) fn nameless(_bytes: &[u8]) -> Option<Stdio> {
    None
}
