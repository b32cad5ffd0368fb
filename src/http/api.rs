//! The routes that are in the OpenAPI document, and the document itself, which is generated from their handlers.

use super::problems::document::ProblemDocument;
use super::state::AppState;
use super::{create, frames, health, session, snapshot, target};
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "bagtrack",
        description = "Follows one object through the frames that you upload. The first frame and a box open a \
            session; every further frame gets a box back.\n\n\
            A frame is sent as a raw body (the settings are in the query), as `multipart/form-data`, or as JSON \
            with base64. Its type is taken from its bytes: JPEG, PNG or WebP. Boxes are in the pixels of the \
            uploaded frame. Every error is a problem document (RFC 9457) and leaves the session as it was, but for \
            `work-timeout`, which says what to do. Paths that do not exist answer `route-not-found` (404)."
    ),
    tags(
        (name = "sessions", description = "Open a session, send frames, end it"),
        (name = "service", description = "The service itself")
    ),
    components(schemas(ProblemDocument))
)]
struct Api;

/// The routes, with what the document says about them.
pub fn api() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(Api::openapi())
        .routes(routes!(create::create))
        .routes(routes!(session::get, session::delete))
        .routes(routes!(frames::post))
        .routes(routes!(target::put))
        .routes(routes!(snapshot::get))
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
}

/// The OpenAPI document.
pub fn document() -> utoipa::openapi::OpenApi {
    api().into_openapi()
}
