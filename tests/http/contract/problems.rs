//! Every problem in the OpenAPI document, provoked.

use crate::application::expect_problem;
use crate::helpers::blocked::Blocked;
use crate::helpers::provoke::{Attempt, Operation};
use serde_json::Value;
use std::collections::BTreeSet;

/// The slugs and statuses of the problems that a description links to: `[…](problems#slug) (status)`.
fn named(description: &str) -> Vec<(String, String)> {
    let links = description.split("](problems#").skip(1);
    let named = links.map(|link| {
        let (slug, rest) = link.split_once(") (").unwrap();
        (slug.to_owned(), rest[..3].to_owned())
    });
    named.collect()
}

/// Whether only a video, and so ffmpeg, can provoke the problem: the tests of `videos` do that.
fn needs_a_video(operation: &Operation, slug: &str) -> bool {
    operation.path == "/frames" && matches!(slug, "frame-damaged" | "work-timeout")
}

/// Every operation with every problem type that the document says it may answer.
fn documented() -> Vec<(Operation, String)> {
    let document: Value = serde_json::from_str(&bagtrack::http::openapi_document()).unwrap();
    let mut documented = Vec::new();
    for (path, methods) in document["paths"].as_object().unwrap() {
        for (method, operation) in methods.as_object().unwrap() {
            for (status, response) in operation["responses"].as_object().unwrap() {
                let named = named(response["description"].as_str().unwrap());
                let is_error = matches!(status.as_str(), "4XX" | "5XX");
                assert_eq!(is_error, !named.is_empty(), "{method} {path} {status}");
                for (slug, exact) in named {
                    assert_eq!(exact[..1], status[..1], "{slug}");
                    let operation = Operation::new(method, path);
                    if !needs_a_video(&operation, &slug) {
                        documented.push((operation, slug));
                    }
                }
            }
        }
    }
    documented
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_documented_problem_can_be_provoked_and_changes_no_session() {
    let documented = documented();
    let kinds: BTreeSet<&str> = documented.iter().map(|(_, slug)| slug.as_str()).collect();
    assert!(kinds.len() >= 20 && documented.len() >= 50, "{kinds:?}");
    for (operation, slug) in &documented {
        let is_elsewhere = match &**slug {
            "work-timeout" => true,
            // For `/frames` that is a video, which needs ffmpeg.
            "frame-too-large" => operation.path == "/frames",
            // The cost of one frame, as posted here, is known only after it took long; that of several, from headers.
            "request-too-costly" => {
                !["/track", "/sessions/{id}/frames"].contains(&&*operation.path)
            }
            _ => false,
        };
        if is_elsewhere {
            continue;
        }
        println!("{} {}: {slug}", operation.method, operation.path);
        let attempt = Attempt::provoke(operation, slug).await;
        let response = attempt.send().await;
        expect_problem(response, slug).await;
        if let Some(frames) = attempt.frames_of_the_session().await {
            assert_eq!(frames, 1, "{slug}");
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn work_that_waits_too_long_is_a_problem_wherever_it_is_documented() {
    let documented = documented().into_iter();
    // A stream takes no work to open. It waits for its session alone, while that tracks a frame.
    let timed = documented
        .filter(|(operation, slug)| slug == "work-timeout" && !operation.path.ends_with("/stream"));
    let operations: Vec<Operation> = timed.map(|(operation, _)| operation).collect();
    assert!(operations.len() >= 4);
    let blocked = Blocked::start().await;
    let mut tries = 0;
    let responses = loop {
        tries += 1;
        // Tries again if the worker had finished before all requests were answered, as on a busy machine.
        match blocked.attempts(&operations).await {
            Some(responses) => break responses,
            None => assert!(tries < 20, "the frame never takes long enough"),
        }
    };
    for response in responses {
        expect_problem(response, "work-timeout").await;
    }
    blocked.finish().await;
}
