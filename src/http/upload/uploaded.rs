//! The frames and settings of a request, whichever form they came in.

use super::fields::Fields;
use super::settings::{FrameCount, Settings};
use super::texts::Texts;
use super::{body, json, multipart};
use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use crate::http::{snapshot, work};
use crate::sessions::QueuePermit;
use axum::body::Bytes;
use axum::extract::Request;
use axum::http::header::CONTENT_TYPE;

/// What a client uploaded.
#[derive(Debug)]
pub struct Upload<S> {
    /// The files as sent, in order; at least one, none of them empty.
    pub files: Vec<Bytes>,
    /// The settings, from the query and the body.
    pub settings: S,
    /// Whether the content type says that the file is a session snapshot.
    pub is_snapshot: bool,
}

impl<S: Settings> Upload<S> {
    /// Reads the body; `texts` are the settings of the query. JSON is parsed on a worker.
    ///
    /// # Errors
    /// The body cannot be read, it has too few or too many frames, or a setting is wrong.
    pub async fn read(
        state: &AppState,
        queue: &QueuePermit,
        texts: Texts,
        request: Request,
    ) -> Result<Self, Problem> {
        let max_bytes = state.config.max_body_bytes;
        let max_files = match S::FRAMES {
            FrameCount::One => 1,
            FrameCount::Several => state.config.max_frames,
        };
        let media_type = media_type(&request);
        let mut fields = Fields {
            files: Vec::new(),
            texts,
        };
        if media_type == "multipart/form-data" {
            multipart::read(request, max_bytes, max_files, &mut fields).await?;
        } else {
            let bytes = body::read(request.into_body(), max_bytes).await?;
            // No image and no snapshot starts like a JSON object, which curl's -d mislabels too.
            if media_type == "application/json" || bytes.starts_with(b"{") {
                let parse = move || {
                    json::read::<S>(&bytes, max_files, &mut fields)?;
                    Ok(fields)
                };
                fields = work::run(state, queue.clone(), parse).await?;
            } else if !bytes.is_empty() {
                fields.files.push(bytes);
            }
        }
        let Fields { files, texts } = fields;
        check_files(&files, max_files)?;
        Ok(Self {
            files,
            settings: texts.parse()?,
            is_snapshot: media_type == snapshot::MEDIA_TYPE,
        })
    }
}

fn check_files(files: &[Bytes], max_files: usize) -> Result<(), Problem> {
    if files.len() > max_files {
        return Err(Problem::too_many_frames(max_files));
    }
    if files.is_empty() {
        return Err(Problem::missing_frame());
    }
    match files.iter().position(Bytes::is_empty) {
        Some(empty) => Err(Problem::missing_frame().of_frame(empty, files.len())),
        None => Ok(()),
    }
}

fn media_type(request: &Request) -> String {
    let value = request.headers().get(CONTENT_TYPE);
    let text = value.and_then(|value| value.to_str().ok()).unwrap_or("");
    let essence = text.split(';').next().unwrap_or("");
    essence.trim().to_ascii_lowercase()
}
