//! How a stream ends, and what its client is told.

use crate::http::problems::problem::Problem;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

/// The close code for a problem is this and the problem's HTTP status.
const OF_STATUS: u16 = 4000;
/// Another stream took the session's place. 409 is the HTTP status of a conflict.
const REPLACED: u16 = OF_STATUS + 409;

/// Why a stream ends.
#[derive(Debug)]
pub enum End {
    Closed,
    Gone,
    /// The client has not answered a ping.
    Silent,
    Shutdown,
    /// A newer stream of the session took its place.
    Replaced,
    /// The stream cannot go on: the session has ended, the token is no longer good, or a message cannot be read.
    Problem(Problem),
}

impl End {
    /// The reason, for the log and the close frame.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::Closed => "the client closed it",
            Self::Gone => "the client has gone",
            Self::Silent => "the client is silent",
            Self::Shutdown => "the service ends",
            Self::Replaced => "a newer stream took its place",
            Self::Problem(problem) => problem.kind().slug(),
        }
    }

    /// The close frame, where the client still reads and has not closed first.
    pub fn close_frame(&self) -> Option<CloseFrame> {
        let code = match self {
            Self::Closed | Self::Gone | Self::Silent => return None,
            Self::Shutdown => CloseCode::Away.into(),
            Self::Replaced => REPLACED,
            Self::Problem(problem) => OF_STATUS + problem.kind().status(),
        };
        Some(CloseFrame {
            code: code.into(),
            reason: self.reason().into(),
        })
    }
}
