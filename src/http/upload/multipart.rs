//! Multipart uploads: `frame` parts, and settings as text parts.

use super::{Form, Upload};
use crate::http::body;
use crate::http::problem::Problem;
use axum::extract::multipart::MultipartError;
use axum::extract::{FromRequest, Multipart, Request};

/// Reads a multipart body of at most `limit` bytes (which the router sets as the limit of all bodies) with at most
/// `most` frames.
pub async fn read(
    form: &Form,
    limit: usize,
    most: usize,
    request: Request,
    upload: &mut Upload,
) -> Result<(), Problem> {
    let failed = |error: MultipartError| body::problem(&error, limit);
    let mut multipart = Multipart::from_request(request, &()).await.map_err(|_| {
        Problem::malformed("The content type has no valid `boundary`; let the HTTP client set it.")
    })?;
    while let Some(field) = multipart.next_field().await.map_err(failed)? {
        let name = field.name().unwrap_or("").to_owned();
        if name == "frame" {
            if upload.frames.len() >= most {
                return Err(Problem::too_many_frames(most));
            }
            upload.frames.push(field.bytes().await.map_err(failed)?);
        } else if form.settings.contains(&name.as_str()) {
            let text = field.text().await.map_err(failed)?;
            upload.fields.set(&name, &text)?;
        } else {
            return Err(form.unknown("part", &name, ["frame"]));
        }
    }
    Ok(())
}
