//! The routes that are in the OpenAPI document, and what the document says of the service as a whole.

use super::{
    bag_picture, correction, frames, health, metrics, open, session, snapshot, token, track,
    version, video_frames,
};
use crate::http::state::AppState;
use crate::http::stream::handshake;
use bagtrack_api::ProblemDocument;
use bagtrack_api::openapi;
use utoipa::OpenApi;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "bagtrack",
        description = "Follows an object, or up to 16, through the frames that you upload. The first frame and a box \
            (`box`), or several (`boxes`), open a session; every further frame gets a box of each back.\n\n\
            A frame is sent as a raw body (the settings are in the query), as `multipart/form-data`, or as JSON \
            with base64. Its type is taken from its bytes: JPEG, PNG or WebP. Boxes are in the pixels of the \
            uploaded frame. Every error is a [problem document](problems) (RFC 9457) and leaves the session as it \
            was, but for `work-timeout`, which says what to do. The `type` of a problem opens as a page. Paths that do \
            not exist answer `route-not-found` (404). \
            Requests of web pages from origins that are not allowed answer `origin-not-allowed` (403), and requests \
            to hosts that are not allowed `host-not-allowed` (421). Who asks too often gets `quota-exceeded` (429).\n\n\
            Where the service has API keys, a request needs one, or a session token: `Authorization: Bearer …`. \
            While the service is about to end, all answers have the header `Draining: true`.",
        contact(name = "The authors of bagtrack")
    ),
    servers((url = "/", description = "The service that this document comes from")),
    tags(
        (name = "sessions", description = "Open a session, send frames, end it"),
        (name = "service", description = "The service itself")
    ),
    components(schemas(ProblemDocument)),
    modifiers(&Bearer),
    // A service without keys needs none.
    security((), ("bearer" = []))
)]
struct Api;

struct Bearer;

impl utoipa::Modify for Bearer {
    fn modify(&self, document: &mut utoipa::openapi::OpenApi) {
        let text = "An API key, a token of the service's issuer (JWT), or a session token, which is good for one session. \
            Needed where the service has keys or an issuer.";
        let scheme = HttpBuilder::new().scheme(HttpAuthScheme::Bearer);
        let scheme = SecurityScheme::Http(scheme.description(Some(text)).build());
        let components = document.components.get_or_insert_default();
        components.add_security_scheme("bearer", scheme);
    }
}

/// The routes of sessions, with what the document says about them.
pub fn sessions() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(open::create))
        .routes(routes!(session::get, session::delete, open::put))
        .routes(routes!(frames::post))
        .routes(routes!(correction::put))
        .routes(routes!(snapshot::get))
        .routes(routes!(bag_picture::get))
        .routes(routes!(token::create))
        .routes(routes!(track::post))
        .routes(routes!(video_frames::post))
        .routes(routes!(handshake::open))
}

pub fn metrics() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(metrics::get))
}

pub fn version() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(version::get))
}

/// The probes, which everybody may use.
pub fn probes() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
}

/// The OpenAPI document as JSON, of a service at the root of its host.
pub fn document() -> String {
    document_at("/")
}

/// The OpenAPI document of a service at this path.
pub fn document_at(base_path: &str) -> String {
    let handlers = OpenApiRouter::with_openapi(Api::openapi())
        .merge(sessions())
        .merge(version())
        .merge(metrics())
        .merge(probes());
    openapi::document(&handlers.into_openapi(), base_path)
}
