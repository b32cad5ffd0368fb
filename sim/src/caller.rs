//! A caller: it tracks objects with the real client, and keeps account of the frames that it sent and the answers that
//! it got.

use crate::chance::Chance;
use crate::faults::Rates;
use crate::journal::Journal;
use crate::network::Wire;
use crate::replay::{self, Opening, Sent};
use crate::scenes;
use crate::trace::Trace;
use bagtrack_client::{Answer, Client, ClientError, Rect, Session, Status};
use bagtrack_sessions::clock::{Instant, now, sleep, timeout};
use bytes::Bytes;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Longest time of a request.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(5);

/// A caller.
#[derive(Debug)]
pub struct Caller {
    pub name: String,
    pub client: Client,
    /// The network to the replicas, for streams; requests go through the client.
    pub wire: Wire,
    /// The probability that the frames of a session are sent over streams.
    pub streams: f64,
    pub chance: Chance,
    pub rates: Rates,
    pub trace: Trace,
    pub journal: Journal,
    /// Whether the faults of the run have ended.
    pub is_quiet: Arc<AtomicBool>,
    /// How long a session lives without a frame.
    pub idle: Duration,
}

/// A session, as its caller sees it.
#[derive(Debug, Clone)]
pub(crate) struct Account {
    pub(crate) opening: Opening,
    /// The frames up to the last one that was answered, by frame number.
    pub(crate) sent: Vec<Sent>,
    /// Other possible values of `sent`: where a stream broke, its answers do not tell which of its frames were tracked.
    pub(crate) others: Vec<Vec<Sent>>,
    /// The frames after `sent`, which have no answer yet.
    pub(crate) unanswered: Vec<Sent>,
    /// The next picture that a stream sends. Streams send no picture twice.
    pub(crate) drawn: usize,
    pub(crate) answers: Vec<(usize, String)>,
    /// When the caller last heard from the service about this session.
    pub(crate) touched: Instant,
}

/// Why a session does not go on.
pub(crate) enum Ended {
    /// It has expired, as it may after so long a pause.
    Expired,
    /// It is gone, though it cannot have expired; this says how that was noticed.
    Lost(String),
}

impl Caller {
    pub fn client(
        wire: Wire,
        http: reqwest::Client,
        addresses: &[String],
        snapshot_every: u32,
    ) -> Client {
        let mut builder = Client::builder(&addresses[0]);
        for address in &addresses[1..] {
            builder = builder.or_at(address);
        }
        builder
            .timeout(TIMEOUT)
            .retry_for(Duration::from_secs(60))
            .snapshot_every(snapshot_every)
            .http(http)
            .network(Arc::new(wire))
            .build()
            .expect("the addresses are some")
    }

    /// Tracks some objects, one after the other.
    pub async fn run(self) {
        for _ in 0..self.chance.between(1..3) {
            sleep(self.chance.millis(0..2000)).await;
            let opening = Opening {
                clip: self.chance.between(0..scenes::CLIPS),
                seed: self.chance.between(0..4),
            };
            self.follow(opening).await;
        }
        self.trace.note(format_args!("{} has done all", self.name));
    }

    async fn follow(&self, opening: Opening) {
        let first = scenes::picture(opening.clip, 0);
        let target = rect(opening.clip, 0);
        let opened = self
            .client
            .open(first, target, &replay::options(opening))
            .await;
        let session = match opened {
            Ok(session) => session,
            Err(ClientError::Refused(problem)) => {
                return self.fault(&format!("cannot open: {problem:?}"));
            }
            Err(error) if self.is_quiet() => {
                return self.fault(&format!("cannot open while all is well: {error:?}"));
            }
            Err(_) => return,
        };
        self.trace
            .note(format_args!("{} opened {}", self.name, session.id()));
        let account = Account {
            opening,
            sent: vec![sent(0)],
            others: Vec::new(),
            unanswered: Vec::new(),
            drawn: 1,
            answers: Vec::new(),
            touched: now(),
        };
        match self.chance.happens(self.streams) {
            true => self.stream(session, account).await,
            false => self.go_on(session, account).await,
        }
    }

    /// Sends some frames with requests, then ends the session or leaves it.
    async fn go_on(&self, mut session: Session, mut account: Account) {
        for _ in 0..self.chance.between(3..14) {
            if self.chance.happens(0.3) {
                sleep(self.pause()).await;
            }
            if let Err(ended) = self.act(&mut session, &mut account).await {
                return self.finish(account, Some(ended));
            }
        }
        let ended = match self.chance.happens(0.8) {
            true => self.end(session, &mut account).await.err(),
            // The session is left to expire.
            false => None,
        };
        self.finish(account, ended);
    }

    pub(crate) fn pause(&self) -> Duration {
        match self.chance.happens(0.05) {
            true => self.chance.millis(1000..50_000),
            false => self.chance.millis(0..1000),
        }
    }

    async fn act(&self, session: &mut Session, account: &mut Account) -> Result<(), Ended> {
        match self.chance.between(0..20) {
            0 => self.snapshot(session, account).await,
            1..3 => self.many(session, account).await,
            3..5 => self.correct(session, account).await,
            _ => self.track(session, account).await,
        }
    }

    async fn track(&self, session: &mut Session, account: &mut Account) -> Result<(), Ended> {
        let next = account.next();
        let picture = scenes::picture(account.opening.clip, next.picture);
        let tracked = self.patiently(session.track(picture)).await;
        self.account(
            account,
            vec![next],
            tracked.map(|told| told.map(|answer| vec![answer])),
        )
    }

    async fn many(&self, session: &mut Session, account: &mut Account) -> Result<(), Ended> {
        let first = account.next().picture;
        let next: Vec<Sent> = (first..first + self.chance.between(2..4))
            .map(sent)
            .collect();
        let pictures = next
            .iter()
            .map(|frame| scenes::picture(account.opening.clip, frame.picture));
        let pictures: Vec<Bytes> = pictures.collect();
        let tracked = self.patiently(session.track_many(pictures)).await;
        self.account(account, next, tracked)
    }

    async fn correct(&self, session: &mut Session, account: &mut Account) -> Result<(), Ended> {
        let next = Sent {
            is_correction: true,
            ..account.next()
        };
        let clip = account.opening.clip;
        let corrected = session.correct(
            scenes::picture(clip, next.picture),
            0,
            rect(clip, next.picture),
        );
        let corrected = self.patiently(corrected).await;
        self.account(
            account,
            vec![next],
            corrected.map(|told| told.map(|answer| vec![answer])),
        )
    }

    /// Opens another session from a snapshot of this one, tracks one frame in it, and ends it.
    async fn snapshot(&self, session: &mut Session, account: &mut Account) -> Result<(), Ended> {
        if !account.unanswered.is_empty() {
            return Ok(());
        }
        let bytes = match session.snapshot().await {
            Ok(bytes) => bytes,
            Err(error) => return self.refused(account, error),
        };
        let Ok(mut other) = self.client.restore(bytes).await else {
            return Ok(());
        };
        let mut copy = Account {
            touched: now(),
            answers: Vec::new(),
            ..account.clone()
        };
        // Where not each state is written to the store, the snapshot may come from a replica with an older state.
        copy.sent.truncate(other.frame() as usize + 1);
        let ended = match self.track(&mut other, &mut copy).await {
            Ok(()) => self.end(other, &mut copy).await.err(),
            Err(ended) => Some(ended),
        };
        self.finish(copy, ended);
        Ok(())
    }

    async fn end(&self, mut session: Session, account: &mut Account) -> Result<(), Ended> {
        // The answer to one more frame makes sure that all earlier frames are accounted for.
        self.track(&mut session, account).await?;
        match session.end().await {
            Ok(()) => Ok(()),
            Err(error) => self.refused(account, error),
        }
    }

    /// Waits for the answer of `call`. `None` if the caller gave up, which it does now and then.
    async fn patiently<T>(
        &self,
        call: impl Future<Output = Result<T, ClientError>>,
    ) -> Option<Result<T, ClientError>> {
        match self.rates.happens(&self.chance, self.rates.given_up) {
            true => timeout(self.chance.millis(1..600), call).await.ok(),
            false => Some(call.await),
        }
    }

    fn account(
        &self,
        account: &mut Account,
        frames: Vec<Sent>,
        told: Option<Result<Vec<Answer>, ClientError>>,
    ) -> Result<(), Ended> {
        account.unanswered.extend(frames);
        match told {
            None => Ok(()),
            Some(Ok(answers)) => {
                account.sent.append(&mut account.unanswered);
                account.touched = now();
                let last = answers.last().map(|answer| answer.frame);
                if last != Some(account.sent.len() as u64 - 1) {
                    let frames = account.sent.len();
                    self.fault(&format!("an answer to frame {last:?} of {frames}"));
                }
                let told = answers
                    .iter()
                    .map(|answer| (answer.frame as usize, text(answer)));
                account.answers.extend(told);
                Ok(())
            }
            Some(Err(error)) => self.refused(account, error),
        }
    }

    /// What an error instead of an answer means for the session: it goes on, or it has ended.
    pub(crate) fn refused(&self, account: &Account, error: ClientError) -> Result<(), Ended> {
        match error {
            ClientError::Refused(problem) if matches!(problem.status, 404 | 410) => {
                Err(self.gone(account, format!("{problem:?}")))
            }
            ClientError::Unavailable(_) | ClientError::Transport(_) if !self.is_quiet() => Ok(()),
            error => Err(Ended::Lost(format!("{error:?}"))),
        }
    }

    /// Why the service has no such session: it has expired, or it is lost, which is a fault.
    pub(crate) fn gone(&self, account: &Account, why: String) -> Ended {
        // The session's time to live began when the service answered; the caller may have heard the answer one time-out
        // later.
        match account.touched.elapsed() + TIMEOUT + Duration::from_secs(1) >= self.idle {
            true => Ended::Expired,
            false => Ended::Lost(why),
        }
    }

    /// Compares the answers with those of the tracker alone.
    pub(crate) fn finish(&self, account: Account, ended: Option<Ended>) {
        if let Some(Ended::Lost(why)) = &ended {
            self.fault(&format!("a session is gone: {why}"));
        }
        let how = match ended {
            None => "as it should",
            Some(Ended::Expired) => "since it has expired",
            Some(Ended::Lost(_)) => "too early",
        };
        let expected = replay::answers(account.opening, &account.sent);
        for (frame, answer) in &account.answers {
            if expected.get(*frame) != Some(answer) {
                let right = expected.get(*frame);
                self.fault(&format!(
                    "frame {frame} is answered with {answer}, not {right:?}"
                ));
            }
        }
        let answers = account.answers.len();
        self.trace.note(format_args!(
            "{} ends with {answers} answers, {how}",
            self.name
        ));
    }

    pub(crate) fn is_quiet(&self) -> bool {
        self.is_quiet.load(Ordering::Relaxed)
    }

    pub(crate) fn fault(&self, fault: &str) {
        self.trace
            .note(format_args!("FAULT {}: {fault}", self.name));
        self.journal.fault(format!("{}: {fault}", self.name));
    }
}

impl Account {
    fn next(&self) -> Sent {
        sent(self.sent.len() + self.unanswered.len())
    }
}

fn sent(picture: usize) -> Sent {
    Sent {
        picture,
        is_correction: false,
    }
}

pub(crate) fn rect(clip: usize, picture: usize) -> Rect {
    let target = scenes::target(clip, picture);
    Rect::from([target.x, target.y, target.width, target.height])
}

fn text(answer: &Answer) -> String {
    let rect = answer.first.rect;
    let status = match answer.first.status {
        Status::Tracking => "tracking",
        Status::Uncertain => "uncertain",
        Status::Lost => "lost",
    };
    replay::text(rect, answer.first.score, status)
}
