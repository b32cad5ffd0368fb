//! The life of a replica, which can end at any await point of its tasks.

use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use tokio::io::{AsyncRead, AsyncWrite, DuplexStream, ReadBuf};

/// The life. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Life(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    is_dead: bool,
    /// How many more polls of its tasks the replica lives, where its end is decided.
    polls_left: Option<u32>,
    wakers: Vec<Waker>,
}

/// A task of a replica. Its result is `None` if the replica has died.
pub struct Mortal<T> {
    life: Life,
    task: Option<Pin<Box<dyn Future<Output = T> + Send>>>,
}

impl Life {
    /// Ends the life now. What its tasks hold is dropped when they are next polled.
    pub fn end(&self) {
        let mut state = self.lock();
        state.is_dead = true;
        let wakers = std::mem::take(&mut state.wakers);
        drop(state);
        wakers.into_iter().for_each(Waker::wake);
    }

    /// Ends the life after so many polls of its tasks: at a random await point.
    pub fn end_after(&self, polls: u32) {
        self.lock().polls_left = Some(polls);
    }

    pub fn is_dead(&self) -> bool {
        self.lock().is_dead
    }

    /// Whether the life has ended, or its end is decided.
    pub fn is_doomed(&self) -> bool {
        let state = self.lock();
        state.is_dead || state.polls_left.is_some()
    }

    pub fn run<T>(&self, task: impl Future<Output = T> + Send + 'static) -> Mortal<T> {
        Mortal {
            life: self.clone(),
            task: Some(Box::pin(task)),
        }
    }

    /// Counts a poll of one of the tasks. False if the replica is dead.
    fn goes_on(&self, context: &Context) -> bool {
        let mut state = self.lock();
        if let Some(left) = &mut state.polls_left {
            *left = left.saturating_sub(1);
            if *left == 0 {
                drop(state);
                self.end();
                return false;
            }
        }
        if state.is_dead {
            return false;
        }
        if !state
            .wakers
            .iter()
            .any(|waker| waker.will_wake(context.waker()))
        {
            state.wakers.push(context.waker().clone());
        }
        true
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Future for Mortal<T> {
    type Output = Option<T>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context) -> Poll<Option<T>> {
        if !self.life.goes_on(context) {
            self.task = None;
        }
        match &mut self.task {
            None => Poll::Ready(None),
            Some(task) => task.as_mut().poll(context).map(Some),
        }
    }
}

/// The replica's end of a connection, which fails once the replica has died.
#[derive(Debug)]
pub struct MortalStream {
    life: Life,
    line: DuplexStream,
}

impl MortalStream {
    pub fn new(life: Life, line: DuplexStream) -> Self {
        Self { life, line }
    }

    fn alive(&mut self, context: &Context) -> io::Result<Pin<&mut DuplexStream>> {
        match self.life.goes_on(context) {
            true => Ok(Pin::new(&mut self.line)),
            false => Err(io::ErrorKind::ConnectionAborted.into()),
        }
    }
}

impl AsyncRead for MortalStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context,
        buffer: &mut ReadBuf,
    ) -> Poll<io::Result<()>> {
        self.alive(context)?.poll_read(context, buffer)
    }
}

impl AsyncWrite for MortalStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.alive(context)?.poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context) -> Poll<io::Result<()>> {
        self.alive(context)?.poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context) -> Poll<io::Result<()>> {
        self.alive(context)?.poll_shutdown(context)
    }
}
