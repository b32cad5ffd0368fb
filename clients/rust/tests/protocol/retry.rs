//! What is sent again, and for how long: against answers that services and proxies give seldom.

use crate::script::{Reply, Script, answer, created};
use bagtrack_client::{Client, ClientBuilder, ClientError, OpenOptions, Rect, Session};
use std::time::{Duration, Instant};

const TARGET: Rect = Rect {
    x: 1.0,
    y: 2.0,
    width: 30.5,
    height: 40.0,
};

fn client(script: &Script) -> ClientBuilder {
    Client::builder(script.url())
}

async fn open(client: ClientBuilder) -> Session {
    let client = client.build().unwrap();
    let options = OpenOptions::new().seed(u64::MAX);
    client.open("first", TARGET, &options).await.unwrap()
}

#[tokio::test]
async fn what_fails_for_a_moment_is_sent_again_with_its_number() {
    let page = Reply::new(502, "<html>Bad Gateway</html>");
    let replies = [
        created(0),
        Reply::new(408, ""),
        Reply::new(429, ""),
        page,
        Reply::new(503, ""),
        Reply::new(504, ""),
        Reply::Cut,
        answer(1),
    ];
    let script = Script::start(replies).await;
    let mut session = open(client(&script)).await;
    let answer = session.track("second").await.unwrap();
    assert_eq!((answer.frame, session.frame()), (1, 1));
    assert!(!session.is_draining() && session.checkpoint().is_none());
    assert_eq!(session.resent(), 0, "it had no answer before");
    let requests = script.requests();
    let (first, rest) = requests.split_first().unwrap();
    let id = session.id();
    let query = "box=1%2C2%2C30.5%2C40&seed=18446744073709551615&verbose=true";
    assert!(first.head.starts_with("PUT /base/sessions/"), "{first:?}");
    assert!(first.head.contains(query), "{first:?}");
    let path = format!("POST /base/sessions/{id}/frames?frame=1 ");
    assert_eq!(rest.len(), 7);
    for request in rest {
        assert!(request.head.starts_with(&path), "{request:?}");
        assert_eq!(request.body, b"second");
    }
}

#[tokio::test]
async fn why_there_is_no_answer_is_told_without_the_query() {
    let client = Client::builder("http://127.0.0.1:9").retry_for(Duration::ZERO);
    let options = OpenOptions::new();
    let opened = client
        .build()
        .unwrap()
        .open("first", TARGET, &options)
        .await;
    let told = opened.unwrap_err().to_string();
    assert!(told.starts_with("no answer: Connection refused"), "{told}");
    assert!(told.contains(" (http://127.0.0.1:9/sessions/"), "{told}");
    assert!(!told.contains("box="), "{told}");
}

/// It was told once the time for retries was up.
#[tokio::test]
async fn https_that_is_not_built_in_is_told_at_once() {
    let script = Script::start([created(0)]).await;
    let url = script.url().replace("http:", "https:");
    let client = Client::builder(url)
        .retry_for(Duration::from_secs(3600))
        .build();
    let opened = client
        .unwrap()
        .open("first", TARGET, &OpenOptions::new())
        .await;
    let told = opened.unwrap_err().to_string();
    assert!(told.contains("scheme is not http"), "{told}");
}

#[tokio::test]
async fn a_key_may_have_the_line_break_of_its_file() {
    let script = Script::start([created(0)]).await;
    open(client(&script).api_key("the-key-of-a-file\n")).await;
    let [request] = &script.requests()[..] else {
        panic!("one request")
    };
    assert_eq!(request.header("authorization"), "Bearer the-key-of-a-file");
    for key in ["", " \n", "one\ntwo"] {
        let refused = client(&script).api_key(key).build();
        assert!(matches!(refused, Err(ClientError::InvalidKey)), "{key:?}");
    }
}

/// A proxy's login page counted as the answer to a frame that was sent again, and was kept as a snapshot.
#[tokio::test]
async fn a_page_of_a_proxy_is_no_answer() {
    let page = || Reply::new(200, "<html>Log in</html>").with("Content-Type: text/html");
    let replies = [created(0), page(), answer(1), answer(2), page()];
    let script = Script::start(replies).await;
    let mut session = open(client(&script)).await;
    let failed = session.track("second").await;
    assert!(matches!(failed, Err(ClientError::Answer(_))), "{failed:?}");
    // The frame is kept.
    assert_eq!(session.track("third").await.unwrap().frame, 2);
    let failed = session.snapshot().await;
    assert!(matches!(failed, Err(ClientError::Answer(_))), "{failed:?}");
}

#[tokio::test]
async fn the_service_says_how_long_to_wait() {
    let busy = Reply::new(429, "").with("Retry-After: 1");
    let script = Script::start([created(0), busy, answer(1)]).await;
    let mut session = open(client(&script)).await;
    let begin = Instant::now();
    session.track("second").await.unwrap();
    assert!(begin.elapsed() >= Duration::from_secs(1));
}

#[tokio::test]
async fn a_large_frame_has_longer_to_go_over_a_slow_line() {
    // The script holds the line until it is asked again.
    let script = Script::start([Reply::Silence, created(0)]).await;
    let client = client(&script).retry_for(Duration::ZERO);
    let client = client.timeout(Duration::from_millis(1)).build().unwrap();
    let (begin, options) = (Instant::now(), OpenOptions::new());
    let opened = client.open(vec![0; 50_000], TARGET, &options).await;
    assert!(matches!(opened, Err(ClientError::Transport(_))));
    assert!(begin.elapsed() >= Duration::from_secs(1));
}

#[tokio::test]
async fn a_call_that_is_dropped_counts_as_one_without_answer() {
    let replies = [created(0), Reply::Silence, answer(1), answer(2)];
    let mut script = Script::start(replies).await;
    let mut session = open(client(&script)).await;
    tokio::select! {
        _ = session.track("second") => panic!("there is no answer"),
        () = script.is_silent() => {}
    }
    assert_eq!(session.track("third").await.unwrap().frame, 2);
    let last = script.requests().pop().unwrap();
    assert!(last.head.contains("frame=2 "), "{last:?}");
}

#[tokio::test]
async fn a_refused_frame_is_not_sent_again() {
    let text = r#"{"type": "/docs/problems#invalid-image", "title": "Not an image", "status": 422, "index": 0}"#;
    let replies = [created(0), Reply::new(422, text), answer(1)];
    let script = Script::start(replies).await;
    let mut session = open(client(&script)).await;
    let error = session.track("damaged").await.unwrap_err();
    let ClientError::Refused(problem) = error else {
        panic!("{error}")
    };
    assert_eq!((problem.status, problem.kind()), (422, "invalid-image"));
    assert_eq!(problem.index, Some(0));
    assert_eq!(session.track("second").await.unwrap().frame, 1);
    assert_eq!(script.requests().pop().unwrap().body, b"second");
}

#[tokio::test]
async fn a_proxys_page_is_a_problem_without_a_kind() {
    let script = Script::start([Reply::new(413, "<html>413</html>")]).await;
    let client = client(&script).build().unwrap();
    let opened = client.open("first", TARGET, &OpenOptions::new()).await;
    let Err(ClientError::Refused(problem)) = opened else {
        panic!("{opened:?}")
    };
    assert_eq!((problem.status, problem.kind()), (413, ""));
    assert_eq!(problem.to_string(), "Payload Too Large (413)");
}

/// A replica with checkpoints has ended: its frames after the checkpoint are asked for.
#[tokio::test]
async fn frames_that_the_service_lost_are_sent_again_as_far_as_they_are_kept() {
    let conflict = |expected: u64| {
        let text = format!(
            r#"{{"type": "/docs/problems#frame-out-of-order", "status": 409, "expected_frame": {expected}}}"#
        );
        Reply::new(409, &text)
    };
    let replies = [
        created(0),
        answer(1).with("Checkpoint: 0"),
        answer(2).with("Checkpoint: 2"),
        answer(3).with("Checkpoint: 2"),
        answer(4).with("Checkpoint: 2"),
        conflict(3),
        answer(3),
        answer(4),
        answer(5).with("Checkpoint: 2"),
        conflict(2),
    ];
    let script = Script::start(replies).await;
    let mut session = open(client(&script)).await;
    for (number, body) in (1..).zip(["a", "b", "c"]) {
        assert_eq!(session.track(body).await.unwrap().frame, number);
    }
    session.track("d").await.unwrap();
    assert_eq!(session.checkpoint(), Some(2));
    assert_eq!(session.track("e").await.unwrap().frame, 5);
    assert_eq!(session.resent(), 2);
    let bodies = script.requests().into_iter().map(|request| request.body);
    let bodies: Vec<u8> = bodies.skip(5).flatten().collect();
    assert_eq!(bodies, b"ecde");
    // Frame 2 is at the store, as it said: it was not kept.
    let error = session.track("f").await.unwrap_err();
    let ClientError::Refused(problem) = error else {
        panic!("{error}")
    };
    assert_eq!((problem.status, problem.expected_frame), (409, Some(2)));
}
