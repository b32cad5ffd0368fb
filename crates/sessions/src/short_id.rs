//! Ids as the log has them.

use uuid::Uuid;

/// The beginning of an id, for the log.
pub fn short_id(id: Uuid) -> String {
    let mut text = id.simple().to_string();
    text.truncate(8);
    text.push('…');
    text
}
