//! The protocol between replicas and their store, as a model: a store that delays, drops, repeats and forgets, two
//! replicas that end at any moment, and a client and its rival that send different frames under the same numbers.
//!
//! The rules are those of `src/sessions/store/` and `src/http/advance_session.rs`. A state is the list of what made it:
//! the session's birth, then its frames. So two states are equal exactly if all boxes are. A schedule is a list of random
//! numbers, each of which picks the next event among those that are possible.
//!
//! Frames come with numbers, or over a stream without. A stream that is opened begins a new generation of the record. The
//! client ends its session and opens another one under the same id. The record is lost: its time to live was over, since
//! the store was out of reach. A copy in memory goes when its own time is over.
//!
//! What has to hold: a frame is accepted only after the one that it was tracked after, and gets the number that it was
//! sent with; a stream tracks no frame after a newer one was opened; an answer that says `Checkpoint: N` is never taken
//! back up to frame N, neither by the answer to a later request, nor by another that says so of other frames, nor by a 409
//! to a later request that asks for an earlier frame; a session that was ended does not come back, and answers nothing
//! that is sent to another one with its id; and without failures the client gets to the end.
//!
//! Where the record was lost, a promise holds as long as a copy of its state is left, for a client that has no rival and
//! no two requests at work at once. What makes a record is not on its way for so long that one that was there is lost or
//! ended meanwhile.

mod replica;
mod replies;
mod schedule;
mod store;
mod world;

use proptest::prelude::*;
use world::World;

/// The session's birth, then for each frame who sent it: the client (0) or its rival (1). The number of a frame is its
/// place in the state.
type State = Vec<u8>;

const FRAMES: usize = 8;
/// What opens a stream is sent by no one who sends frames.
const STREAM: u8 = 2;
/// The birth of the first session; no number of a sender.
const FIRST_BIRTH: u8 = 10;
/// What opens or ends a session.
const SESSION: u8 = 4;

proptest! {
    #![proptest_config(ProptestConfig { cases: 20000, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn nothing_that_was_promised_is_taken_back(
        every in 1_usize..4,
        has_rival in any::<bool>(),
        schedule in prop::collection::vec(any::<u16>(), 0..250),
    ) {
        let mut world = World::new(every, has_rival);
        for choice in schedule {
            world.step(choice);
        }
        world.finish();
    }
}
