//! Follows objects through frames with a [bagtrack](https://docs.rs/bagtrack) service.
//!
//! ```no_run
//! use bagtrack_client::{Client, OpenOptions, Rect};
//!
//! # async fn run(frames: Vec<Vec<u8>>) -> Result<(), bagtrack_client::ClientError> {
//! let client = Client::new("http://127.0.0.1:8080")?;
//! let mut frames = frames.into_iter();
//! let first = frames.next().expect("a first frame: the bytes of a JPEG, PNG or WebP file");
//! let target = Rect { x: 44.1, y: 101.4, width: 46.1, height: 57.6 };
//! let mut session = client.open(first, target, &OpenOptions::new().seed(1)).await?;
//! for frame in frames {
//!     let answer = session.track(frame).await?;
//!     println!("{}: {} ({:.2})", answer.frame, answer.first.rect, answer.first.score);
//! }
//! session.end().await
//! # }
//! ```
//!
//! `examples/follow.rs` follows an object through a folder of frames.
//!
//! # What happens when something fails
//!
//! Every frame is sent with its number, so that it can be sent again and is tracked once.
//!
//! | what happens | what a session does |
//! |---|---|
//! | the line breaks, or 408, 429, 502, 503, 504 | sends the frame again, for [`ClientBuilder::retry_for`] |
//! | 409 with `expected_frame` | sends the frames from there on again, or opens the session again where they are not kept |
//! | the session is gone (404, 410) | opens it again from the last snapshot or first frame, sends the frames after it |
//! | `Draining: true` | takes a snapshot and goes on at the next address, or through the same one |
//! | any other refusal | [`ClientError::Refused`]; the session is as it was |
//! | no good answer for `retry_for` | [`ClientError::Unavailable`] or [`ClientError::Transport`] |
//!
//! `docs/PROTOCOL.md` has the details, which are those of the Python and the JavaScript client. So the boxes are the
//! same as if nothing had happened. A snapshot is taken every [`ClientBuilder::snapshot_every`] frames, and the frames
//! since then are kept. A service with a store says what it has (`Checkpoint`), and no snapshots are taken then.
//! Without a store, replicas and restarts need common snapshot keys.
//!
//! A frame without an answer, because of the last row or because the call was dropped, is kept: the next call sends it
//! before its own frame. Do not send it again.
//!
//! # HTTPS
//!
//! The crate brings no TLS. With a feature like `rustls` of reqwest 0.13 in your own manifest, `https://` works.

mod backoff;
mod client;
mod error;
mod kept;
mod network;
mod options;
mod remote;
mod session;
mod transport;
mod upload;

pub use bagtrack_api::{
    Answer, PresetName as Preset, ProblemDocument as Problem, Rect, Status, TargetView,
};
pub use client::{Client, ClientBuilder};
pub use error::ClientError;
pub use network::Network;
pub use options::{OpenOptions, Targets};
pub use session::Session;
