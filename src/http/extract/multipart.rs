//! Multipart uploads: `frame` parts are files, and `snapshot` is one where a route takes it; all others are settings.

use super::body::{self, Buffer};
use super::misnamed;
use super::settings::Settings;
use super::texts::MAX_TEXT_BYTES;
use super::uploaded::Fields;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::extract::multipart::{Field, MultipartError};
use axum::extract::{FromRequest, Multipart, Request};
use bagtrack_sessions::ByteCharge;

/// Adds the parts of a multipart body to `fields`: at most `max_files` files. The router limits all bodies to
/// `max_bytes` bytes. What is kept is charged to `charge`.
pub(super) async fn read<S: Settings>(
    request: Request,
    max_bytes: usize,
    max_files: usize,
    fields: &mut Fields,
    charge: &mut ByteCharge,
) -> Result<(), Problem> {
    let failed = |error: MultipartError| body::problem(&error, max_bytes);
    let mut multipart = Multipart::from_request(request, &()).await.map_err(|_| {
        Problem::malformed("The content type has no valid `boundary`; let the HTTP client set it.")
    })?;
    while let Some(part) = multipart.next_field().await.map_err(failed)? {
        let name = part.name().unwrap_or("").to_owned();
        if name == "snapshot" && S::TAKES_SNAPSHOT && fields.snapshot.is_none() {
            fields.snapshot = Some(read_part(part, max_bytes, max_bytes, charge).await?);
        } else if name != "frame" {
            // One byte more than may be, so that a longer text is refused as such.
            let has_file_name = part.file_name().is_some();
            let text = read_part(part, max_bytes, MAX_TEXT_BYTES + 1, charge).await?;
            if let Some(problem) = misnamed::part::<S>(&name, has_file_name, &text) {
                return Err(problem);
            }
            fields.texts.add(&name, &String::from_utf8_lossy(&text))?;
        } else if fields.files.len() < max_files {
            let file = read_part(part, max_bytes, max_bytes, charge).await?;
            fields.files.push(file);
        } else {
            return Err(Problem::too_many_frames(max_files));
        }
    }
    Ok(())
}

/// The bytes of a part; no more than about `enough` are kept.
async fn read_part(
    mut part: Field<'_>,
    max_bytes: usize,
    enough: usize,
    charge: &mut ByteCharge,
) -> Result<Bytes, Problem> {
    let mut buffer = Buffer::new(enough, charge);
    while let Some(piece) = part
        .chunk()
        .await
        .map_err(|error| body::problem(&error, max_bytes))?
    {
        if buffer.len() < enough {
            buffer.add(&piece)?;
        }
    }
    Ok(buffer.finish())
}
