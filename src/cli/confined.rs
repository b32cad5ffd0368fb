//! `bagtrack confined PROGRAM …`: gives up rights, then becomes the program. `serve` starts ffmpeg in this way.
//!
//! Landlock leaves it the system's programs and libraries to read, and nothing to write; a filter of system calls
//! leaves it no sockets, and no way to look into other processes. The program's data comes through its standard input.
//! Both restrictions also hold for all processes that it starts, and cannot be taken back. Where the system lacks one
//! or both, the program runs without; `serve` warns of that at its start.

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

pub const NAME: &str = "confined";
/// The exit status where the program cannot be started, as shells have it.
const NOT_STARTED: u8 = 127;
/// Where systems keep programs and libraries.
const READABLE: [&str; 10] = [
    "/usr",
    "/bin",
    "/sbin",
    "/lib",
    "/lib32",
    "/lib64",
    "/opt",
    "/nix",
    "/etc/ld.so.cache",
    "/dev/null",
];

/// The program and its arguments.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
    command: Vec<OsString>,
}

/// Becomes the program.
#[cfg(target_os = "linux")]
pub fn run(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    use std::os::unix::process::CommandExt;
    let (program, arguments) = args.command.split_first().ok_or("no program")?;
    let path = found(Path::new(program));
    // Where the restrictions fail, `serve` has warned at its start.
    let _ = restrict(path.as_deref().and_then(Path::parent));
    // `exec` returns only where the program cannot be started.
    let _failed = Command::new(program).args(arguments).exec();
    Ok(ExitCode::from(NOT_STARTED))
}

/// On other systems no rights are given up.
#[cfg(not(target_os = "linux"))]
pub fn run(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    let (program, arguments) = args.command.split_first().ok_or("no program")?;
    let ended = Command::new(program).args(arguments).status()?;
    let code = ended.code().and_then(|code| u8::try_from(code).ok());
    Ok(ExitCode::from(code.unwrap_or(NOT_STARTED)))
}

/// The file of a program that is named by its path, or found by the variable `PATH`.
fn found(program: &Path) -> Option<PathBuf> {
    if program.components().count() > 1 {
        return program.canonicalize().ok();
    }
    let folders = std::env::var_os("PATH")?;
    let mut files = std::env::split_paths(&folders).map(|folder| folder.join(program));
    files.find_map(|file| file.canonicalize().ok())
}

/// Whether both restrictions work here. They are tried in a thread, and hold for that thread alone.
#[cfg(target_os = "linux")]
pub fn works() -> bool {
    let tried = std::thread::spawn(|| restrict(None).is_ok());
    tried.join().unwrap_or(false)
}

/// Other systems have no such restrictions.
#[cfg(not(target_os = "linux"))]
pub fn works() -> bool {
    false
}

/// Gives up the rights that a decoder does not need, for this thread. `folder` may be read too.
#[cfg(target_os = "linux")]
fn restrict(folder: Option<&Path>) -> Result<(), Box<dyn Error>> {
    let files = restrict_files(folder);
    let calls = restrict_calls();
    files.and(calls)
}

#[cfg(target_os = "linux")]
fn restrict_files(folder: Option<&Path>) -> Result<(), Box<dyn Error>> {
    use landlock::{
        ABI, Access, AccessFs, AccessNet, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetStatus,
        Scope, path_beneath_rules,
    };
    let abi = ABI::V6;
    let readable = READABLE.iter().map(Path::new).chain(folder);
    let rules = Ruleset::default()
        .handle_access(AccessFs::from_all(abi))?
        .handle_access(AccessNet::from_all(abi))?
        .scope(Scope::from_all(abi))?
        .create()?
        .add_rules(path_beneath_rules(readable, AccessFs::from_read(abi)))?;
    match rules.restrict_self()?.ruleset {
        RulesetStatus::NotEnforced => Err("the kernel has no Landlock".into()),
        RulesetStatus::FullyEnforced | RulesetStatus::PartiallyEnforced => Ok(()),
    }
}

/// Refuses the system calls that open sockets or look into other processes.
#[cfg(target_os = "linux")]
fn restrict_calls() -> Result<(), Box<dyn Error>> {
    use seccompiler::{BpfProgram, SeccompAction, SeccompFilter, apply_filter};
    let refused = [
        libc::SYS_socket,
        libc::SYS_socketpair,
        libc::SYS_ptrace,
        libc::SYS_process_vm_readv,
        libc::SYS_process_vm_writev,
        libc::SYS_pidfd_getfd,
        libc::SYS_bpf,
        libc::SYS_io_uring_setup,
        libc::SYS_mount,
        libc::SYS_unshare,
    ];
    let rules = refused.map(|call| (call, Vec::new())).into_iter().collect();
    let refusal = SeccompAction::Errno(libc::EPERM as u32);
    let architecture = std::env::consts::ARCH.try_into()?;
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, refusal, architecture)?;
    let program: BpfProgram = filter.try_into()?;
    Ok(apply_filter(&program)?)
}
