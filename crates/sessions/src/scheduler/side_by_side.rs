//! The parts of one request's work, side by side: on the thread that has it, and on workers that are idle.
//!
//! Each thread takes the next part until none is left. So a thread that comes late, or has to leave, delays no part but
//! the one that it works on.

use super::executor::CpuClock;
use crate::sync::{Condvar, Mutex, PoisonError, lock};
use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::Duration;

/// A part after its step, with the step's result and processor time; a part that was not begun has none.
pub(super) type Outcome<T, R> = (T, Option<(R, Duration)>);

/// The parts, for all threads that work on them.
pub(super) struct Parts<T, R, F> {
    step: F,
    cpu: CpuClock,
    state: Mutex<State<T, R>>,
    /// Notified when a thread has ended its part.
    ended: Condvar,
}

struct State<T, R> {
    waiting: VecDeque<(usize, T)>,
    /// How many parts are being worked on.
    begun: usize,
    done: Vec<(usize, Outcome<T, R>)>,
    panic: Option<Box<dyn Any + Send>>,
}

impl<T, R, F: Fn(&mut T) -> R> Parts<T, R, F> {
    /// `step` is to be done to each of `parts`; `cpu` measures its processor time.
    pub(super) fn new(parts: Vec<T>, step: F, cpu: CpuClock) -> Self {
        let state = State {
            done: Vec::with_capacity(parts.len()),
            waiting: parts.into_iter().enumerate().collect(),
            begun: 0,
            panic: None,
        };
        Self {
            step,
            cpu,
            state: Mutex::new(state),
            ended: Condvar::new(),
        }
    }

    /// Works on the next part, and returns its processor time; `None` where no part is left.
    pub(super) fn work(&self) -> Option<Duration> {
        let (number, mut part) = {
            let mut state = lock(&self.state);
            let next = state.waiting.pop_front()?;
            state.begun += 1;
            next
        };
        let before = self.cpu.now();
        let outcome = catch_unwind(AssertUnwindSafe(|| (self.step)(&mut part)));
        let time = self.cpu.now().saturating_sub(before);
        let mut state = lock(&self.state);
        state.begun -= 1;
        match outcome {
            Ok(result) => state.done.push((number, (part, Some((result, time))))),
            Err(panic) => {
                state.waiting.clear();
                state.panic = Some(panic);
            }
        }
        self.ended.notify_all();
        Some(time)
    }

    /// Waits until no part is worked on, and takes all parts back in their order. Parts that wait are not begun any
    /// more.
    ///
    /// # Panics
    /// With the panic of a step.
    pub(super) fn end(&self) -> Vec<Outcome<T, R>> {
        let mut state = lock(&self.state);
        let left = std::mem::take(&mut state.waiting);
        while state.begun > 0 {
            state = self
                .ended
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if let Some(panic) = state.panic.take() {
            drop(state);
            resume_unwind(panic);
        }
        let mut all = std::mem::take(&mut state.done);
        all.extend(
            left.into_iter()
                .map(|(number, part)| (number, (part, None))),
        );
        all.sort_unstable_by_key(|(number, _)| *number);
        all.into_iter().map(|(_, outcome)| outcome).collect()
    }
}
