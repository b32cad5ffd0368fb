//! A service without a store, its client, and pictures.

use crate::common;
use bagtrack_sessions::{
    Admission, Boxes, Clock, Executor, FrameBatch, FramesError, Lease, Opened, Registry,
    ServiceParts, Session, SessionService, Start, Tracked,
};
use bagtrack_testing::pictures::{encode, scene};
use bagtrack_tracker::Rect;
use bytes::Bytes;
use image::{GrayImage, ImageFormat, Luma};
use std::sync::Arc;
use std::time::Duration;

pub use crate::common::{FIRST, FLOW, FREE, Quota, params, place, request};

/// Width and height of the pictures.
pub const SIZE: (u32, u32) = (96, 72);
pub const PIXELS: u64 = 96 * 72;
/// Another target, which does not move.
pub const SECOND: Rect = Rect {
    x: 60.0,
    y: 40.0,
    width: 20.0,
    height: 16.0,
};
/// How long a session lives before its first frame, and after each.
pub const LEASE: Lease = Lease {
    first: Duration::from_secs(60),
    idle: Duration::from_secs(600),
};
/// How long a request may take.
pub const WORK_TIMEOUT: Duration = Duration::from_secs(30);
/// Most sessions of a service.
pub const SESSIONS: usize = 3;

pub fn png(picture: GrayImage) -> Bytes {
    encode(picture, ImageFormat::Png).into()
}

/// Picture `number`. From each picture to the next the first target moves two pixels to the right and one down.
pub fn picture(number: u32) -> Bytes {
    let mut scene = scene(number);
    for (x, y, pixel) in scene.enumerate_pixels_mut() {
        let (dx, dy) = (x.wrapping_sub(60), y.wrapping_sub(40));
        // The second target lies behind the first, so only pixels of the darker background are set.
        if dx < 20 && dy < 16 && pixel.0[0] < 100 {
            *pixel = Luma([150 + ((dx * 5) ^ (dy * 9)) as u8 % 100]);
        }
    }
    png(scene)
}

pub fn pictures(numbers: std::ops::Range<u32>) -> Vec<Bytes> {
    numbers.map(picture).collect()
}

/// A picture of another size.
pub fn small_picture() -> Bytes {
    png(GrayImage::new(48, 48))
}

/// The parts of a service whose work is done at once, on the thread that asks for it.
pub fn parts(clock: &Clock) -> ServiceParts {
    let at_once = Executor::on_one_thread(|work| work()());
    let registry = Registry::new(SESSIONS, 4, LEASE, clock.clone());
    let admission = Admission::on(at_once, 8, 1, Duration::ZERO);
    common::parts(registry, admission, WORK_TIMEOUT)
}

pub fn service(clock: &Clock) -> SessionService {
    SessionService::new(parts(clock))
}

/// A session begins in the first picture, with a box or a list of them.
pub fn at_first(boxes: Boxes) -> Start {
    Start::Frame {
        file: picture(0),
        boxes,
        params: Box::new(params()),
    }
}

pub async fn open(service: &SessionService, boxes: Boxes) -> Arc<Session> {
    let opened = service.open(request(service, None, 0, at_first(boxes)));
    let Opened { session, .. } = opened.await.unwrap();
    session
}

pub async fn post(
    service: &SessionService,
    session: &Arc<Session>,
    batch: FrameBatch,
) -> Result<Tracked, FramesError> {
    let permit = session.enter().unwrap();
    service.advance(permit, place(service), batch).await
}

/// Posts pictures under the number of the first one.
pub async fn post_numbered(
    service: &SessionService,
    session: &Arc<Session>,
    number: u64,
    files: Vec<Bytes>,
) -> Result<Tracked, FramesError> {
    let batch = FrameBatch::posted(Some(number), files, None);
    post(service, session, batch).await
}
