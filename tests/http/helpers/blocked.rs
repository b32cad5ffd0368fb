//! Requests that wait for the only worker for longer than they may.

use crate::application::{BOX, TestApplication, behind_a_proxy, expect_problem};
use crate::helpers::heavy;
use crate::helpers::provoke::Operation;
use crate::operation::metrics::{metrics, value};
use crate::pictures;
use reqwest::{Response, StatusCode};
use std::time::Duration;

/// A service whose only worker can be kept busy for longer than a request may take.
pub struct Blocked {
    app: TestApplication,
    id: String,
    bomb: Vec<u8>,
}

impl Blocked {
    pub async fn start() -> Self {
        let app = TestApplication::start_with(|config| {
            config.workers = Some(1);
            config.work_timeout = Duration::from_millis(20);
            // Lifts the limit of requests: the helper polls the metrics.
            behind_a_proxy(config);
            // Allows the large frame, whose decoding keeps the worker busy.
            config.max_frame_memory = 1 << 30;
        });
        let app = app.await;
        let opened = loop {
            let opened = app.create(pictures::png(0), &[("box", BOX)]).await;
            if opened.status() == StatusCode::CREATED {
                break opened.json::<serde_json::Value>().await.unwrap();
            }
        };
        Self {
            id: opened["id"].as_str().unwrap().to_owned(),
            bomb: heavy::bomb(),
            app,
        }
    }

    /// The answers to these operations, sent while the worker decodes one large frame; `None` if the worker had
    /// finished before all of them were answered.
    pub async fn attempts(&self, operations: &[Operation]) -> Option<Vec<Response>> {
        let block = async {
            loop {
                let frame = self.bomb.clone();
                let query = [("box", "2000,1500,1600,1200")];
                let late = self.app.create(frame, &query).await;
                expect_problem(late, "work-timeout").await;
            }
        };
        let attempts = async {
            let begun = loop {
                if let Some(begun) = self.begun_at_work().await {
                    break begun;
                }
            };
            let attempts = operations.iter().map(|operation| self.attempt(operation));
            let responses = futures_util::future::join_all(attempts).await;
            // No other piece of work has begun, so the worker was busy throughout.
            (self.begun_at_work().await == Some(begun)).then_some(responses)
        };
        tokio::select! {
            responses = attempts => responses,
            () = block => None,
        }
    }

    /// How many pieces of work have begun; `None` if the worker is idle.
    async fn begun_at_work(&self) -> Option<f64> {
        let text = metrics(&self.app).await;
        let is_busy = value(&text, "bagtrack_workers_busy", &[]) == 1.0;
        is_busy.then(|| value(&text, "bagtrack_queue_wait_seconds_count", &[]))
    }

    async fn attempt(&self, operation: &Operation) -> Response {
        let path = operation.path_of(&self.id);
        // Numbered, because a session takes only one frame without a number at a time.
        let query: &[(&str, &str)] = match (operation.takes_frames(), operation.path.as_str()) {
            (false, _) => &[],
            (_, path) if path.ends_with("/frames") => &[("frame", "1")],
            (_, path) if path.ends_with("/target") => &[("box", BOX), ("frame", "1")],
            _ => &[("box", BOX)],
        };
        let mut request = self.app.request(operation.method.clone(), &path, query);
        if operation.takes_frames() {
            request = request.body(pictures::png(0));
        }
        request.send().await.unwrap()
    }

    /// Waits for the worker, and checks that it has not done the requests that timed out.
    pub async fn finish(self) {
        while self.begun_at_work().await.is_some() {}
        assert_eq!(self.app.frames_of(&self.id).await, 1);
        let text = metrics(&self.app).await;
        assert_eq!(value(&text, "bagtrack_sessions", &[]), 1.0);
    }
}
