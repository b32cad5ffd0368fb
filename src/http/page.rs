//! `/`: what this is, for a person who opens the address in a browser.

use axum::response::Html;

/// The page.
pub async fn index() -> Html<&'static str> {
    Html(include_str!("page.html"))
}
