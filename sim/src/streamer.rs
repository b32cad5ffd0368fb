//! A caller that sends frames over a stream, as a camera does: where the line breaks it opens another stream, takes the
//! stored answers, and goes on with a new picture. Its frames have no numbers, so none may come from an old stream once
//! the new one has told where the session stands.

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

/// How long a stream is tried to be opened.
const PATIENCE: Duration = Duration::from_secs(60);

type Socket = WebSocketStream<DuplexStream>;

/// Why a stream is left.
enum Left {
    /// For another one.
    Broken,
    /// With its session.
    Gone(String),
}

impl Caller {
    /// Sends frames over some streams, one after the other, and ends the session.
    pub(crate) async fn stream(&self, session: Session, mut account: Account) {
        let (id, mut ended) = (session.id().to_string(), Ok(()));
        // A phone that comes into another network tells nobody: its old connections stay.
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
            // What is on its way when the session ends has no answer.
            account.unanswered.clear();
            ended = match session.end().await {
                Ok(()) => Ok(()),
                Err(error) => self.refused(&account, error),
            };
        }
        self.finish(account, ended.err());
    }

    /// The stream is left with some frames on their way, or where its line breaks.
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
                    // One whose caller does not read for long is taken for silent.
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

    /// Opens a stream, and takes the answers to frames that a stream before it sent. None where that cannot be had for
    /// some time.
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

    /// The service tells where the session stands, and the answers to frames whose answers did not come. Those which it
    /// does not tell it has not tracked, and never will.
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

    /// A frame has this answer.
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

    /// As many of the frames without an answer were tracked, and have these answers. Two pictures may have the same
    /// one, so several choices may have them. Whether there is any.
    fn take(&mut self, answers: &[String]) -> bool {
        let unanswered = std::mem::take(&mut self.unanswered);
        let others = std::mem::take(&mut self.others);
        let before = std::iter::once(&self.sent).chain(&others);
        // They are few: those of one stream.
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

    /// Of what may have been sent, takes what has all answers that came.
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

/// What a problem document means.
fn refusal(problem: &Value) -> Left {
    match problem["status"].as_u64() {
        Some(404 | 410) => Left::Gone(problem.to_string()),
        _ => Left::Broken,
    }
}
