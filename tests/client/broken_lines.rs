//! Connections that are cut in the middle of a request or an answer.

use crate::application::TestApplication;
use crate::clip::{CLIP, written};
use crate::lossy::Lossy;
use bagtrack_client::{Client, OpenOptions};
use std::sync::atomic::Ordering;
use std::time::Duration;

#[tokio::test]
async fn nothing_is_lost_and_nothing_is_tracked_twice() {
    let app = TestApplication::start().await;
    let frames = &CLIP.frames[1..];
    let expected = CLIP.tracked(5, frames);
    // A connection carries about five frames, and is then cut at a random byte.
    let frame = CLIP.frames[0].len();
    let lossy = Lossy::before(vec![app.address], frame / 2..10 * frame).await;
    let client = Client::builder(format!("http://{}", lossy.address))
        .retry_for(Duration::from_secs(120))
        .build()
        .unwrap();
    let options = OpenOptions::new().seed(5);
    let opened = client.open(CLIP.frames[0].clone(), CLIP.rect(), &options);
    let mut session = opened.await.unwrap();
    let id = session.id();
    let mut answers = Vec::new();
    // The first frames go one by one, later ones in requests with several frames.
    for frame in &frames[..60] {
        answers.push(session.track(frame.clone()).await.unwrap());
    }
    for batch in frames[60..].chunks(4) {
        answers.extend(session.track_many(batch.to_vec()).await.unwrap());
    }
    let answers: Vec<_> = answers.iter().map(written).collect();
    assert_eq!(answers, expected);
    assert_eq!(app.frames_of(&id.to_string()).await, 101);
    assert_eq!((session.id(), session.resent()), (id, 0));
    let cuts = lossy.cuts.load(Ordering::Relaxed);
    assert!(cuts >= 5, "the line was cut {cuts} times only");
}
