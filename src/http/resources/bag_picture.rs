//! `GET /sessions/{id}/bag.png`: the bag as a contact sheet.

use crate::drawing::ContactSheet;
use crate::http::extract::admitted::ReadRequest;
use crate::http::extract::query::QuerySettings;
use crate::http::problems::problem::Problem;
use crate::http::respond::body::{ChargedBody, charged_body};
use crate::http::state::AppState;
use axum::extract::State;
use bagtrack_api::requests::{BagSettings, BinaryBody};
use bagtrack_sessions::SessionState;
use std::sync::Arc;

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
    request: ReadRequest<QuerySettings<BagSettings>>,
) -> Result<ChargedBody, Problem> {
    let (QuerySettings(settings), mut charge) = (request.query, request.charge);
    let target = settings.target.unwrap_or(0);
    let count = request.permit.session().target_count();
    let draw = move |state: &SessionState| {
        let bag = state.bag(target);
        let sheet = ContactSheet::of(&bag.ok_or_else(|| Problem::which_target(count))?);
        // Room for the pixels, and for the PNG file.
        charge.grow(2 * sheet.bytes())?;
        let png = sheet.png();
        let png = png.map_err(|error| Problem::internal(Arc::new(error)))?;
        Ok(charged_body("image/png", png, charge))
    };
    let service = &state.service;
    service.read(request.permit, request.queue, draw).await
}
