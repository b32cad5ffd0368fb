//! What each client may use: sessions, requests and frames in a time, and work at once.
//!
//! In: the [`Client`] of a request. Out: the client's [`Account`], which gives a permit for the request, or an error
//! that names the quota ([`QuotaExhausted`](bagtrack_sessions::QuotaExhausted), [`RateExceeded`]).
//!
//! What can go wrong: a client changes its address to count as new. IPv6 addresses count by their network, and the
//! table of clients is bounded.

#![warn(clippy::disallowed_methods)]

mod account;
mod clients;
mod rates;
mod sessions;
mod video_places;

pub use account::{Account, RequestPermit};
pub use clients::{Client, Clients, Holdings};
pub use rates::RateExceeded;
pub use sessions::ClientSessions;
pub use video_places::VideoPlaces;
