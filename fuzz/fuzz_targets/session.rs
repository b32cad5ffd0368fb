//! Whole sessions: any requests in any order, and a count of the frames that must have been taken.
#![no_main]

use arbitrary::Arbitrary;
use axum::http::{Method, StatusCode};
use bagtrack_fuzz::{jpeg, png, webp, Answer, Service};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

const MAX_STEPS: usize = 24;
/// The head of a file in a form.
const PART: &[u8] =
    b"--B\r\nContent-Disposition: form-data; name=\"frame\"; filename=\"a\"\r\n\r\n";

/// Picture `t` in the three formats.
static PICTURES: LazyLock<Vec<Vec<u8>>> =
    LazyLock::new(|| (0..6).flat_map(|t| [png(t), jpeg(t), webp(t)]).collect());

#[derive(Debug, Arbitrary)]
enum Step {
    Open {
        at: bool,
        picture: u8,
        target: Target,
        preset: bool,
        params: Vec<(u8, i16)>,
    },
    Post {
        at: bool,
        pictures: Vec<u8>,
        number: Option<u8>,
        damage: Option<(u16, u8)>,
    },
    Correct {
        at: bool,
        picture: u8,
        target: Target,
        number: Option<u8>,
    },
    Copy {
        at: bool,
    },
    Damage {
        at: bool,
        byte: u16,
        value: u8,
    },
    Delete {
        at: bool,
    },
}

#[derive(Debug, Arbitrary)]
enum Target {
    Usual,
    Any(i8, i8, u8, u8),
    Numbers(f64, f64, f64, f64),
}

impl Target {
    fn text(&self) -> String {
        match self {
            Self::Usual => bagtrack_fuzz::BOX.to_owned(),
            Self::Any(x, y, width, height) => format!("{x},{y},{width},{height}"),
            Self::Numbers(x, y, width, height) => format!("{x},{y},{width},{height}"),
        }
    }
}

/// Parameters that a script may set. The values may be out of range, and in it cost little.
const PARAMS: [&str; 8] = [
    "particles",
    "bag_size",
    "update_every",
    "history",
    "basis_dim",
    "patch_width",
    "patch_height",
    "alpha",
];

struct Session {
    path: String,
    frames: u64,
}

struct Script<'a> {
    service: &'a Service,
    sessions: [Option<Session>; 2],
}

impl Script<'_> {
    fn open(&mut self, at: bool, answer: &Answer, frames: u64) {
        if let Some(path) = answer.session() {
            if let Some(before) = self.sessions[usize::from(at)].replace(Session { path, frames }) {
                self.service.delete(&before.path);
            }
        }
    }

    fn run(&mut self, step: &Step) {
        let service = self.service;
        let picture = |index: u8| &PICTURES[usize::from(index) % PICTURES.len()];
        let number = |number: Option<u8>| number.map_or(String::new(), |n| format!("frame={n}"));
        match step {
            Step::Open {
                at,
                picture: index,
                target,
                preset,
                params,
            } => {
                let preset = if *preset { "paper" } else { "robust" };
                let params: serde_json::Map<_, _> = params
                    .iter()
                    .take(4)
                    .map(|(name, value)| {
                        let name = PARAMS[usize::from(*name) % PARAMS.len()];
                        // Few particles, so that a script takes no seconds.
                        let value = if name == "particles" {
                            value % 200
                        } else {
                            *value
                        };
                        (name.to_owned(), value.into())
                    })
                    .collect();
                let params = serde_json::Value::Object(params).to_string();
                let params = params
                    .replace('"', "%22")
                    .replace('{', "%7B")
                    .replace('}', "%7D");
                let path = format!(
                    "/sessions?box={}&preset={preset}&seed=7&parameters={params}",
                    target.text()
                );
                let answer = service.send((Method::POST, &path), "image/png", picture(*index));
                self.open(*at, &answer, 1);
            }
            Step::Post {
                at,
                pictures,
                number: n,
                damage,
            } => {
                let Some(session) = &mut self.sessions[usize::from(*at)] else {
                    return;
                };
                let path = format!("{}/frames?{}", session.path, number(*n));
                let mut files: Vec<Vec<u8>> = pictures
                    .iter()
                    .take(5)
                    .map(|i| picture(*i).clone())
                    .collect();
                if let (Some((byte, value)), Some(file)) = (damage, files.last_mut()) {
                    let byte = usize::from(*byte) % file.len();
                    file[byte] ^= value;
                }
                let mut form = Vec::new();
                for file in &files {
                    form.extend_from_slice(PART);
                    form.extend_from_slice(file);
                    form.extend_from_slice(b"\r\n");
                }
                form.extend_from_slice(b"--B--\r\n");
                let form_type = "multipart/form-data; boundary=B";
                let answer = service.send((Method::POST, &path), form_type, &form);
                if answer.status == StatusCode::OK {
                    let again = service.send((Method::POST, &path), form_type, &form);
                    if !answer.headers.contains_key("replayed") {
                        session.frames += files.len() as u64;
                    }
                    // A numbered request that is sent again gets the same answer, and changes nothing.
                    if n.is_some() {
                        assert_eq!(again.body, answer.body);
                        assert_eq!(again.headers["replayed"], "true");
                    } else if again.status == StatusCode::OK {
                        session.frames += files.len() as u64;
                    }
                }
            }
            Step::Correct {
                at,
                picture: index,
                target,
                number: n,
            } => {
                let Some(session) = &mut self.sessions[usize::from(*at)] else {
                    return;
                };
                let path = format!(
                    "{}/target?box={}&{}",
                    session.path,
                    target.text(),
                    number(*n)
                );
                let answer = service.send((Method::PUT, &path), "image/png", picture(*index));
                if answer.status == StatusCode::OK && !answer.headers.contains_key("replayed") {
                    session.frames += 1;
                }
            }
            Step::Copy { at } | Step::Damage { at, .. } => {
                let Some(session) = &self.sessions[usize::from(*at)] else {
                    return;
                };
                let frames = session.frames;
                let path = format!("{}/snapshot", session.path);
                let mut bytes = service
                    .send((Method::GET, &path), "text/plain", b"")
                    .body
                    .to_vec();
                if let Step::Damage { byte, value, .. } = step {
                    let byte = usize::from(*byte) % bytes.len();
                    bytes[byte] ^= value;
                }
                let media_type = "application/vnd.bagtrack.snapshot";
                let answer = service.send((Method::POST, "/sessions"), media_type, &bytes);
                let is_whole = matches!(step, Step::Copy { .. } | Step::Damage { value: 0, .. });
                assert_eq!(answer.status == StatusCode::CREATED, is_whole);
                self.open(!at, &answer, frames);
            }
            Step::Delete { at } => {
                if let Some(session) = self.sessions[usize::from(*at)].take() {
                    service.delete(&session.path);
                    assert_eq!(service.frames(&session.path), None);
                }
            }
        }
        for session in self.sessions.iter().flatten() {
            assert_eq!(
                service.frames(&session.path),
                Some(session.frames),
                "{step:?}"
            );
        }
    }
}

thread_local! {
    static SERVICE: Service = Service::new();
}

fuzz_target!(|steps: Vec<Step>| {
    SERVICE.with(|service| {
        let mut script = Script {
            service,
            sessions: [None, None],
        };
        for step in steps.iter().take(MAX_STEPS) {
            script.run(step);
        }
        for session in script.sessions.iter().flatten() {
            service.delete(&session.path);
        }
    });
});
