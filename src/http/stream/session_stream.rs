//! A stream from its first message to its end: reads frames, sends answers, pings.

use super::end::End;
use super::frame_work::{Done, FrameWork};
use super::message;
use super::upgrade::Socket;
use super::waiting::ArrivedFrame;
use crate::http::extract::instance::Instance;
use crate::http::problems::problem::Problem;
use crate::http::respond::answer::stream_answer;
use axum::body::Bytes;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_api::{FrameHeader, Hello, StreamAnswer};
use bagtrack_net::{ConnectionHold, MessageTooSlow};
use bagtrack_sessions::clock::{self, MissedTickBehavior, interval_at, timeout};
use bagtrack_sessions::{BudgetFull, Charge, ChargedBytes, Estimates};
use futures_util::stream::FusedStream;
use futures_util::{SinkExt, StreamExt};
use serde::Serialize;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio_tungstenite::tungstenite::error::ProtocolError;
use tokio_tungstenite::tungstenite::{Error, Message};

/// Time for a client to answer the close.
const CLOSING: Duration = Duration::from_secs(2);

/// Where a session stands when a stream is opened.
#[derive(Debug)]
pub struct Stand {
    /// The number of the next frame.
    pub next: u64,
    /// The stored answers that the client asked for.
    pub stored: Vec<Estimates>,
    /// The last frame whose state is in the store.
    pub checkpoint: Option<u64>,
}

pub struct SessionStream {
    /// What the stream's frames have in common.
    pub work: Arc<FrameWork>,
    /// The connection that the stream took over.
    pub connection: ConnectionHold,
    /// The place among the client's streams.
    pub permit: Charge,
    pub stand: Stand,
    /// The path and the id of the request that opened the stream, for problem documents.
    pub instance: Instance,
}

type Answering = Pin<Box<dyn Future<Output = Option<Done>> + Send>>;

/// What the log tells of a stream.
#[derive(Debug, Default)]
struct Counts {
    answered: u64,
    skipped: u64,
    refused: u64,
}

impl SessionStream {
    /// Serves the stream until it ends.
    pub async fn run(mut self, mut socket: Socket) {
        self.connection.activity().stream();
        let started = clock::now();
        let mut counts = Counts::default();
        let mut cut_off = self.connection.clone();
        let end = tokio::select! {
            biased;
            () = cut_off.cut_off() => return tracing::warn!("stream cut off"),
            end = self.serve(&mut socket, &mut counts) => end,
        };
        let Counts {
            answered,
            skipped,
            refused,
        } = counts;
        let seconds = started.elapsed().as_secs_f64();
        let reason = end.reason();
        tracing::info!(answered, skipped, refused, seconds, reason, "stream ended");
        let _ = timeout(CLOSING, self.close(socket, end)).await;
    }

    async fn serve(&mut self, socket: &mut Socket, counts: &mut Counts) -> End {
        match self.exchange(socket, counts).await {
            Ok(end) => end,
            // An error here means that the client cannot be written to.
            Err(_) => End::Gone,
        }
    }

    async fn exchange(&mut self, socket: &mut Socket, counts: &mut Counts) -> Result<End, Error> {
        self.greet(socket).await?;
        let work = self.work.clone();
        let mut header = Ok(FrameHeader::default());
        let mut answering: Option<Answering> = None;
        let period = work.state.config.limits.ping_interval;
        let mut pings = interval_at(clock::now() + period, period);
        // After a late tick, too, a client has a whole period to answer the ping.
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (mut is_heard, mut is_ending) = (true, false);
        loop {
            if answering.is_none() && !work.waiting().is_empty() {
                answering = Some(Box::pin(work.clone().answer_next()));
            }
            if answering.is_none() && is_ending {
                return Ok(End::Shutdown);
            }
            let may_come = !is_ending && !work.waiting().is_full();
            if !may_come {
                socket.get_mut().pause();
            }
            // Tried in this order, so that a client that sends all the time holds up nothing else.
            tokio::select! {
                biased;
                () = self.connection.ending(), if !is_ending => is_ending = true,
                () = work.place.replaced() => return Ok(End::Replaced),
                done = wait_for(&mut answering) => {
                    answering = None;
                    let Some(done) = done else { continue };
                    if let Some(end) = self.deliver(socket, done, counts).await? {
                        return Ok(end);
                    }
                }
                message = socket.next(), if may_come => {
                    is_heard = true;
                    if let Some(end) = self.read(socket, message, &mut header) {
                        return Ok(end);
                    }
                }
                _ = pings.tick() => {
                    // A frame at work has the session, and asks the store itself. It is not polled in this branch, so
                    // waiting for the session would never end.
                    if answering.is_none() && let Some(end) = self.check_newest().await {
                        return Ok(end);
                    }
                    // While nothing is read, nothing can be heard.
                    is_heard |= socket.get_mut().take_heard();
                    if !is_heard && may_come {
                        return Ok(End::Silent);
                    }
                    is_heard = false;
                    socket.send(Message::Ping(Bytes::new())).await?;
                }
            }
        }
    }

    /// Why the stream ends, if its session, its key or token, or its place has ended.
    async fn check_newest(&self) -> Option<End> {
        match self.work.check_newest().await {
            Err(problem) if ends_stream(problem.kind()) => Some(End::Problem(problem)),
            _ => self.work.place.is_replaced().then_some(End::Replaced),
        }
    }

    /// Sends the number of the next frame, and the stored answers that were asked for.
    async fn greet(&mut self, socket: &mut Socket) -> Result<(), Error> {
        let next = self.stand.next;
        self.send(socket, &Hello { next }).await?;
        for estimates in std::mem::take(&mut self.stand.stored) {
            let answer = StreamAnswer {
                replayed: true,
                checkpoint: self.stand.checkpoint,
                draining: self.work.state.is_draining(),
                ..stream_answer(&estimates, None)
            };
            self.send(socket, &answer).await?;
        }
        Ok(())
    }

    /// Takes a message; tells whether it ends the stream. `header` is what was said of the next frame.
    fn read(
        &self,
        socket: &mut Socket,
        message: Option<Result<Message, Error>>,
        header: &mut Result<FrameHeader, Problem>,
    ) -> Option<End> {
        match message {
            None => return Some(End::Gone),
            Some(Ok(Message::Close(_))) => return Some(End::Closed),
            Some(Ok(Message::Text(text))) => {
                drop(socket.get_mut().take_charge());
                if text.len() > message::MAX_TEXT_BYTES {
                    self.work.waiting().push(Err(message::too_long()));
                    return None;
                }
                let earlier = std::mem::replace(header, Ok(FrameHeader::default()));
                let merged = |earlier| message::merged(earlier, message::parse(&text)?);
                *header = earlier.and_then(merged);
            }
            Some(Ok(Message::Binary(file))) => {
                let header = std::mem::replace(header, Ok(FrameHeader::default()));
                let charge = socket.get_mut().take_charge();
                let arrived = header.map(|header| self.arrived(header, file, charge));
                self.work.waiting().push(arrived);
            }
            Some(Ok(_)) => {}
            Some(Err(error)) => return Some(unreadable(&error)),
        }
        None
    }

    /// Sends what came of a frame; tells whether it ends the stream.
    async fn deliver(
        &mut self,
        socket: &mut Socket,
        Done { answer, skipped }: Done,
        counts: &mut Counts,
    ) -> Result<Option<End>, Error> {
        if self.work.place.is_replaced() {
            return Ok(Some(End::Replaced));
        }
        counts.skipped += skipped;
        match answer {
            Ok(answer) => {
                counts.answered += 1;
                let answer = StreamAnswer {
                    skipped,
                    draining: self.work.state.is_draining(),
                    ..answer
                };
                self.send(socket, &answer).await?;
            }
            Err(problem) if ends_stream(problem.kind()) => return Ok(Some(End::Problem(problem))),
            Err(problem) => {
                counts.refused += 1;
                // Only the first is logged: a client may cause thousands a second.
                let document = match counts.refused {
                    1 => self.instance.report(&self.work.state, &problem),
                    _ => self.instance.count(&self.work.state, &problem),
                };
                self.send(socket, &document).await?;
            }
        }
        Ok(None)
    }

    /// A frame, whose file holds the charge for its memory.
    fn arrived(&self, header: FrameHeader, file: Bytes, charge: Charge) -> ArrivedFrame {
        let received = &self.work.state.metrics.received_bytes;
        received.increment(file.len() as u64);
        let file = ChargedBytes::new(file, charge).into();
        ArrivedFrame { header, file }
    }

    async fn send(&self, socket: &mut Socket, message: &impl Serialize) -> Result<(), Error> {
        let text = serde_json::to_string(message).map_err(io::Error::other)?;
        let sent = &self.work.state.metrics.sent_bytes;
        sent.increment(text.len() as u64);
        socket.send(Message::text(text)).await
    }

    async fn send_problem(&self, socket: &mut Socket, problem: &Problem) -> Result<(), Error> {
        let document = self.instance.report(&self.work.state, problem);
        self.send(socket, &document).await
    }

    /// Tells the client why the stream ends, and waits until the client has closed it, too: otherwise the client's
    /// system might throw away what the client has not read.
    async fn close(self, mut socket: Socket, end: End) {
        if let End::Problem(problem) = &end {
            let _ = self.send_problem(&mut socket, problem).await;
        }
        let Some(frame) = end.close_frame() else {
            if matches!(end, End::Closed) {
                // The close of the client is answered when the next message is asked for.
                while let Some(Ok(_)) = socket.next().await {}
            }
            return;
        };
        let is_readable = !socket.is_terminated();
        if socket.send(Message::Close(Some(frame))).await.is_ok() {
            match is_readable {
                true => while let Some(Ok(_)) = socket.next().await {},
                false => socket.get_mut().discard().await,
            }
        }
        drop(self.permit);
    }
}

/// Why the stream ends when a message cannot be read.
fn unreadable(error: &Error) -> End {
    let problem = match error {
        // The client's connection ended without a close frame.
        Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => return End::Gone,
        Error::Io(error) => match error.get_ref() {
            Some(cause) if cause.is::<MessageTooSlow>() => Problem::body_timeout(),
            Some(cause) => match cause.downcast_ref::<BudgetFull>() {
                Some(full) => (*full).into(),
                None => return End::Gone,
            },
            None => return End::Gone,
        },
        error => Problem::malformed(format!("The message cannot be read: {error}.")),
    };
    End::Problem(problem)
}

/// Whether nothing can be tracked after this problem.
fn ends_stream(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::SessionNotFound | Kind::SessionExpired | Kind::Unauthorized | Kind::Internal
    )
}

/// Waits for the frame at work; without one, for ever.
async fn wait_for(answering: &mut Option<Answering>) -> Option<Done> {
    match answering {
        Some(answering) => answering.await,
        None => std::future::pending().await,
    }
}
