//! The protocol between replicas and their store, as a model: a store that delays, drops and repeats, two replicas that
//! end at any moment, and a client and its rival that send different frames under the same numbers.
//!
//! The rules are those of `src/sessions/store/` and `src/http/advance_session.rs`. A state is the list of the frames
//! that made it, so two states are equal exactly if all boxes are. A schedule is a list of random numbers, each of
//! which picks the next event among those that are possible.
//!
//! Frames come with numbers, or over a stream without. A stream that is opened begins a new generation of the record.
//!
//! What has to hold: a frame is accepted only after the one that it was tracked after; a stream tracks no frame after a
//! newer one was opened; an answer that says `Checkpoint: N` is never taken back up to frame N, neither by the answer to
//! a later request, nor by another that says so of other frames, nor by a 409 to a later request that asks for an
//! earlier frame; and without failures the client gets to the end.

mod replica;
mod schedule;
mod store;
mod world;

use proptest::prelude::*;
use world::World;

/// A frame: who sent it, the client (0) or its rival (1). Its number is its place in the state.
type State = Vec<u8>;

const FRAMES: usize = 8;
/// What opens a stream is sent by no one who sends frames.
const STREAM: u8 = 2;

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn nothing_that_was_promised_is_taken_back(
        every in 1_usize..4,
        schedule in prop::collection::vec(any::<u16>(), 0..250),
    ) {
        let mut world = World::new(every);
        for choice in schedule {
            world.step(choice);
        }
        world.finish();
    }
}
