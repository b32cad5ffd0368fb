//! Faults that a simulation must find. They exist only in builds with the feature `planted-faults`, and a thread has
//! one at a time.

/// A fault of the code. Some faults are in the scripts for a Redis alone.
#[cfg_attr(not(feature = "redis"), allow(dead_code))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlantedFault {
    /// A frame is answered before the store has it.
    AnswersBeforeCommit,
    /// A call to the store without answer counts as done.
    TakesSilenceForConsent,
    /// A frame that the store did not take stays in memory.
    KeepsUncommitted,
    /// The store takes a frame whatever its last frame is.
    CommitsOutOfOrder,
    /// A replica that takes a record over takes its version, and keeps its own state.
    GoesOnWithOldState,
    /// The answer names a checkpoint that is not written.
    TellsEarlyCheckpoint,
    /// A session that is opened again overwrites its record.
    OpensTwice,
    /// The format of a record is not written.
    ForgetsFormat,
    /// Records have no time to live.
    LivesForEver,
    /// A frame that is sent again is tracked again.
    TracksTwice,
    /// A request whose client has gone keeps its place in the queue.
    KeepsPlace,
    /// A stream begins, and another replica still goes on from its own copy.
    BeginsWithoutFence,
}

impl PlantedFault {
    /// All of them.
    #[cfg(feature = "planted-faults")]
    pub const ALL: [Self; 12] = [
        Self::AnswersBeforeCommit,
        Self::TakesSilenceForConsent,
        Self::KeepsUncommitted,
        Self::CommitsOutOfOrder,
        Self::GoesOnWithOldState,
        Self::TellsEarlyCheckpoint,
        Self::OpensTwice,
        Self::ForgetsFormat,
        Self::LivesForEver,
        Self::TracksTwice,
        Self::KeepsPlace,
        Self::BeginsWithoutFence,
    ];

    /// Whether this fault is planted in this thread.
    #[cfg(feature = "planted-faults")]
    pub(crate) fn is_here(self) -> bool {
        HERE.get() == Some(self)
    }

    /// Without the feature no thread has a fault.
    #[cfg(not(feature = "planted-faults"))]
    pub(crate) const fn is_here(self) -> bool {
        false
    }
}

#[cfg(feature = "planted-faults")]
thread_local! {
    static HERE: std::cell::Cell<Option<PlantedFault>> = const { std::cell::Cell::new(None) };
}

/// Gives this thread a fault, or none, from now on.
#[cfg(feature = "planted-faults")]
pub fn plant(fault: Option<PlantedFault>) {
    HERE.set(fault);
}
