//! Two replicas with one store, a client, and its rival that sends other frames under the same numbers.

use crate::common::{self, FIRST, FLOW, place, request};
use crate::hostile::HostileStore;
use crate::pictures::{params, picture};
use bagtrack_sessions::{
    ActError, Admission, Boxes, Clock, CreationKey, Estimates, FrameBatch, FramesError, Lease,
    Owner, Registry, ReplayError, ServiceParts, Session, SessionService, SessionStore, Start,
    StreamPlace,
};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::task::JoinHandle;
use uuid::Uuid;

pub const LONG: Duration = Duration::from_secs(3600);
pub const ID: Uuid = Uuid::from_u128(1);

/// A request to a replica.
#[derive(Debug, Clone)]
pub enum Asked {
    /// A frame by its number, as the client (0) or its rival (1) sends it.
    Frame(u8, u64),
    /// The client's next frame, over the replica's stream.
    Streamed(Arc<StreamPlace>),
    OpenStream,
    /// A session with this seed.
    Open(u64),
    End,
}

/// A request, with what its client knew when it was sent.
#[derive(Debug, Clone)]
pub struct Request {
    pub asked: Asked,
    /// How many frames had been promised.
    pub promised: usize,
    /// How many sessions the client had ended or lost.
    pub ended: u64,
}

#[derive(Debug)]
pub enum Answer {
    /// The answer to a frame: the session's seed, the estimates, and the checkpoint.
    Tracked(u64, Estimates, u64),
    /// The number of the next frame.
    Expected(u64),
    /// A stream that begins with this frame.
    Opened(Arc<StreamPlace>, u64),
    /// The session with this seed is open.
    Born(u64),
    Ended,
    /// The refusal's text.
    Nothing(String),
}

pub struct Replica {
    pub service: SessionService,
    pub job: Option<JoinHandle<()>>,
    /// Whether the job opens a session.
    pub opens: bool,
    pub stream: Option<Arc<StreamPlace>>,
}

/// A replica with this store, if any.
pub fn service(store: Option<Arc<dyn SessionStore>>, store_every: u64) -> SessionService {
    service_by(Clock::default(), store, store_every)
}

/// A replica whose sessions expire by this clock.
pub fn service_by(
    clock: Clock,
    store: Option<Arc<dyn SessionStore>>,
    store_every: u64,
) -> SessionService {
    SessionService::new(parts(clock, store, store_every))
}

/// The parts of such a replica.
pub fn parts(clock: Clock, store: Option<Arc<dyn SessionStore>>, store_every: u64) -> ServiceParts {
    let lease = Lease {
        first: LONG,
        idle: LONG,
    };
    let registry = Registry::new(8, 8, lease, clock).with_eviction();
    let admission = Admission::new(64, 1, Duration::ZERO).unwrap();
    let mut parts = common::parts(registry, admission, LONG);
    (parts.store, parts.settings.store_every) = (store, store_every);
    parts
}

/// A session with this seed begins in the client's first frame.
pub fn start(seed: u64) -> Start {
    Start::Frame {
        file: picture(0, 0).into(),
        boxes: Boxes::One(FIRST),
        params: Box::new(params(seed)),
    }
}

impl Replica {
    pub fn new(store: &HostileStore, store_every: u64) -> Self {
        Self {
            service: service(Some(Arc::new(store.clone())), store_every),
            job: None,
            opens: false,
            stream: None,
        }
    }

    pub fn is_idle(&self) -> bool {
        self.job.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// The client gives its request up.
    pub async fn give_up(&mut self) {
        if let Some(job) = self.job.take() {
            job.abort();
            let _ = job.await;
        }
    }
}

/// The seed of a session, from the digest of the request that opened it.
fn seed_of(session: &Session) -> u64 {
    session.opening().request[0].into()
}

/// Sends a request to the service, and returns its answer.
pub async fn answer(service: &SessionService, asked: &Asked) -> Answer {
    match asked {
        Asked::Frame(sender, number) => {
            let batch =
                FrameBatch::posted(Some(*number), vec![picture(*sender, *number).into()], None);
            track(service, batch).await
        }
        Asked::Streamed(place) => {
            let session = match service.find(ID, &Owner::default(), FLOW).await {
                Ok(session) => session,
                Err(error) => return Answer::Nothing(error.to_string()),
            };
            let number = session.latest_frame() + 1;
            // With its number: without one, the picture might be taken as another frame, and fit no history.
            let mut batch = FrameBatch::posted(Some(number), vec![picture(0, number).into()], None);
            batch.stream = Some(place.clone());
            track(service, batch).await
        }
        Asked::OpenStream => {
            let opened = open_stream(service).await;
            opened.unwrap_or_else(|error| Answer::Nothing(error.to_string()))
        }
        Asked::Open(seed) => {
            let digest = u8::try_from(*seed).unwrap();
            let request = request(service, Some(CreationKey::Id(ID)), digest, start(*seed));
            match service.open(request).await {
                Ok(opened) => Answer::Born(seed_of(&opened.session)),
                Err(error) => Answer::Nothing(error.to_string()),
            }
        }
        Asked::End => match service.end(ID, &Owner::default(), None).await {
            Ok(()) => Answer::Ended,
            Err(error) => Answer::Nothing(error.to_string()),
        },
    }
}

async fn track(service: &SessionService, batch: FrameBatch) -> Answer {
    let session = match service.find(ID, &Owner::default(), FLOW).await {
        Ok(session) => session,
        Err(error) => return Answer::Nothing(error.to_string()),
    };
    let seed = seed_of(&session);
    let permit = match session.enter() {
        Ok(permit) => permit,
        Err(error) => return Answer::Nothing(error.to_string()),
    };
    match service.advance(permit, place(service), batch).await {
        Ok(mut tracked) => {
            let checkpoint = tracked.checkpoint.expect("there is a store");
            Answer::Tracked(seed, tracked.estimates.remove(0), checkpoint)
        }
        Err(FramesError::Replay(
            ReplayError::OutOfOrder { expected, .. } | ReplayError::Differs { expected, .. },
        )) => Answer::Expected(expected),
        Err(error) => Answer::Nothing(error.to_string()),
    }
}

async fn open_stream(service: &SessionService) -> Result<Answer, ActError> {
    let session = service.find(ID, &Owner::default(), FLOW).await?;
    let place = Arc::new(service.streams.take(ID));
    let permit = session.read_permit()?;
    let mut locked = service.fence(permit, FLOW).await?;
    place.begin(&session);
    let next = locked.state().latest_frame() + 1;
    Ok(Answer::Opened(place, next))
}

/// The answers that were given, in their order.
pub type Answers = Arc<Mutex<Vec<(usize, Request, Answer)>>>;

/// Starts a request at a replica, which adds its answer to `answers`.
pub fn begin(
    store: &HostileStore,
    answers: &Answers,
    (number, replica): (usize, &mut Replica),
    request: Request,
) {
    let (service, answers, busy) = (replica.service.clone(), answers.clone(), store.begin());
    replica.opens = matches!(request.asked, Asked::Open(_));
    replica.job = Some(tokio::spawn(async move {
        let answered = answer(&service, &request.asked).await;
        answers.lock().unwrap().push((number, request, answered));
        drop(busy);
    }));
}
