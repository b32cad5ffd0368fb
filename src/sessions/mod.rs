//! The live sessions: a map of them, and everything that keeps them safe from each other.
//!
//! What could go wrong: one slow client holding up the others, two requests stepping one tracker at once,
//! work that outlives the request that asked for it, sessions that nobody ends. So: the map's lock is
//! never held during work ([`Registry`]); a session has its own lock, taken in order of arrival and by a
//! bounded number of requests ([`Session`]); work is admitted in two steps and keeps its permits until it
//! has really ended ([`Admission`]); work on a thread that has others to serve is brief ([`rested`]); idle sessions
//! expire ([`Clock`]).

mod admission;
mod clock;
mod envelope;
mod here;
mod registry;
mod replay;
mod session;
mod workers;

pub use admission::{Admission, QueueFull, QueuePermit, WorkLost};
pub use clock::Clock;
pub use envelope::{EnvelopeError, MAGIC as SNAPSHOT_MAGIC};
pub use here::rested;
pub use registry::{Full, Registry};
pub use replay::{Answered, Fingerprint, ReplayError, Turn};
pub use session::{Busy, Closed, Locked, Place, Session, State};
