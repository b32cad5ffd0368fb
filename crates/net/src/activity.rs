//! What a connection is doing: shared by its stream, its service and the table of connections.

use axum::body::{Body, Bytes, HttpBody};
use axum::response::Response;
use bagtrack_sessions::clock::{self, Instant};
use http_body::{Frame, SizeHint};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::sync::Notify;

/// The fixed moment from which this module counts time.
static START: LazyLock<Instant> = LazyLock::new(clock::now);

const IDLE: u8 = 0;
const RECEIVING: u8 = 1;
const ANSWERING: u8 = 2;

/// What one connection is doing.
#[derive(Debug)]
pub struct Activity {
    state: AtomicU8,
    /// Nanoseconds from [`START`] to when the connection became idle.
    idle_since: AtomicU64,
    /// Whether a stream has taken the connection over.
    streams: AtomicBool,
    /// Notified when the connection is to end.
    pub shed: Notify,
    /// Notified when the connection has become idle.
    idle: Arc<Notify>,
}

impl Activity {
    /// A new connection is idle. `idle` is notified each time that it becomes idle.
    pub fn new(idle: Arc<Notify>) -> Arc<Self> {
        let activity = Self {
            state: AtomicU8::new(IDLE),
            idle_since: AtomicU64::new(0),
            streams: AtomicBool::new(false),
            shed: Notify::new(),
            idle,
        };
        activity.note_idle();
        Arc::new(activity)
    }

    fn note_idle(&self) {
        let now = u64::try_from(START.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.idle_since.store(now, Ordering::Relaxed);
        self.state.store(IDLE, Ordering::Release);
        self.idle.notify_one();
    }

    /// When the connection became idle, as the time since a fixed moment; `None` while a request is in progress, or
    /// where a stream has the connection. A request counts from the end of its head.
    pub fn idle_since(&self) -> Option<Duration> {
        let since = Duration::from_nanos(self.idle_since.load(Ordering::Relaxed));
        let is_idle = self.state.load(Ordering::Acquire) == IDLE && !self.is_stream();
        is_idle.then_some(since)
    }

    /// Notes that a stream takes the connection over: it is never idle again.
    pub fn stream(&self) {
        self.streams.store(true, Ordering::Release);
    }

    /// Whether a stream has taken the connection over.
    pub fn is_stream(&self) -> bool {
        self.streams.load(Ordering::Acquire)
    }

    /// Whether a whole request has come whose answer is still being made or sent.
    pub fn is_answering(&self) -> bool {
        self.state.load(Ordering::Acquire) == ANSWERING
    }

    /// Notes that a request has come, up to its body. The returned body notes its own end.
    pub fn receive(self: &Arc<Self>, body: Body) -> Body {
        self.state.store(RECEIVING, Ordering::Release);
        self.watch(body, Activity::received)
    }

    /// Notes that the answer is ready. The returned answer's body notes its own end.
    pub fn answer(self: &Arc<Self>, answer: Response) -> Response {
        self.state.store(ANSWERING, Ordering::Release);
        answer.map(|body| {
            // hyper drops an empty body as soon as the head is sent.
            Body::new(WatchedBody {
                body,
                activity: self.clone(),
                at_end: Activity::note_idle,
                ended: false,
                ends_on_drop: true,
            })
        })
    }

    fn watch(self: &Arc<Self>, body: Body, at_end: fn(&Activity)) -> Body {
        if body.is_end_stream() {
            at_end(self);
            return body;
        }
        Body::new(WatchedBody {
            body,
            activity: self.clone(),
            at_end,
            ended: false,
            ends_on_drop: false,
        })
    }

    /// Notes that the request's body has ended. If the request was refused, its body may end after its answer; the
    /// state then stays.
    fn received(&self) {
        let (from, to) = (RECEIVING, ANSWERING);
        let _ = self
            .state
            .compare_exchange(from, to, Ordering::AcqRel, Ordering::Relaxed);
    }
}

struct WatchedBody {
    body: Body,
    activity: Arc<Activity>,
    at_end: fn(&Activity),
    ended: bool,
    ends_on_drop: bool,
}

impl WatchedBody {
    fn end(&mut self) {
        if !self.ended {
            self.ended = true;
            (self.at_end)(&self.activity);
        }
    }
}

impl HttpBody for WatchedBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(cx);
        // Whoever reads a request's body may not poll again after the last piece, so the body's own end counts, too.
        let is_last = matches!(polled, Poll::Ready(None)) || self.body.is_end_stream();
        if is_last && !self.ends_on_drop {
            self.end();
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for WatchedBody {
    fn drop(&mut self) {
        if self.ends_on_drop {
            self.end();
        }
    }
}
