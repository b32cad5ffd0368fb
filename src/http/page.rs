//! `/`: a page for people that says what the service is and how to call it.

use axum::response::Html;

/// The page.
pub async fn index() -> Html<&'static str> {
    Html(include_str!("page.html"))
}
