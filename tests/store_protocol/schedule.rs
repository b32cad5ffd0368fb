//! What happens next, by the numbers of a schedule, and what has to hold of each answer.

use crate::replica::{Answer, Replica, Request};
use crate::world::World;
use crate::{FRAMES, STREAM};

impl World {
    /// An answer arrives, or is lost on its way.
    pub fn answer(&mut self, request: Request, answer: Answer, arrives: bool) {
        match answer {
            Answer::Tracked { state, checkpoint } => {
                // What was promised when the request was sent, and what this answer promises. Of what lies between, a late
                // answer may tell what another has replaced.
                let told = request.promised.max(checkpoint + 1).min(state.len());
                let shared = told.min(self.promised.len());
                assert_eq!(
                    state[..shared],
                    self.promised[..shared],
                    "an answer was taken back"
                );
                assert!(
                    state.len() >= request.promised,
                    "an answered frame was lost"
                );
                if checkpoint + 1 > self.promised.len() && arrives {
                    self.promised = state[..=checkpoint].to_vec();
                }
                if arrives {
                    self.next[usize::from(request.sender)] = state.len();
                }
            }
            Answer::Expected(number) | Answer::Opened(number) => {
                assert!(
                    number >= request.promised,
                    "frame {number} is asked for again"
                );
                let sender = request.sender % STREAM;
                if arrives {
                    self.next[usize::from(sender)] = number;
                }
            }
        }
    }

    /// Does what the number says, if that is possible now.
    pub fn step(&mut self, choice: u16) {
        let (replica, choice) = (usize::from(choice % 2), choice / 2);
        let (pick, choice) = (usize::from(choice % 8), choice / 8);
        match choice % 16 {
            0..=4 if self.replicas[replica].job.is_none() => {
                if pick == 2 {
                    return self.open_stream(replica);
                }
                if let (3 | 4, Some(stream)) = (pick, self.replicas[replica].stream) {
                    let mut request = self.request(0, 0);
                    request.stream = Some(stream);
                    return self.begin(replica, request, 0);
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
                self.begin(replica, self.request(sender, number), 0);
            }
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
            _ => {}
        }
    }

    /// From here on nothing fails: the client alone sends frames to one replica, up to the last.
    pub fn finish(&mut self) {
        for call in std::mem::take(&mut self.calls) {
            self.run(call.2);
        }
        self.replies.clear();
        self.replicas[1] = Replica::default();
        self.replicas[0].job = None;
        for _ in 0..20 * FRAMES {
            if self.next[0] > FRAMES {
                return;
            }
            self.begin(0, self.request(0, self.next[0]), 0);
            while let Some((replica, number, call)) = self.calls.pop() {
                let reply = self.run(call);
                if let Some((request, answer)) = self.end(replica, number, reply) {
                    self.answer(request, answer, true);
                }
            }
        }
        panic!("the client does not get to the end: {:?}", self.next);
    }
}
