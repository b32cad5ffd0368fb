//! SIGINT (Ctrl-C) and SIGTERM while a command works: it ends after the frame at hand, and closes its files.

use signal_hook::consts::{SIGINT, SIGTERM};
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
    /// What the system says.
    pub fn listen() -> io::Result<Self> {
        let came = Arc::new(AtomicUsize::new(0));
        let is_second = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // They act in this order.
            flag::register_conditional_default(signal, is_second.clone())?;
            flag::register(signal, is_second.clone())?;
            flag::register_usize(signal, came.clone(), signal.unsigned_abs() as usize)?;
        }
        Ok(Self(came))
    }

    /// Whether a signal came.
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
