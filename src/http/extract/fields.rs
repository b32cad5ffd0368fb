//! What a body holds before its settings are parsed.

use super::texts::Texts;
use axum::body::Bytes;

/// The files of a body, and the texts of its settings.
#[derive(Debug)]
pub(super) struct Fields {
    /// The files, in order.
    pub(super) files: Vec<Bytes>,
    /// The snapshot beside the files.
    pub(super) snapshot: Option<Bytes>,
    /// The texts.
    pub(super) texts: Texts,
}
