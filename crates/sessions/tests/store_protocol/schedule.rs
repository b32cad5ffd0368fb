//! Random schedules: each number of a list says what happens next, and each answer is checked.
//!
//! What has to hold: an answer is that of some history of frames, and belongs to the frame that was sent; an answer
//! that says `Checkpoint: N` is never taken back up to frame N, neither by the answer to a later request, nor by a 409
//! to a later request that asks for an earlier frame; a session that was ended does not come back, and answers nothing
//! that is sent to another one with its id; and without failures the client gets to the end.

use crate::hostile::HostileStore;
use crate::memory::Records;
use crate::pictures::{FRAMES, History, histories};
use crate::records::{Backend, InFolder};
use crate::world::{Answer, Answers, Asked, ID, Replica, Request, begin};
use proptest::prelude::*;

/// Most sessions that the client opens one after the other.
const MAX_SESSIONS: u64 = 3;

struct World {
    store: HostileStore,
    every: u64,
    has_rival: bool,
    replicas: [Replica; 2],
    answers: Answers,
    /// The number of the frame that the client and its rival send next.
    next: [u64; 2],
    /// Whether the client has a session; its seed is the number of those before it.
    is_open: bool,
    /// How many sessions the client has ended or lost.
    ended: u64,
    /// The longest history up to a checkpoint that an answer has told.
    promised: History,
    /// Why the last request was refused, for the message of a failed test.
    last_refusal: String,
}

impl World {
    async fn new(store: HostileStore, every: u64, has_rival: bool) -> Self {
        let replica = || Replica::new(&store, every);
        let mut world = Self {
            replicas: [replica(), replica()],
            store,
            every,
            has_rival,
            answers: Answers::default(),
            next: [1, 1],
            is_open: false,
            ended: 0,
            promised: Vec::new(),
            last_refusal: String::new(),
        };
        world.finish_asking(0, Asked::Open(0)).await;
        assert!(world.is_open);
        world
    }

    async fn ask(&mut self, replica: usize, asked: Asked) {
        let request = Request {
            asked,
            promised: self.promised.len(),
            ended: self.ended,
        };
        let at = (replica, &mut self.replicas[replica]);
        begin(&self.store, &self.answers, at, request);
        self.store.settles().await;
    }

    /// Sends a request, and lets the store answer all calls.
    async fn finish_asking(&mut self, replica: usize, asked: Asked) {
        self.ask(replica, asked).await;
        self.settle().await;
    }

    /// All calls are done, and all replies arrive.
    async fn settle(&mut self) {
        loop {
            if self.store.calls() > 0 {
                self.run_call(0).await;
            } else if self.store.replies() > 0 {
                self.store.deliver(0, true);
                self.store.settles().await;
            } else {
                break;
            }
        }
        self.take_answers(true);
    }

    fn take_answers(&mut self, arrives: bool) {
        let answers = std::mem::take(&mut *self.answers.lock().unwrap());
        for (replica, request, answer) in answers {
            self.take(replica, &request, answer, arrives);
        }
    }

    /// An answer arrives, or is lost on its way.
    fn take(&mut self, replica: usize, request: &Request, answer: Answer, arrives: bool) {
        if let Answer::Opened(place, _) = &answer {
            self.replicas[replica].stream = Some(place.clone());
        }
        if request.ended < self.ended {
            // The answer is of a session that the client has ended since.
            return;
        }
        match answer {
            Answer::Nothing(reason) => self.last_refusal = reason,
            Answer::Born(seed) => {
                assert_eq!(seed, self.ended, "a session that was ended is opened");
                if arrives && !self.is_open {
                    (self.is_open, self.next) = (true, [1, 1]);
                }
            }
            Answer::Ended if arrives => self.end(),
            Answer::Ended => {}
            Answer::Tracked(seed, estimates, checkpoint) => {
                assert_eq!(seed, self.ended, "another session answers");
                let mut histories = histories(seed, &estimates);
                let frame = estimates.first().frame;
                let mut sender = 0;
                if let Asked::Frame(by, number) = request.asked {
                    assert_eq!(frame, number, "another frame is answered");
                    histories.retain(|history| history.last() == Some(&by));
                    sender = usize::from(by);
                }
                let checkpoint = checkpoint as usize;
                let keeps = |history: &History| self.keeps_promises(request, history, checkpoint);
                let found = histories.iter().find(|history| keeps(history));
                let promised = &self.promised;
                let message = format!("{request:?} after {promised:?}: {histories:?}");
                let history = found.expect(&message).clone();
                if arrives {
                    self.next[sender] = frame + 1;
                    // A stored answer says nothing about the frames after its own.
                    let told = checkpoint.min(history.len());
                    if told > self.promised.len() {
                        self.promised = history[..told].to_vec();
                    }
                }
            }
            Answer::Expected(next) | Answer::Opened(_, next) => {
                let promised = request.promised.min(self.promised.len());
                let promised = promised as u64;
                assert!(
                    next > promised,
                    "frame {next} of {promised} is asked for again"
                );
                let sender = match request.asked {
                    Asked::Frame(sender, _) => usize::from(sender),
                    _ => 0,
                };
                if arrives {
                    self.next[sender] = next;
                }
            }
        }
    }

    /// Whether an answer with this history takes back no frame that was promised.
    fn keeps_promises(&self, request: &Request, history: &[u8], checkpoint: usize) -> bool {
        // Compares up to what was promised when the request was sent, or what this answer promises. Between the two, a
        // late answer may tell frames that others have replaced.
        let told = request.promised.max(checkpoint).min(history.len());
        let shared = told.min(self.promised.len());
        let mut promised = request.promised.min(self.promised.len());
        if let Asked::Frame(_, number) = request.asked {
            // An earlier frame gets its stored answer.
            promised = promised.min(number as usize);
        }
        history[..shared] == self.promised[..shared] && history.len() >= promised
    }

    /// The client's session has gone.
    fn end(&mut self) {
        self.is_open = false;
        self.ended += 1;
        self.promised.clear();
        self.store.drop_creates();
    }

    /// The store does a call.
    async fn run_call(&mut self, pick: usize) {
        let had = self.store.has(ID);
        self.store.run(pick);
        if had && !self.store.has(ID) {
            // The client waits only for the answer that the session has ended, and for no opening of it.
            self.give_openings_up().await;
        }
    }

    /// The client gives up its requests that would open a session which has ended meanwhile.
    async fn give_openings_up(&mut self) {
        for replica in &mut self.replicas {
            if replica.opens {
                replica.give_up().await;
            }
        }
        self.store.drop_creates();
        self.store.settles().await;
    }

    /// Does the step of this number, if it is possible now.
    async fn step(&mut self, choice: u16) {
        let before = self.ended;
        let (replica, choice) = (usize::from(choice % 2), choice / 2);
        let (pick, choice) = (usize::from(choice % 8), choice / 8);
        let is_idle = self.replicas[replica].is_idle();
        let (calls, replies) = (self.store.calls(), self.store.replies());
        match choice % 20 {
            0..=4 if is_idle && self.is_open => self.send(replica, pick).await,
            5..=8 if calls > 0 => self.run_call(pick % calls).await,
            9..=11 if replies > 0 => self.store.deliver(pick % replies, true),
            // A call that was sent again by the connection arrives twice.
            12 if calls > 0 => self.store.repeat(pick % calls),
            // The client gives its request up.
            13 => self.replicas[replica].give_up().await,
            // A reply or a call is lost, and the replica is told that the store is away.
            14 if pick < 2 && replies > 0 => self.store.deliver(pick % replies, false),
            14 if pick == 2 && calls > 0 => self.store.lose_call(pick % calls),
            // The replica ends.
            15 if pick < 3 => {
                self.replicas[replica].give_up().await;
                self.replicas[replica] = Replica::new(&self.store, self.every);
            }
            // The store loses the record: the session is gone.
            16 if pick < 2 && self.is_open && self.ended + 1 < MAX_SESSIONS => {
                self.store.forget();
                self.end();
            }
            17 if pick == 0 => self.store.restart(),
            18 if pick < 2 && is_idle && self.is_open && self.ended + 1 < MAX_SESSIONS => {
                self.ask(replica, Asked::End).await;
            }
            19 if is_idle && !self.is_open => {
                self.ask(replica, Asked::Open(self.ended)).await;
            }
            _ => {}
        }
        self.store.settles().await;
        // Some answers are lost on their way.
        self.take_answers(pick != 0);
        if self.ended > before {
            self.give_openings_up().await;
        }
    }

    /// Sends a frame to a replica, or opens a stream.
    async fn send(&mut self, replica: usize, pick: usize) {
        let pick = if self.has_rival { pick } else { pick.max(2) };
        if !self.has_rival {
            // No earlier request of this client is at work.
            self.replicas[1 - replica].give_up().await;
        }
        let asked = match (pick, &self.replicas[replica].stream) {
            (2, _) => Asked::OpenStream,
            (3 | 4, Some(place)) => Asked::Streamed(place.clone()),
            // The rival comes seldom; a frame that was answered may come once more, late.
            (0, _) => Asked::Frame(1, self.next[1]),
            (1, _) => Asked::Frame(0, self.next[0].saturating_sub(1).max(1)),
            _ => Asked::Frame(0, self.next[0]),
        };
        match asked {
            Asked::Frame(_, number) if number > FRAMES => {}
            Asked::Streamed(_) if self.next[0] >= FRAMES => {}
            asked => self.ask(replica, asked).await,
        }
    }

    /// From here on nothing fails: the client alone sends frames, up to the last.
    async fn finish(&mut self) {
        for replica in &mut self.replicas {
            replica.give_up().await;
        }
        while self.store.calls() > 0 {
            self.run_call(0).await;
        }
        while self.store.replies() > 0 {
            self.store.deliver(0, false);
        }
        self.store.settles().await;
        if self.is_open && !self.store.has(ID) {
            // The session was ended, but the answer to the client was lost.
            self.end();
        }
        for attempt in 0..20 * FRAMES as usize {
            if self.next[0] > FRAMES {
                return;
            }
            let asked = match self.is_open {
                true => Asked::Frame(0, self.next[0]),
                false => Asked::Open(self.ended),
            };
            // If states are stored at checkpoints only, a session has to stay at one replica to get on.
            let replica = if self.every == 1 { attempt % 2 } else { 0 };
            self.finish_asking(replica, asked).await;
        }
        let Self {
            next, last_refusal, ..
        } = self;
        panic!("the client does not get to the end: {next:?}, {last_refusal}");
    }
}

/// How many schedules are tried; `BAGTRACK_SCHEDULES` sets another number.
fn cases(default: u32) -> ProptestConfig {
    let given = std::env::var("BAGTRACK_SCHEDULES").ok();
    ProptestConfig {
        cases: given.and_then(|text| text.parse().ok()).unwrap_or(default),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn current_thread() -> tokio::runtime::Runtime {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    runtime.unwrap()
}

/// Runs a schedule to its end.
fn run(records: impl Backend + 'static, every: u64, has_rival: bool, schedule: Vec<u16>) {
    current_thread().block_on(async {
        let mut world = World::new(HostileStore::new(records), every, has_rival).await;
        for choice in schedule {
            world.step(choice).await;
        }
        world.finish().await;
    });
}

proptest! {
    #![proptest_config(cases(500))]
    #[test]
    fn nothing_that_was_promised_is_taken_back(
        every in 1_u64..4,
        has_rival in any::<bool>(),
        schedule in prop::collection::vec(any::<u16>(), 0..200),
    ) {
        run(Records::default(), every, has_rival, schedule);
    }
}

proptest! {
    #![proptest_config(cases(40))]
    #[test]
    fn a_store_in_a_folder_takes_nothing_back(
        every in 1_u64..4,
        has_rival in any::<bool>(),
        schedule in prop::collection::vec(any::<u16>(), 0..200),
    ) {
        run(InFolder::default(), every, has_rival, schedule);
    }
}

#[test]
fn an_opening_whose_session_ends_is_given_up() {
    current_thread().block_on(async {
        let mut world = World::new(HostileStore::new(Records::default()), 1, false).await;
        world.finish_asking(0, Asked::End).await;
        // One replica is about to create the session, and another has created it and ends it.
        world.ask(0, Asked::Open(1)).await;
        world.store.run(0);
        world.store.deliver(0, true);
        world.store.settles().await;
        for asked in [Asked::Open(1), Asked::End] {
            world.ask(1, asked).await;
            while world.store.calls() > 1 {
                world.store.run(1);
                world.store.deliver(0, true);
                world.store.settles().await;
            }
            world.take_answers(true);
        }
        assert_eq!((world.ended, world.store.calls()), (2, 0));
        world.give_openings_up().await;
        world.finish().await;
    });
}

#[test]
fn an_opening_is_not_done_after_the_end_of_its_session() {
    let failed = [
        52416, 9584, 21200, 30397, 63120, 28970, 16400, 35026, 11984, 59491, 4562, 38480, 33748,
    ];
    run(Records::default(), 1, false, failed.to_vec());
}
