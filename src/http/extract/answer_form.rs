//! In which form a client wants its answer.

use axum::http::header::ACCEPT;
use axum::http::{HeaderMap, HeaderName};
use bagtrack_api::media_types::LINES;

/// The form of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnswerForm {
    /// JSON, when all frames are tracked.
    Json,
    /// A line of JSON for each frame, as soon as it is tracked.
    Lines,
    /// The frame as PNG, with the answer drawn on it.
    Picture,
}

impl AnswerForm {
    /// The form with the highest quality in the header `Accept`, the first of equals; JSON where it names no form.
    pub fn of(headers: &HeaderMap) -> Self {
        let mut best = (0.0, Self::Json);
        for (name, quality) in qualities(headers, ACCEPT) {
            let form = match name.as_str() {
                LINES | "application/ndjson" | "application/jsonl" => Self::Lines,
                "image/png" => Self::Picture,
                "application/json" | "application/*" | "*/*" => Self::Json,
                _ => continue,
            };
            if quality > best.0 {
                best = (quality, form);
            }
        }
        best.1
    }
}

/// Most items of a header's list that are read. Browsers send about five.
pub const MAX_ITEMS: usize = 64;

/// The items of a header like `Accept`: their names in lower case, and their qualities, 1 where none is given (RFC
/// 9110, section 12.4.2).
pub fn qualities(headers: &HeaderMap, name: HeaderName) -> impl Iterator<Item = (String, f32)> {
    let values = headers.get_all(name).into_iter();
    let texts = values.filter_map(|value| value.to_str().ok());
    let items = texts.flat_map(|text| text.split(',')).take(MAX_ITEMS);
    items.map(|item| {
        let mut parts = item.split(';').map(str::trim);
        let name = parts.next().unwrap_or_default().to_ascii_lowercase();
        let quality = parts.find_map(|part| part.strip_prefix("q=")?.trim().parse().ok());
        (name, quality.unwrap_or(1.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_form_liked_best_counts_and_the_first_of_equals() {
        let form = |text: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(ACCEPT, text.parse().unwrap());
            AnswerForm::of(&headers)
        };
        assert_eq!(AnswerForm::of(&HeaderMap::new()), AnswerForm::Json);
        assert_eq!(form("*/*"), AnswerForm::Json);
        assert_eq!(form("text/html, image/*"), AnswerForm::Json);
        assert_eq!(form("image/png"), AnswerForm::Picture);
        assert_eq!(form("Application/X-NDJSON, */*"), AnswerForm::Lines);
        assert_eq!(form("application/json, image/png"), AnswerForm::Json);
        assert_eq!(form("*/*;q=0.1, image/png;q=0.5"), AnswerForm::Picture);
        assert_eq!(form("image/png; q=0, application/jsonl"), AnswerForm::Lines);
        assert_eq!(form("image/png;q=0"), AnswerForm::Json);
    }
}
