//! Uploads in their three forms: a raw body, `multipart/form-data`, JSON with base64.
//!
//! The form is told by the content type. A raw body may have any other one: the type of a frame is taken from
//! its bytes, and curl labels what it sends as `application/x-www-form-urlencoded` when it is not told
//! otherwise. Settings come in the query or as fields of the form, each once.

mod fields;
mod json;
mod multipart;
mod params;

pub use fields::Fields;

use super::body;
use super::problem::Problem;
use super::snapshot;
use super::state::AppState;
use super::work;
use crate::sessions::QueuePermit;
use axum::body::Bytes;
use axum::extract::{Query, Request};
use axum::http::Uri;
use axum::http::header::CONTENT_TYPE;

/// What a call takes besides frames.
#[derive(Debug, Clone, Copy)]
pub struct Form {
    /// Settings, in the query or as fields.
    pub settings: &'static [&'static str],
    /// Whether frames are numbered by `?frame=N`.
    pub numbered: bool,
    /// Whether more than one frame may come.
    pub several: bool,
}

/// What came.
#[derive(Debug)]
pub struct Upload {
    /// The frames as sent, in order; at least one.
    pub frames: Vec<Bytes>,
    /// The settings.
    pub fields: Fields,
    /// The content type says that this is a session snapshot.
    pub is_snapshot: bool,
}

/// A request that is inside.
#[derive(Debug)]
pub struct Received<T> {
    /// What it needs besides the queue.
    pub admitted: T,
    /// Its place in the queue.
    pub queue: QueuePermit,
    /// What came with it.
    pub upload: Upload,
}

/// A form that takes nothing at all, for calls without a body.
pub const NOTHING: Form = Form {
    settings: &[],
    numbered: false,
    several: false,
};

impl Form {
    /// Reads the settings in the query.
    pub fn query(&self, uri: &Uri) -> Result<Fields, Problem> {
        let Query(pairs) = Query::<Vec<(String, String)>>::try_from_uri(uri)
            .map_err(|_| Problem::malformed("The query cannot be read; send name=value pairs."))?;
        let mut fields = Fields::default();
        for (name, value) in pairs {
            let is_number = self.numbered && name == "frame";
            if !is_number && !self.settings.contains(&name.as_str()) {
                let number = self.numbered.then_some("frame");
                return Err(self.unknown("query parameter", &name, number));
            }
            fields.set(&name, &value)?;
        }
        Ok(fields)
    }

    /// Takes a request in, and refuses it as early as it can be: first for its query, then for what `admit` says, then for a
    /// full queue, and only then for its body.
    pub async fn receive<T>(
        &self,
        state: &AppState,
        request: Request,
        admit: impl FnOnce() -> Result<T, Problem>,
    ) -> Result<Received<T>, Problem> {
        let fields = self.query(request.uri())?;
        let admitted = admit()?;
        let queue = state.enter(request.headers())?;
        let upload = self.read(state, &queue, fields, request).await?;
        Ok(Received {
            admitted,
            queue,
            upload,
        })
    }

    /// Reads the body; `fields` are the settings of the query. `queue` lets long work be done elsewhere.
    async fn read(
        &self,
        state: &AppState,
        queue: &QueuePermit,
        fields: Fields,
        request: Request,
    ) -> Result<Upload, Problem> {
        let limit = state.config.max_body_bytes;
        let most = if self.several {
            state.config.max_frames
        } else {
            1
        };
        let media_type = media_type(&request);
        let mut upload = Upload {
            frames: Vec::new(),
            fields,
            is_snapshot: media_type == snapshot::MEDIA_TYPE,
        };
        if media_type == "multipart/form-data" {
            multipart::read(self, limit, most, request, &mut upload).await?;
        } else {
            let bytes = body::read(request.into_body(), limit).await?;
            // No image and no snapshot starts like a JSON object, which curl's -d mislabels too.
            if media_type == "application/json" || bytes.starts_with(b"{") {
                let form = *self;
                let parse = move || {
                    json::read(&form, most, &bytes, &mut upload)?;
                    Ok(upload)
                };
                upload = work::run(state, queue.clone(), parse).await?;
            } else if !bytes.is_empty() {
                upload.frames.push(bytes);
            }
        }
        check_frames(&upload.frames, most)?;
        Ok(upload)
    }

    /// The problem of a name that nothing here has; `frames` are the names of frames in this form.
    fn unknown<'a>(
        &self,
        what: &str,
        name: &str,
        frames: impl IntoIterator<Item = &'a str>,
    ) -> Problem {
        let known: Vec<String> = frames
            .into_iter()
            .chain(self.settings.iter().copied())
            .map(|name| format!("`{name}`"))
            .collect();
        let name: String = name.chars().take(64).collect();
        Problem::malformed(if known.is_empty() {
            format!("The {what} `{name}` is unknown; this call takes none.")
        } else {
            format!(
                "The {what} `{name}` is unknown; this call takes {}.",
                known.join(", ")
            )
        })
    }
}

fn check_frames(frames: &[Bytes], most: usize) -> Result<(), Problem> {
    if frames.len() > most {
        return Err(Problem::too_many_frames(most));
    }
    if frames.is_empty() {
        return Err(Problem::missing_frame());
    }
    match frames.iter().position(Bytes::is_empty) {
        Some(empty) => Err(Problem::missing_frame().of_frame(empty, frames.len())),
        None => Ok(()),
    }
}

fn media_type(request: &Request) -> String {
    let value = request.headers().get(CONTENT_TYPE);
    let text = value.and_then(|value| value.to_str().ok()).unwrap_or("");
    let essence = text.split(';').next().unwrap_or("");
    essence.trim().to_ascii_lowercase()
}
