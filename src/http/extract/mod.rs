//! Takes frames and settings out of a request, in any of three forms, and finds its caller.
//!
//! In: a request whose body is a raw file, `multipart/form-data`, or JSON with base64. JSON is what begins with `{`,
//! after blanks. A raw body may have any content type: the type of a frame is taken from its bytes, curl labels what it
//! sends as `application/x-www-form-urlencoded` unless it is told otherwise, and generated clients label a file as JSON
//! where a call takes both. Settings come in the query, or as fields of the form or the JSON. Where both have a
//! setting, the field counts. Neither may have a setting twice.
//!
//! Out: an [`Upload`](admitted::Upload) with the files and the [`Settings`](bagtrack_api::requests::Settings) type of
//! the route. Handlers get the upload by an extractor, which refuses a request as early as it can: first for its query,
//! then for what the route needs besides (a session, room for one), then for its announced length, a full queue and the
//! client's quota, and only then for its body. Memory is charged as the bytes of the body arrive, and a place in the
//! queue is taken when all of them are there.
//!
//! What can go wrong: the body is slow, too large or not what it says; parsed JSON takes many times the memory of its
//! text; a setting is unknown, doubled or no value of its type. Each gets a problem document, and no session changes.

pub mod admitted;
pub mod answer_form;
pub mod body;
pub mod caller;
pub mod instance;
mod json;
mod misnamed;
mod multipart;
pub mod overrides;
pub mod query;
pub mod texts;
pub mod video_frames;
pub mod video_range;
