//! Multipart uploads: `frame` parts are files, all others are settings.

use super::body;
use super::fields::Fields;
use crate::http::problems::problem::Problem;
use axum::extract::multipart::MultipartError;
use axum::extract::{FromRequest, Multipart, Request};

/// Adds the parts of a multipart body to `fields`: at most `max_files` files. The router limits all bodies to
/// `max_bytes` bytes.
pub(super) async fn read(
    request: Request,
    max_bytes: usize,
    max_files: usize,
    fields: &mut Fields,
) -> Result<(), Problem> {
    let failed = |error: MultipartError| body::problem(&error, max_bytes);
    let mut multipart = Multipart::from_request(request, &()).await.map_err(|_| {
        Problem::malformed("The content type has no valid `boundary`; let the HTTP client set it.")
    })?;
    while let Some(part) = multipart.next_field().await.map_err(failed)? {
        let name = part.name().unwrap_or("").to_owned();
        if name != "frame" {
            let text = part.text().await.map_err(failed)?;
            fields.texts.add(&name, &text)?;
        } else if fields.files.len() < max_files {
            fields.files.push(part.bytes().await.map_err(failed)?);
        } else {
            return Err(Problem::too_many_frames(max_files));
        }
    }
    Ok(())
}
