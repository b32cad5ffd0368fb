//! The client does what docs/PROTOCOL.md says: the exchanges of tests/protocol/exchanges.json.

use crate::scripted_service::ScriptedService;
use bagtrack_client::{Client, ClientError, OpenOptions, Rect, Session};
use serde::Deserialize;
use serde_json::{Value, json};
use std::time::Duration;

const TABLE: &str = include_str!("../../../../tests/protocol/exchanges.json");

#[derive(Deserialize)]
struct Table {
    #[serde(rename = "box")]
    rect: [f64; 4],
    scenarios: Vec<Scenario>,
}

#[derive(Deserialize)]
struct Scenario {
    name: String,
    #[serde(default)]
    client: Settings,
    steps: Vec<Step>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct Settings {
    snapshot_every: Option<u32>,
    retry_for: Option<u64>,
}

#[derive(Deserialize)]
struct Step {
    call: Call,
    exchanges: Vec<Value>,
    #[serde(default)]
    gives: Value,
}

#[derive(Deserialize, Debug)]
#[serde(untagged, deny_unknown_fields)]
enum Call {
    Open {
        open: String,
    },
    Track {
        track: String,
    },
    Correct {
        correct: String,
        #[serde(rename = "box")]
        rect: [f64; 4],
    },
    Snapshot {
        #[serde(rename = "snapshot")]
        _snapshot: bool,
    },
    End {
        #[serde(rename = "end")]
        _end: bool,
    },
}

fn client(service: &ScriptedService, settings: &Settings) -> Client {
    let mut client = Client::builder(service.url());
    if let Some(frames) = settings.snapshot_every {
        client = client.snapshot_every(frames);
    }
    if let Some(seconds) = settings.retry_for {
        client = client.retry_for(Duration::from_secs(seconds));
    }
    client.build().unwrap()
}

/// Makes a call; what it gives is in the words of the table.
async fn make(
    call: &Call,
    client: &Client,
    target: Rect,
    session: &mut Option<Session>,
) -> Result<Value, ClientError> {
    if let Call::Open { open } = call {
        let options = OpenOptions::new();
        *session = Some(client.open(open.clone(), target, &options).await?);
        return Ok(Value::Null);
    }
    let mut opened = session.take().expect("the table opens a session first");
    let given = match call {
        Call::Open { .. } => unreachable!("see above"),
        Call::Track { track } => opened.track(track.clone()).await.map(|answer| {
            assert_eq!(answer.first.rect.x, answer.frame as f64);
            json!({"frame": answer.frame})
        }),
        Call::Correct {
            correct,
            rect: right,
        } => {
            let answer = opened.correct(correct.clone(), 0, Rect::from(*right)).await;
            answer.map(|answer| json!({"frame": answer.frame}))
        }
        Call::Snapshot { .. } => {
            let taken = opened.snapshot().await;
            taken.map(|bytes| json!({"snapshot": String::from_utf8_lossy(&bytes)}))
        }
        Call::End { .. } => return opened.end().await.map(|()| Value::Null),
    };
    *session = Some(opened);
    given
}

fn failure(error: ClientError) -> Value {
    match error {
        ClientError::Refused(problem) => json!({"refused": problem.status, "kind": problem.kind()}),
        ClientError::Unavailable(_) | ClientError::Transport(_) => json!({"unavailable": true}),
        other => panic!("{other}"),
    }
}

async fn replay(scenario: Scenario, target: Rect) {
    let service = ScriptedService::start().await;
    let client = client(&service, &scenario.client);
    let mut session = None;
    for step in scenario.steps {
        service.expect(step.exchanges);
        let made = make(&step.call, &client, target, &mut session).await;
        service.check(&scenario.name);
        let given = made.unwrap_or_else(failure);
        assert_eq!(given, step.gives, "{}: {:?}", scenario.name, step.call);
    }
}

#[tokio::test]
async fn exchanges() {
    let table: Table = serde_json::from_str(TABLE).unwrap();
    let target = Rect::from(table.rect);
    let mut failed = Vec::new();
    for scenario in table.scenarios {
        let name = scenario.name.clone();
        if tokio::spawn(replay(scenario, target)).await.is_err() {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}
