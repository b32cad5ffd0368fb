//! SIGINT (Ctrl-C), SIGTERM and SIGHUP (a terminal or a line that closes) while a command works: it ends after the
//! frame at hand, and closes its files.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The signal that came, if one did.
#[derive(Debug)]
pub struct Interrupt(Arc<AtomicUsize>);

impl Interrupt {
    /// Begins to listen. A second signal ends the process at once.
    ///
    /// # Errors
    /// The system refuses to register a signal.
    pub fn listen() -> io::Result<Self> {
        let came = Arc::new(AtomicUsize::new(0));
        let is_second = Arc::new(AtomicBool::new(false));
        let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
            // The handlers run in this order: the first signal sets the flag that makes the second one end the process.
            flag::register_conditional_default(signal, is_second.clone())?;
            flag::register(signal, is_second.clone())?;
            flag::register_usize(signal, came.clone(), signal.unsigned_abs() as usize)?;
        }
        Ok(Self(came))
    }

    pub fn came(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }

    /// The exit status: 0, or 128 and the signal's number, as shells have it.
    pub fn exit_code(&self) -> ExitCode {
        match u8::try_from(self.0.load(Ordering::Relaxed)) {
            Ok(0) => ExitCode::SUCCESS,
            Ok(signal) => ExitCode::from(128 + signal),
            Err(_) => ExitCode::FAILURE,
        }
    }
}

/// Whether the program was started with this signal ignored, as `nohup` does with SIGHUP; false where the system does
/// not tell.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
