//! A service that gives the replies of a script, and says where a request is not the script's. docs/PROTOCOL.md
//! describes the scripts, which are in tests/protocol/exchanges.json.

use crate::script::{Request, read};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::collections::{HashMap, VecDeque};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpListener;
use uuid::Uuid;

const SNAPSHOT: &str = "application/vnd.bagtrack.snapshot";
const DRAWN_SEED: &str = "7";

/// The service. Each request has a connection of its own.
pub struct ScriptedService {
    address: SocketAddr,
    script: Arc<Mutex<Script>>,
}

#[derive(Default)]
struct Script {
    exchanges: VecDeque<Exchange>,
    /// The sessions' ids, by their names in the script.
    ids: HashMap<String, String>,
    seed: Option<String>,
    complaints: Vec<String>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Exchange {
    request: String,
    frame: Option<String>,
    snapshot: Option<String>,
    reply: Reply,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
enum Reply {
    /// `half` or `none` of an answer.
    Cut(String),
    Whole(Whole),
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Whole {
    status: u16,
    #[serde(default)]
    headers: HashMap<String, String>,
    answer: Option<u64>,
    created: Option<u64>,
    problem: Option<Map<String, Value>>,
    snapshot: Option<String>,
    text: Option<String>,
}

impl ScriptedService {
    pub async fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let script = Arc::new(Mutex::new(Script::default()));
        let shared = script.clone();
        tokio::spawn(async move {
            loop {
                let (mut line, _) = listener.accept().await.unwrap();
                let request = read(&mut line).await;
                let answer = shared.lock().unwrap().answer(&request);
                line.write_all(answer.as_bytes()).await.unwrap();
            }
        });
        Self { address, script }
    }

    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// The requests that come next.
    pub fn expect(&self, exchanges: Vec<Value>) {
        let read = exchanges.into_iter().map(serde_json::from_value);
        self.script.lock().unwrap().exchanges = read.map(Result::unwrap).collect();
    }

    /// All requests were those of the script, and all of them came.
    pub fn check(&self, name: &str) {
        let script = self.script.lock().unwrap();
        assert!(
            script.complaints.is_empty(),
            "{name}: {:?}",
            script.complaints
        );
        let next = script.exchanges.front();
        assert!(next.is_none(), "{name}: not asked: {next:?}");
    }
}

impl Script {
    /// The bytes of the answer.
    fn answer(&mut self, request: &Request) -> String {
        let line = request.head.lines().next().unwrap_or_default();
        let body = String::from_utf8_lossy(&request.body);
        let asked = format!("{line} {body}");
        let Some(exchange) = self.exchanges.pop_front() else {
            self.complaints
                .push(format!("asked after the script's end: {asked}"));
            return whole(400, &HashMap::new(), "");
        };
        match self.compare(&exchange, request) {
            Ok(id) => self.reply(&exchange.reply, &id),
            Err(what) => {
                self.complaints
                    .push(format!("{asked} in place of {exchange:?}: {what}"));
                whole(400, &HashMap::new(), "")
            }
        }
    }

    /// The session's id, where the request is that of the exchange; otherwise what differs.
    fn compare(&mut self, exchange: &Exchange, request: &Request) -> Result<String, String> {
        let is = |same: bool, what: &str| same.then_some(()).ok_or_else(|| what.to_owned());
        let (method, target) = exchange.request.split_once(' ').unwrap();
        let mut words = request.head.split(' ');
        is(words.next() == Some(method), "the method")?;
        let (wanted, came) = (parts(target), parts(words.next().unwrap()));
        let path = |parts: &Target| [&parts.path[..1], &parts.path[2..]].concat();
        is(path(&wanted) == path(&came), "the path")?;
        let (name, id) = (&wanted.path[1], &came.path[1]);
        if !self.ids.contains_key(name) {
            let is_new = !self.ids.values().any(|other| other == id);
            let is_id = method == "PUT" && Uuid::try_parse(id).is_ok();
            is(is_id && is_new, "a new id")?;
            self.ids.insert(name.clone(), id.clone());
        }
        is(self.ids[name] == *id, "the session's id")?;
        let first = came.query.get("seed").cloned();
        let seed = self
            .seed
            .get_or_insert(first.unwrap_or(DRAWN_SEED.to_owned()));
        for (key, value) in &wanted.query {
            let found = came.query.get(key).map_or("", String::as_str);
            let same = match key.as_str() {
                "box" => numbers(found) == numbers(value),
                _ => found == value.replace("{seed}", seed),
            };
            is(same, key)?;
        }
        let body = exchange.frame.as_ref().or(exchange.snapshot.as_ref());
        is(
            request.body == body.map_or("", String::as_str).as_bytes(),
            "the body",
        )?;
        let is_snapshot = request.header("content-type") == SNAPSHOT;
        is(is_snapshot == exchange.snapshot.is_some(), "the media type")?;
        Ok(id.clone())
    }

    fn reply(&self, reply: &Reply, id: &str) -> String {
        let told = match reply {
            Reply::Cut(how) if how == "none" => return String::new(),
            Reply::Cut(_) => {
                return "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n{\"frame\"".to_owned();
            }
            Reply::Whole(told) => told,
        };
        let mut content = told
            .snapshot
            .clone()
            .or(told.text.clone())
            .unwrap_or_default();
        if let Some(problem) = &told.problem {
            let mut problem = problem.clone();
            problem.insert("status".to_owned(), told.status.into());
            content = Value::from(problem).to_string();
        }
        if let Some(frame) = told.answer.or(told.created) {
            let rect = json!({"x": frame as f64, "y": 2.0, "width": 30.5, "height": 40.0});
            let mut answer =
                json!({"frame": frame, "box": rect, "score": 0.5, "status": "tracking"});
            if told.created.is_some() {
                let seed: u64 = self.seed.as_ref().unwrap().parse().unwrap();
                answer["id"] = id.into();
                answer["image"] = json!({"width": 320, "height": 240});
                answer["parameters"] = json!({"seed": seed});
                answer["expires_at"] = "2026-01-31T12:00:00Z".into();
            }
            content = answer.to_string();
        }
        let mut headers = told.headers.clone();
        if told.snapshot.is_some() {
            headers.insert("Content-Type".to_owned(), SNAPSHOT.to_owned());
        }
        whole(told.status, &headers, &content)
    }
}

fn whole(status: u16, headers: &HashMap<String, String>, content: &str) -> String {
    let headers = headers.iter();
    let headers: String = headers
        .map(|(name, value)| format!("{name}: {value}\r\n"))
        .collect();
    let length = content.len();
    let fixed = format!("Connection: close\r\nContent-Length: {length}\r\n");
    format!("HTTP/1.1 {status} Scripted\r\n{fixed}{headers}\r\n{content}")
}

struct Target {
    path: Vec<String>,
    query: HashMap<String, String>,
}

fn parts(target: &str) -> Target {
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let path = path.split('/').skip(1).map(str::to_owned).collect();
    let pairs = query.split('&').filter_map(|pair| pair.split_once('='));
    let query = pairs.map(|(name, value)| (name.to_owned(), value.replace("%2C", ",")));
    Target {
        path,
        query: query.collect(),
    }
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(',')
        .filter_map(|number| number.parse().ok())
        .collect()
}
