//! What happens next, by the numbers of a schedule, and what has to hold of each answer.

use crate::replica::{Answer, Replica, Request};
use crate::world::World;
use crate::{FRAMES, STREAM};

impl World {
    /// An answer arrives, or is lost on its way.
    pub fn answer(&mut self, request: Request, answer: Answer, arrives: bool) {
        if request.ended < self.ended.len() {
            // Of what the client has ended since.
            return;
        }
        if let Answer::Born(birth) = answer {
            assert!(
                !self.ended.contains(&birth),
                "a session that was ended is opened"
            );
            if arrives && self.birth.is_none() {
                self.birth = Some(birth);
                self.promised = vec![birth];
                (self.next, self.was_lost) = ([1, 1], false);
            }
            return;
        }
        if self.birth != Some(request.birth) {
            return;
        }
        match answer {
            Answer::Born(_) => {}
            Answer::Ended if arrives => self.ended.extend(self.birth.take()),
            Answer::Ended => {}
            Answer::Tracked { state, checkpoint } => {
                assert_eq!(state[0], request.birth, "another session answers");
                if request.stream.is_none() {
                    assert_eq!(state.len(), request.number + 1, "another frame is answered");
                    assert_eq!(state[request.number], request.sender);
                }
                if self.keeps_promises() {
                    self.check_promise(request, &state, checkpoint);
                }
                if checkpoint + 1 > self.promised.len() && arrives {
                    self.promised = state[..=checkpoint].to_vec();
                }
                if arrives {
                    self.next[usize::from(request.sender)] = state.len();
                }
            }
            Answer::Expected(number) | Answer::Opened(number) => {
                if self.keeps_promises() {
                    let promised = request.promised.min(self.promised.len());
                    assert!(number >= promised, "frame {number} is asked for again");
                }
                let sender = request.sender % STREAM;
                if arrives {
                    self.next[usize::from(sender)] = number;
                }
            }
        }
    }

    /// A rival's request may bring an older copy back, after the record was lost.
    fn keeps_promises(&self) -> bool {
        !(self.was_lost && self.has_rival)
    }

    fn check_promise(&self, request: Request, state: &[u8], checkpoint: usize) {
        // What was promised when the request was sent, and what this answer promises. Of what lies between, a late answer
        // may tell what another has replaced.
        let told = request.promised.max(checkpoint + 1).min(state.len());
        let shared = told.min(self.promised.len());
        assert_eq!(
            state[..shared],
            self.promised[..shared],
            "an answer was taken back"
        );
        let promised = request.promised.min(self.promised.len());
        assert!(state.len() >= promised, "an answered frame was lost");
    }

    /// Does what the number says, if that is possible now.
    pub fn step(&mut self, choice: u16) {
        let (replica, choice) = (usize::from(choice % 2), choice / 2);
        let (pick, choice) = (usize::from(choice % 8), choice / 8);
        let is_idle = self.replicas[replica].job.is_none();
        match choice % 20 {
            0..=4 if is_idle && self.birth.is_some() => self.send(replica, pick),
            5..=8 if !self.calls.is_empty() => {
                let (replica, number, call) = self.calls.remove(pick % self.calls.len());
                let reply = self.run(call);
                self.replies.push((replica, number, reply));
            }
            9..=11 if !self.replies.is_empty() => {
                let (replica, number, reply) = self.replies.remove(pick % self.replies.len());
                if let Some((request, answer)) = self.end(replica, number, reply) {
                    self.answer(request, answer, pick != 0);
                }
            }
            // A call that was sent again by the connection arrives twice.
            12 if !self.calls.is_empty() => {
                let call = self.calls[pick % self.calls.len()].clone();
                self.calls.push(call);
            }
            // A call or its reply is lost, and the replica gives up; it goes on with the copy that it had.
            13 => self.replicas[replica].job = None,
            14 if pick < 2 && !self.replies.is_empty() => {
                self.replies.remove(pick % self.replies.len());
            }
            // The replica ends.
            15 if pick < 3 => self.replicas[replica] = Replica::default(),
            // The record's time to live is over.
            16 if pick < 2 => self.lose(),
            // That of a copy.
            17 if pick < 2 && is_idle => self.replicas[replica].copy = None,
            18 if pick < 2 && is_idle && self.birth.is_some() => self.end_session(replica),
            19 if is_idle && self.birth.is_none() => self.open_session(replica),
            _ => {}
        }
        self.forget_promises();
    }

    /// Sends a frame to a replica, or opens a stream.
    fn send(&mut self, replica: usize, pick: usize) {
        let pick = if self.has_rival { pick } else { 7 };
        if !self.has_rival {
            // No earlier request of this client is at work.
            self.replicas[1 - replica].job = None;
        }
        if pick == 2 {
            return self.open_stream(replica);
        }
        if let (3 | 4, Some(stream)) = (pick, self.replicas[replica].stream) {
            let mut request = self.request(0, 0);
            request.stream = Some(stream);
            self.begin(replica, request, 0, false, false);
            return;
        }
        // The rival comes seldom.
        let sender = u8::from(pick == 0);
        let number = self.next[usize::from(sender)];
        // A frame that was answered may come once more, late.
        let number = if pick == 1 {
            number.saturating_sub(1).max(1)
        } else {
            number
        };
        self.begin(replica, self.request(sender, number), 0, false, false);
    }

    /// The store loses the record.
    fn lose(&mut self) {
        self.was_lost |= self.store.record.take().is_some();
        self.store.newest_stream = None;
        self.drop_creates();
    }

    /// What no one has a copy of any more is lost, if the record is.
    fn forget_promises(&mut self) {
        if self.was_lost && self.store.record.is_none() {
            let longest = self.longest_copy().map_or(1, |(_, length)| length);
            self.promised.truncate(longest);
        }
    }

    /// The replica with the longest copy of the client's session, and how long it is.
    fn longest_copy(&self) -> Option<(usize, usize)> {
        let copies = self.replicas.iter().enumerate();
        let copies = copies.filter_map(|(replica, at)| {
            let copy = at.copy.as_ref()?;
            (Some(copy.state[0]) == self.birth).then_some((replica, copy.state.len()))
        });
        copies.max_by_key(|&(_, length)| length)
    }

    /// From here on nothing fails: the client alone sends frames to the replica with the longest copy, up to the last.
    pub fn finish(&mut self) {
        while let Some((_, _, call)) = self.calls.pop() {
            self.run(call);
        }
        self.replies.clear();
        let (replica, length) = self.longest_copy().unwrap_or((0, 0));
        self.replicas[1 - replica] = Replica::default();
        self.replicas[replica].job = None;
        if self.birth.is_none() {
            self.open_session(replica);
            self.settle();
        }
        let has_ended = self
            .birth
            .is_some_and(|birth| self.store.ended.contains(&birth));
        if has_ended || (self.store.record.is_none() && length < self.next[0]) {
            // Nobody has the state that the client's next frame follows, and the client is told so.
            return;
        }
        for _ in 0..20 * FRAMES {
            if self.next[0] > FRAMES {
                return;
            }
            self.begin(replica, self.request(0, self.next[0]), 0, false, false);
            self.settle();
        }
        panic!("the client does not get to the end: {:?}", self.next);
    }
}
