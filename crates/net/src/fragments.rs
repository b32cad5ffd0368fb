//! The bytes of a WebSocket connection, with the client's messages in small fragments, and their memory charged.
//!
//! tungstenite allocates room for a whole frame when the frame's head has come (docs/upstream/tungstenite.md), and
//! keeps the room for the next frame. So a few bytes, or one large message, would hold memory for the life of a stream.
//! This wrapper therefore gives the library each frame in fragments (RFC 6455, section 5.4): the library's buffer holds
//! one fragment, and the message grows as it arrives. A fragment is handed over once its memory is charged. While there
//! is none, nothing more is read from the client. The same holds for a client whose streams send more frames a second
//! than it may, since the smallest frames cost next to no bytes. Each fragment counts as work of its task, so that
//! other tasks get their turn.

use crate::LeastRate;
use arrayvec::ArrayVec;
use bagtrack_sessions::clock::{self, Sleep, sleep_until};
use bagtrack_sessions::{Budget, BudgetFull, Charge};
use bytes::{Buf, BytesMut};
use governor::DefaultDirectRateLimiter;
use governor::clock::{Clock, DefaultClock};
use std::future::poll_fn;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::task::coop::poll_proceed;

/// The limiter of the frames of WebSockets that a client may send.
pub type MessageRate = DefaultDirectRateLimiter;

/// Most bytes of a fragment: a multiple of the mask's four bytes, so each fragment begins with the mask's first byte.
const FRAGMENT: usize = 16 << 10;
const READ_BYTES: usize = 32 << 10;
/// While the buffer of a message grows, the message may be in memory twice.
const COPIES: usize = 2;
/// How long to wait before memory is asked for again.
const RETRY: Duration = Duration::from_millis(20);

/// The part of its message's time that each frame uses up. Otherwise a message of empty frames would never end where
/// the service is slower than the client.
const FRAME_TIME: Duration = Duration::from_micros(100);
/// Shortest wait for the frame rate: a shorter timer would cost more than the frames that it delays.
const LEAST_WAIT: Duration = Duration::from_millis(5);

/// Bit of a frame's first byte: this frame is the last of its message.
const FINAL: u8 = 0x80;
const OPCODE: u8 = 0x0F;
/// Frames of this opcode and above control the connection.
const CONTROL: u8 = 8;
/// Bits of a frame's second byte.
const MASKED: u8 = 0x80;
const LENGTH: u8 = 0x7F;

/// The message came more slowly than it may.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the message is too slow")]
pub struct MessageTooSlow;

/// A frame of the client, of which a part is still to be handed over.
#[derive(Debug)]
struct Frame {
    /// The first byte of its head.
    first: u8,
    mask: Option<[u8; 4]>,
    left: u64,
}

/// The least and greatest rates at which messages may come.
#[derive(Debug)]
pub struct Rates {
    /// Least bytes a second.
    pub bytes: LeastRate,
    /// The time that a whole message may take; each byte of payload pays some of it back.
    pub message: LeastRate,
    /// Most frames a second, for all streams of the client.
    pub messages: Arc<MessageRate>,
}

/// A connection whose incoming frames are fragments.
#[derive(Debug)]
pub struct Fragments<S> {
    stream: S,
    /// Bytes that were read and not handed over.
    input: BytesMut,
    frame: Option<Frame>,
    /// The part of the next fragment's head that is still to be handed over; `fragment_left` bytes of payload follow
    /// it.
    head: ArrayVec<u8, 8>,
    fragment_left: usize,
    budgets: [Budget; 2],
    /// The memory of the message that arrives.
    charge: Charge,
    /// How many frames the client may send.
    messages: Arc<MessageRate>,
    retry: Pin<Box<Sleep>>,
    rate: LeastRate,
    /// The time left for the whole message.
    deadline: LeastRate,
    /// Whether a message has begun and not ended.
    is_within: bool,
    is_heard: bool,
}

impl<S> Fragments<S> {
    /// Wraps a connection from which `read` was read already. `budgets` are those of all clients and of this one, to
    /// which messages are charged.
    pub fn new(stream: S, read: &[u8], budgets: [Budget; 2], rates: Rates) -> Self {
        let charge = Charge::new(&budgets[0], &budgets[1]);
        Self {
            stream,
            input: BytesMut::from(read),
            frame: None,
            head: ArrayVec::new(),
            fragment_left: 0,
            budgets,
            charge,
            messages: rates.messages,
            retry: Box::pin(sleep_until(clock::now())),
            rate: rates.bytes,
            deadline: rates.message,
            is_within: false,
            is_heard: false,
        }
    }

    /// The charge of the message that has just been read.
    pub fn take_charge(&mut self) -> Charge {
        let next = Charge::new(&self.budgets[0], &self.budgets[1]);
        std::mem::replace(&mut self.charge, next)
    }

    /// Whether the client has sent anything since the last call.
    pub fn take_heard(&mut self) -> bool {
        std::mem::take(&mut self.is_heard)
    }

    /// Stops the clocks of the rates: the service does not read for a while.
    pub fn pause(&mut self) {
        self.deadline.pause();
        self.rate.pause();
    }

    /// Whether the client owes the rest of a message.
    fn is_message_begun(&self) -> bool {
        self.is_within || self.fragment_left > 0 || !self.input.is_empty()
    }

    /// Where the head of the next frame has come, waits until the rate lets the client send one more. The wait uses up
    /// the time of a message that has begun: otherwise a message of empty frames would never end.
    ///
    /// # Errors
    /// The message is too slow.
    fn poll_frame_rate(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), MessageTooSlow>> {
        if self.frame.is_some() || self.input.len() < 2 {
            return Poll::Ready(Ok(()));
        }
        let Err(early) = self.messages.check() else {
            let has_time = self.deadline.spend(FRAME_TIME) || !self.is_within;
            return Poll::Ready(has_time.then_some(()).ok_or(MessageTooSlow));
        };
        self.rate.pause();
        if self.is_within && self.deadline.poll_late(cx).is_ready() {
            return Poll::Ready(Err(MessageTooSlow));
        }
        let wait = early.wait_time_from(DefaultClock::default().now());
        self.retry
            .as_mut()
            .reset(clock::now() + wait.max(LEAST_WAIT));
        let _ = self.retry.as_mut().poll(cx);
        Poll::Pending
    }

    /// Makes the next fragment from the bytes that were read. False where there is no frame's head yet.
    ///
    /// # Errors
    /// A budget has no room for the fragment.
    fn begin_fragment(&mut self) -> Result<bool, BudgetFull> {
        if self.frame.is_none() {
            self.frame = take_head(&mut self.input);
        }
        let Some(frame) = &mut self.frame else {
            return Ok(false);
        };
        let length = frame.left.min(FRAGMENT as u64) as usize;
        let is_data = frame.first & OPCODE < CONTROL;
        if is_data {
            self.charge.grow(COPIES * length)?;
        }
        frame.left -= length as u64;
        let is_last = frame.left == 0;
        // Only the last fragment of the last frame ends a message.
        let first = if is_last {
            frame.first
        } else {
            frame.first & !FINAL
        };
        let mask = frame.mask.map_or(0, |_| MASKED);
        self.head.push(first);
        match u8::try_from(length) {
            Ok(short) if short < 126 => self.head.push(mask | short),
            _ => {
                self.head.push(mask | 126);
                let length = u16::try_from(length).expect("a fragment is short");
                self.head.extend(length.to_be_bytes());
            }
        }
        self.head.extend(frame.mask.into_iter().flatten());
        self.fragment_left = length;
        if is_data {
            if !self.is_within {
                self.deadline.reset();
            }
            // Only payload pays time back, and heads do not.
            self.deadline.moved(length);
            self.is_within = !is_last || frame.first & FINAL == 0;
        }
        // Further fragments of this frame are continuations (opcode 0).
        frame.first &= !OPCODE;
        if is_last {
            self.frame = None;
        }
        Ok(true)
    }
}

/// The head of the next frame, where all of it was read.
fn take_head(input: &mut BytesMut) -> Option<Frame> {
    let [first, second] = *input.first_chunk()?;
    let extended = match second & LENGTH {
        126 => 2,
        127 => 8,
        _ => 0,
    };
    let masked = if second & MASKED == 0 { 0 } else { 4 };
    if input.len() < 2 + extended + masked {
        return None;
    }
    input.advance(2);
    let left = match extended {
        2 => input.get_u16().into(),
        8 => input.get_u64(),
        _ => u64::from(second & LENGTH),
    };
    let mask = (masked > 0).then(|| input.get_u32().to_be_bytes());
    Some(Frame { first, mask, left })
}

impl<S: AsyncRead + Unpin> Fragments<S> {
    /// Reads more bytes. False at the end of the stream.
    fn poll_input(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<bool>> {
        let mut bytes = [0; READ_BYTES];
        let mut buffer = ReadBuf::new(&mut bytes);
        match Pin::new(&mut self.stream).poll_read(cx, &mut buffer) {
            Poll::Ready(read) => {
                read?;
                self.rate.moved(buffer.filled().len());
                self.deadline.pause();
                self.input.extend_from_slice(buffer.filled());
                self.is_heard |= !buffer.filled().is_empty();
                Poll::Ready(Ok(!buffer.filled().is_empty()))
            }
            Poll::Pending if self.is_message_begun() => {
                let is_late = self.rate.poll_late(cx).is_ready();
                match self.deadline.poll_late(cx).is_ready() || is_late {
                    true => Poll::Ready(Err(io::Error::other(MessageTooSlow))),
                    false => Poll::Pending,
                }
            }
            Poll::Pending => Poll::Pending,
        }
    }

    /// Reads until the client has closed its side, and drops the bytes.
    pub async fn discard(&mut self) {
        poll_fn(|cx| {
            loop {
                let mut bytes = [0; 4096];
                let mut buffer = ReadBuf::new(&mut bytes);
                let read = ready!(Pin::new(&mut self.stream).poll_read(cx, &mut buffer));
                if read.is_err() || buffer.filled().is_empty() {
                    return Poll::Ready(());
                }
            }
        })
        .await;
    }

    /// Waits before memory is asked for again. An error where the client's time at the least rate is over.
    fn poll_memory(&mut self, cx: &mut Context<'_>, full: BudgetFull) -> Poll<io::Error> {
        if self.rate.poll_late(cx).is_ready() {
            return Poll::Ready(io::Error::other(full));
        }
        self.retry.as_mut().reset(clock::now() + RETRY);
        let _ = self.retry.as_mut().poll(cx);
        Poll::Pending
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Fragments<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        loop {
            if !self.head.is_empty() {
                let count = self.head.len().min(buffer.remaining());
                buffer.put_slice(&self.head[..count]);
                self.head.drain(..count);
                return Poll::Ready(Ok(()));
            }
            let count = self.fragment_left.min(self.input.len());
            if count > 0 {
                let count = count.min(buffer.remaining());
                buffer.put_slice(&self.input[..count]);
                self.input.advance(count);
                self.fragment_left -= count;
                return Poll::Ready(Ok(()));
            }
            if self.fragment_left == 0 {
                ready!(self.poll_frame_rate(cx)).map_err(io::Error::other)?;
                ready!(poll_proceed(cx)).made_progress();
                match self.begin_fragment() {
                    Ok(true) => continue,
                    Ok(false) => {}
                    Err(full) => {
                        return self.poll_memory(cx, full).map(Err);
                    }
                }
            }
            if !ready!(self.poll_input(cx))? {
                return Poll::Ready(Ok(()));
            }
        }
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Fragments<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
