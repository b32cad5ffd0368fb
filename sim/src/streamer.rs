//! A caller that sends frames over streams, as a camera does. Where the connection breaks it opens another stream,
//! takes the stored answers, and goes on with a new picture. Its frames have no numbers, so the service must track no
//! frame of an old stream once the new stream has told the session's next frame.

use crate::caller::{Account, Caller, Ended, TIMEOUT, rect};
use crate::journal::Given;
use crate::network;
use crate::replay::{self, Sent};
use crate::scenes;
use bagtrack_client::Session;
use bagtrack_sessions::clock::{now, sleep, timeout};
use futures_util::{SinkExt, StreamExt};
use serde_json::Value;
use std::time::Duration;
use tokio::io::DuplexStream;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async};

/// How long opening a stream is tried.
const PATIENCE: Duration = Duration::from_secs(60);

type Socket = WebSocketStream<DuplexStream>;

/// Why the caller leaves a stream.
enum Left {
    /// The stream broke; another one may go on with the session.
    Broken,
    /// The service no longer has the session.
    Gone(String),
}

impl Caller {
    /// Sends frames over some streams, one after the other, and ends the session.
    pub(crate) async fn stream(&self, session: Session, mut account: Account) {
        let (id, mut ended) = (session.id().to_string(), Ok(()));
        // The old sockets that are kept open: a phone that changes its network does not close its connections.
        let mut left = Vec::new();
        for _ in 0..self.chance.between(1..6) {
            match self.one_stream(&id, &mut account).await {
                Ok(socket) => left.extend(socket.filter(|_| self.chance.happens(0.5))),
                Err(why) => {
                    ended = Err(why);
                    break;
                }
            }
        }
        account.choose();
        if ended.is_ok() {
            // Frames that are on their way when the session ends get no answer.
            account.unanswered.clear();
            ended = match session.end().await {
                Ok(()) => Ok(()),
                Err(error) => self.refused(&account, error),
            };
        }
        self.finish(account, ended.err());
    }

    /// Opens a stream and exchanges frames over it; leaves it with some frames on their way, or when it breaks. Returns
    /// the socket, if the stream was opened.
    async fn one_stream(
        &self,
        session: &str,
        account: &mut Account,
    ) -> Result<Option<Socket>, Ended> {
        let Some(mut socket) = self.open_stream(session, account).await? else {
            return Ok(None);
        };
        for _ in 0..self.chance.between(1..8) {
            if self.chance.happens(0.3) {
                sleep(self.pause()).await;
            }
            match self.exchange(session, &mut socket, account).await {
                Ok(()) => {}
                Err(Left::Broken) => {
                    // The service closes a stream whose caller has been silent for long: that is no fault.
                    if self.is_quiet() && account.touched.elapsed() < TIMEOUT {
                        self.fault("a stream breaks while all is well");
                    }
                    return Ok(Some(socket));
                }
                Err(Left::Gone(why)) => return Err(self.gone(account, why)),
            }
        }
        for _ in 0..self.chance.between(0..4) {
            let _ = self.send(&mut socket, account).await;
        }
        Ok(Some(socket))
    }

    /// Sends some frames, and waits for their answers.
    async fn exchange(
        &self,
        session: &str,
        socket: &mut Socket,
        account: &mut Account,
    ) -> Result<(), Left> {
        let frames = self.chance.between(1..4);
        for _ in 0..frames {
            self.send(socket, account).await?;
        }
        let patience = match self.rates.happens(&self.chance, self.rates.given_up) {
            true => self.chance.millis(1..600),
            false => TIMEOUT,
        };
        for _ in 0..frames {
            let answer = message(socket, patience).await?;
            if answer["frame"].is_null() {
                return Err(refusal(&answer));
            }
            let frame = account.unanswered.remove(0);
            account.push(frame);
            account.touched = now();
            self.answered(session, account, account.sent.len() - 1, &answer);
        }
        Ok(())
    }

    async fn send(&self, socket: &mut Socket, account: &mut Account) -> Result<(), Left> {
        let frame = Sent {
            is_correction: self.chance.happens(0.1),
            picture: account.drawn,
        };
        account.drawn += 1;
        let clip = account.opening.clip;
        if frame.is_correction {
            let target = rect(clip, frame.picture);
            let sides = [target.x, target.y, target.width, target.height];
            let header = serde_json::json!({ "box": sides }).to_string();
            let sent = socket.feed(Message::text(header)).await;
            sent.map_err(|_| Left::Broken)?;
        }
        account.unanswered.push(frame);
        let picture = Message::binary(scenes::picture(clip, frame.picture));
        let sent = timeout(TIMEOUT, socket.send(picture)).await;
        match sent {
            Ok(Ok(())) => Ok(()),
            _ => Err(Left::Broken),
        }
    }

    /// Opens a stream, and takes the stored answers to frames that an earlier stream sent. `None` if no stream could be
    /// opened within [`PATIENCE`] while there are faults.
    async fn open_stream(
        &self,
        session: &str,
        account: &mut Account,
    ) -> Result<Option<Socket>, Ended> {
        let begun = now();
        while begun.elapsed() < PATIENCE {
            let opened = match timeout(TIMEOUT, self.handshake(session, account)).await {
                Ok(Ok(socket)) => self.take_up(session, socket, account).await,
                Ok(Err(left)) => Err(left),
                Err(_) => Err(Left::Broken),
            };
            match opened {
                Ok(socket) => return Ok(Some(socket)),
                Err(Left::Broken) => sleep(self.chance.millis(50..1000)).await,
                Err(Left::Gone(why)) => return Err(self.gone(account, why)),
            }
        }
        match self.is_quiet() {
            true => Err(Ended::Lost("no stream can be opened".to_owned())),
            false => Ok(None),
        }
    }

    async fn handshake(&self, session: &str, account: &Account) -> Result<Socket, Left> {
        let line = self.wire.connect().ok_or(Left::Broken)?;
        let from = account.sent.len();
        let url = format!("ws://localhost/sessions/{session}/stream?from={from}");
        match client_async(url, line).await {
            Ok((socket, _)) => Ok(socket),
            Err(Error::Http(answer)) => {
                let status = answer.status().as_u16();
                self.trace
                    .note(format_args!("{}: no stream, {status}", self.name));
                match status {
                    404 | 410 => Err(Left::Gone(status.to_string())),
                    _ => Err(Left::Broken),
                }
            }
            Err(_) => Err(Left::Broken),
        }
    }

    /// Reads the service's greeting: the number of the next frame, then the stored answers that the caller lacks.
    /// Frames of an earlier stream that are not among them were not tracked, and never will be.
    async fn take_up(
        &self,
        session: &str,
        mut socket: Socket,
        account: &mut Account,
    ) -> Result<Socket, Left> {
        let hello = message(&mut socket, TIMEOUT).await?;
        let next = hello["next"].as_u64().ok_or_else(|| refusal(&hello))?;
        self.trace
            .note(format_args!("{}: a stream from {next}", self.name));
        let mut stored = Vec::new();
        for _ in account.sent.len() as u64..next {
            stored.push(message(&mut socket, TIMEOUT).await?);
        }
        let texts: Vec<String> = stored.iter().map(network::text).collect();
        if !account.take(&texts) {
            let of = account.unanswered.len();
            self.fault(&format!("{of} frames have the answers {texts:?}"));
            return Err(Left::Gone("it has other frames".to_owned()));
        }
        let first = account.sent.len() - stored.len();
        for (index, answer) in stored.iter().enumerate() {
            self.answered(session, account, first + index, answer);
        }
        Ok(socket)
    }

    /// Checks and journals the answer to a frame.
    fn answered(&self, session: &str, account: &mut Account, frame: usize, answer: &Value) {
        let told = answer["frame"].as_u64();
        if told != Some(frame as u64) {
            self.fault(&format!("a stream answers frame {told:?}, not {frame}"));
        }
        let text = network::text(answer);
        self.trace
            .note(format_args!("{}: streamed {frame}", self.name));
        let given = Given {
            session: session.to_string(),
            frame: frame as u64,
            sent: frame as u64,
            answer: text.clone(),
            checkpoint: answer["checkpoint"].as_u64(),
        };
        self.journal.answered(given, true, true);
        account.answers.push((frame, text));
    }
}

impl Account {
    fn push(&mut self, frame: Sent) {
        self.sent.push(frame);
        self.others.iter_mut().for_each(|sent| sent.push(frame));
    }

    /// Finds which of the unanswered frames were tracked: as many as there are answers, and such that the tracker gives
    /// these answers. Several choices may fit, because two pictures may have the same answer; all are kept. False if
    /// none fits.
    fn take(&mut self, answers: &[String]) -> bool {
        let unanswered = std::mem::take(&mut self.unanswered);
        let others = std::mem::take(&mut self.others);
        let before = std::iter::once(&self.sent).chain(&others);
        // All subsets of the unanswered frames of one stream; there are few frames.
        let choices: Vec<Vec<Sent>> = (0..1_u32 << unanswered.len())
            .filter(|chosen| chosen.count_ones() as usize == answers.len())
            .map(|chosen| {
                let all = unanswered.iter().enumerate();
                let chosen = all.filter(|(index, _)| chosen >> index & 1 == 1);
                chosen.map(|(_, frame)| *frame).collect()
            })
            .collect();
        let possible = before.flat_map(|sent| {
            let with = |chosen: &Vec<Sent>| [sent.as_slice(), chosen.as_slice()].concat();
            choices.iter().map(with)
        });
        let first = self.sent.len();
        let mut possible = possible
            .filter(|frames| replay::answers(self.opening, frames)[first..] == *answers)
            .collect::<Vec<Vec<Sent>>>()
            .into_iter();
        let Some(sent) = possible.next() else {
            self.unanswered = unanswered;
            return false;
        };
        (self.sent, self.others) = (sent, possible.collect());
        true
    }

    /// Sets `sent` to the possible sequence of frames that fits all answers, if one of `others` does.
    fn choose(&mut self) {
        let has_all = |sent: &Vec<Sent>| {
            let expected = replay::answers(self.opening, sent);
            let mut answers = self.answers.iter();
            answers.all(|(frame, answer)| expected.get(*frame) == Some(answer))
        };
        if let Some(right) = self.others.iter().position(has_all) {
            self.sent = self.others.swap_remove(right);
        }
    }
}

async fn message(socket: &mut Socket, patience: Duration) -> Result<Value, Left> {
    loop {
        match timeout(patience, socket.next()).await {
            Ok(Some(Ok(Message::Text(text)))) => {
                return serde_json::from_str(&text).map_err(|_| Left::Broken);
            }
            Ok(Some(Ok(Message::Close(Some(frame))))) => {
                return Err(match frame.code.into() {
                    code @ (4404 | 4410_u16) => Left::Gone(code.to_string()),
                    _ => Left::Broken,
                });
            }
            Ok(Some(Ok(_))) => {}
            Ok(None | Some(Err(_))) | Err(_) => return Err(Left::Broken),
        }
    }
}

/// What a problem document in place of an answer means for the stream.
fn refusal(problem: &Value) -> Left {
    match problem["status"].as_u64() {
        Some(404 | 410) => Left::Gone(problem.to_string()),
        _ => Left::Broken,
    }
}
