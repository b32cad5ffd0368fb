//! `GET /sessions/{id}/bag.png`: the bag as a contact sheet.

use super::session_path::SessionPath;
use super::snapshot::charged;
use crate::http::openapi::request_bodies::BinaryBody;
use crate::http::problems::problem::Problem;
use crate::http::quotas::client::Client;
use crate::http::state::AppState;
use axum::Extension;
use axum::extract::{Query, State};
use axum::http::Uri;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use bagtrack_sessions::{ByteCharge, SessionState};
use bagtrack_tracker::{BagEntry, VectorView};
use image::{ImageFormat, Rgb, RgbImage};
use std::io::Cursor;
use std::sync::Arc;

/// Longest side of a vector's picture in pixels.
const TILE: u32 = 64;
const GAP: u32 = 4;
const GROUND: Rgb<u8> = Rgb([24, 25, 28]);

/// The settings of the picture.
#[derive(Debug, Default, serde::Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct BagSettings {
    /// Whose bag, counted from 0, in a session that was opened with `boxes`.
    #[param(value_type = u32, required = false, nullable = false, maximum = 15, default = 0)]
    target: Option<usize>,
}

/// See the bag
///
/// A row for each affine subspace of the bag, oldest first: its mean, then the columns of its basis. With gradient
/// features each vector has two pictures: its gray values (in colour where the mean has any), and the strength of its
/// gradients. In a basis, positive values are bright and negative ones dark.
#[utoipa::path(
    get, path = "/sessions/{id}/bag.png", tag = "sessions", operation_id = "getBagPicture",
    params(("id" = Uuid, Path, description = "The session's id"), BagSettings),
    responses(
        (
            status = 200, description = "The picture", body = BinaryBody, content_type = "image/png"
        )
    )
)]
pub async fn get(
    State(state): State<AppState>,
    path: SessionPath,
    uri: Uri,
    Extension(client): Extension<Client>,
) -> Result<Response, Problem> {
    let Query(settings) = Query::<BagSettings>::try_from_uri(&uri)
        .map_err(|error| Problem::malformed(format!("The query cannot be read: {error}.")))?;
    let session = path.find(&state).await?;
    let (target, count) = (settings.target.unwrap_or(0), session.target_count());
    state.service.admission.check_place()?;
    let request = state.clients.account(&client).request()?;
    let mut charge = ByteCharge::new(&state.uploads, request.bytes());
    let queue = state
        .service
        .admission
        .enter(request.flow(), Box::new(request))?;
    let draw = move |state: &SessionState| {
        let bag = state.bag(target);
        let bytes = draw(
            &bag.ok_or_else(|| Problem::which_target(count))?,
            &mut charge,
        )?;
        charge.shrink(bytes.len());
        Ok((bytes, charge))
    };
    let (bytes, charge) = state
        .service
        .read::<_, Problem, _>(session.read_permit()?, queue, draw)
        .await?;
    // The bytes stay in memory until the client has taken them.
    Ok(([(CONTENT_TYPE, "image/png")], charged(bytes, charge)).into_response())
}

/// The sheet as a PNG file, with the memory that it takes.
fn draw(bag: &[BagEntry], charge: &mut ByteCharge) -> Result<Vec<u8>, Problem> {
    let rows: Vec<Vec<RgbImage>> = bag.iter().map(tiles).collect();
    let across = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let tile = rows.iter().flatten().next();
    let (width, height) = tile.map_or((1, 1), RgbImage::dimensions);
    let (step_x, step_y) = (width + GAP, height + GAP);
    let size = (GAP + across * step_x, GAP + rows.len() as u32 * step_y);
    // The pixels, and a file that is no larger but for a little.
    charge.grow(2 * 3 * size.0 as usize * size.1 as usize)?;
    let mut sheet = RgbImage::from_pixel(size.0, size.1, GROUND);
    for (y, row) in rows.iter().enumerate() {
        for (x, tile) in row.iter().enumerate() {
            let (x, y) = (GAP + x as u32 * step_x, GAP + y as u32 * step_y);
            image::imageops::replace(&mut sheet, tile, x.into(), y.into());
        }
    }
    let mut bytes = Cursor::new(Vec::new());
    let written = sheet.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(|error| Problem::internal(Arc::new(error)))?;
    Ok(bytes.into_inner())
}

/// The pictures of an entry.
fn tiles(entry: &BagEntry) -> Vec<RgbImage> {
    let mut tiles = Vec::new();
    for (vector, is_mean) in
        std::iter::once((&entry.mean, true)).chain(entry.basis.iter().map(|column| (column, false)))
    {
        let chroma = vector.chroma.as_ref().filter(|_| is_mean);
        tiles.push(tile(vector, &vector.gray, chroma));
        if let Some(gradient) = &vector.gradient {
            tiles.push(tile(vector, gradient, None));
        }
    }
    tiles
}

/// One value a cell as gray, from the least to the greatest; 0 is in the middle where there are values on both sides.
fn tile(vector: &VectorView, values: &[f32], chroma: Option<&[Vec<f32>; 2]>) -> RgbImage {
    let least = values.iter().copied().fold(f32::INFINITY, f32::min);
    let most = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let (low, high) = match least < 0.0 {
        true => (-least.abs().max(most.abs()), least.abs().max(most.abs())),
        false => (least, most),
    };
    let range = (high - low).max(f32::MIN_POSITIVE);
    let most_chroma = chroma.into_iter().flatten().flatten();
    let most_chroma = most_chroma.fold(f32::MIN_POSITIVE, |most, value| most.max(value.abs()));
    let side = (TILE / vector.columns.max(vector.rows)).max(1);
    RgbImage::from_fn(vector.columns * side, vector.rows * side, |x, y| {
        let cell = (y / side * vector.columns + x / side) as usize;
        let gray = 255.0 * (values[cell] - low) / range;
        let [blue, red] = match chroma {
            Some([blue, red]) => [blue[cell], red[cell]].map(|value| 60.0 * value / most_chroma),
            None => [0.0; 2],
        };
        // Full-range BT.601.
        let color = [
            gray + 1.402 * red,
            gray - 0.344 * blue - 0.714 * red,
            gray + 1.772 * blue,
        ];
        Rgb(color.map(|value| value.round().clamp(0.0, 255.0) as u8))
    })
}
