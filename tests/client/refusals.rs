//! Refusals of the service are typed problems, and leave the session as it was.

use crate::application::TestApplication;
use crate::clip::{CLIP, written};
use crate::pictures;
use bagtrack::http::Secret;
use bagtrack_client::{Client, ClientError, OpenOptions, Problem, Rect};

fn problem<T: std::fmt::Debug>(result: Result<T, ClientError>) -> Problem {
    match result {
        Err(ClientError::Refused(problem)) => *problem,
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_refused_frame_leaves_the_session_as_it_was() {
    let app = TestApplication::start().await;
    let client = Client::new(format!("http://{}", app.address)).unwrap();
    let options = OpenOptions::new().seed(7);
    let opened = client.open(CLIP.frames[0].clone(), CLIP.rect(), &options);
    let mut session = opened.await.unwrap();
    let frames = &CLIP.frames[1..9];
    let expected = CLIP.tracked(7, frames);
    session.track_many(frames[..3].to_vec()).await.unwrap();

    let damaged = frames[3][..frames[3].len() / 2].to_vec();
    let refused = problem(session.track(damaged.clone()).await);
    assert_eq!((refused.status, refused.kind()), (422, "frame-damaged"));
    let path = format!("/sessions/{}/frames", session.id());
    assert_eq!(refused.instance, path);
    assert!(!refused.request_id.is_empty() && !refused.title.is_empty());
    assert!(refused.to_string().starts_with(&refused.detail));

    let batch = [frames[3].clone(), damaged, frames[4].clone()];
    let refused = problem(session.track_many(batch).await);
    assert_eq!((refused.kind(), refused.index), ("frame-damaged", Some(1)));

    let refused = problem(session.track(pictures::png_of(64, 64)).await);
    assert_eq!(refused.kind(), "frame-size-mismatch");
    let empty = Rect {
        width: 0.0,
        ..CLIP.rect()
    };
    let refused = problem(session.correct(frames[3].clone(), 0, empty).await);
    assert_eq!(refused.kind(), "invalid-box");

    assert_eq!(session.frame(), 3);
    for (frame, expected) in frames[3..].iter().zip(&expected[3..]) {
        let answer = session.track(frame.clone()).await.unwrap();
        assert_eq!(written(&answer), *expected);
    }
}

#[tokio::test]
async fn what_cannot_open_a_session_is_refused() {
    let app = TestApplication::start().await;
    let client = Client::new(format!("http://{}", app.address)).unwrap();
    let open = async |frame: &[u8], options: OpenOptions| {
        let opened = client.open(frame.to_vec(), CLIP.rect(), &options).await;
        problem(opened).kind().to_owned()
    };
    let options = OpenOptions::new();
    let unknown = options.clone().parameter("unknown", 1);
    assert_eq!(open(&CLIP.frames[0], unknown).await, "invalid-parameter");
    assert_eq!(open(b"no picture", options).await, "unsupported-image");
    let refused = problem(client.restore("no snapshot").await);
    assert_eq!(refused.kind(), "invalid-snapshot");
}

#[tokio::test]
async fn only_a_valid_key_opens_a_session() {
    let app = TestApplication::start_with(|config| {
        config.access.api_keys = vec![Secret::from("ann:0123456789abcdef")];
    })
    .await;
    let url = format!("http://{}", app.address);
    let options = OpenOptions::new();
    let open = async |client: &Client| {
        let opened = client.open(CLIP.frames[0].clone(), CLIP.rect(), &options);
        opened.await
    };
    let keyless = Client::new(&url).unwrap();
    let wrong = Client::builder(&url).api_key("fedcba9876543210");
    for client in [keyless, wrong.build().unwrap()] {
        let refused = problem(open(&client).await);
        assert_eq!((refused.status, refused.kind()), (401, "unauthorized"));
    }
    let builder = Client::builder(&url).api_key("0123456789abcdef");
    assert!(!format!("{builder:?}").contains("0123456789abcdef"));
    let right = builder.build().unwrap();
    assert!(!format!("{right:?}").contains("0123456789abcdef"));
    let mut session = open(&right).await.unwrap();
    assert_eq!(
        session.track(CLIP.frames[1].clone()).await.unwrap().frame,
        1
    );
    session.end().await.unwrap();

    let impossible = Client::builder(&url).api_key("two\nlines").build();
    assert!(matches!(impossible, Err(ClientError::InvalidKey)));
    let nowhere = Client::new("no address");
    assert!(matches!(nowhere, Err(ClientError::Transport(_))));
}
