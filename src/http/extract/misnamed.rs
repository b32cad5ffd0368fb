//! Problems that name likely mistakes: files under another name than `frame` (the likeliest of all), boxes under
//! another name than `box`, and settings in the wrong place.

use crate::http::problems::problem::Problem;
use bagtrack_api::ProblemKind as Kind;
use bagtrack_api::requests::{FrameCount, Settings};
use bagtrack_ingest::{self as ingest, video};
use bagtrack_tracker::Params;
use serde_json::{Value, json};

/// Names of files in other services' interfaces, without `[]` at the end.
const FILE_NAMES: [&str; 16] = [
    "data", "file", "files", "frame", "frames", "image", "images", "img", "imgs", "media", "photo",
    "photos", "picture", "pictures", "upload", "video",
];

/// Names of boxes and of their sides in other services' interfaces.
const BOX_NAMES: [&str; 12] = [
    "bbox", "h", "height", "left", "rect", "region", "roi", "top", "w", "width", "x", "y",
];

fn is_name_of_file(name: &str) -> bool {
    let name = name.trim_end_matches("[]").to_ascii_lowercase();
    FILE_NAMES.contains(&&*name)
}

fn is_setting<S: Settings>(name: &str) -> bool {
    let settings = S::into_params(|| None);
    settings.iter().any(|setting| setting.name == name)
}

/// The problem of a form's part with this name and these first bytes; `None` unless it is a misnamed file.
pub(super) fn part<S: Settings>(name: &str, has_file_name: bool, bytes: &[u8]) -> Option<Problem> {
    if is_setting::<S>(name) {
        return None;
    }
    let is_file = ingest::type_name(bytes).is_some() || video::video_format(bytes, "").is_some();
    let is_named = is_name_of_file(name) && (has_file_name || bytes.is_empty());
    (is_file || is_named).then(|| {
        let name = shown(name);
        let detail = format!(
            "The file is in the part `{name}`; name it `frame`: `-F frame=@picture.jpg`. Several frames are several \
             parts with this name."
        );
        Problem::new(Kind::MissingFrame, detail)
    })
}

/// The problem of a JSON field with this name and value; `None` unless it is a misnamed file.
pub(super) fn field<S: Settings>(name: &str, value: &str) -> Option<Problem> {
    let is_text = value.starts_with(['"', '[']);
    (is_text && is_name_of_file(name) && !is_setting::<S>(name)).then(|| {
        let name = shown(name);
        let detail = match S::FRAMES {
            FrameCount::Several => format!(
                "There is no field `{name}`. Send the file as base64 in `frame`, several in the array `frames`."
            ),
            FrameCount::One => {
                format!("There is no field `{name}`. Send the file as base64 in `frame`.")
            }
        };
        Problem::new(Kind::MissingFrame, detail)
    })
}

/// The problem of an unknown setting with this name and value; `None` where it is not clear what was meant.
pub(super) fn setting<S: Settings>(name: &str, text: &str) -> Option<Problem> {
    if is_setting::<S>(name) {
        return None;
    }
    parameter::<S>(name, text).or_else(|| rect::<S>(name))
}

/// The problem of a box under a wrong name, or where no box is taken.
fn rect<S: Settings>(name: &str) -> Option<Problem> {
    let detail = match is_setting::<S>("box") {
        true if BOX_NAMES.contains(&&*name.to_ascii_lowercase()) => {
            format!("There is no setting `{name}`. A box is one setting: `box=x,y,width,height`.")
        }
        false if matches!(name, "box" | "boxes") => {
            "No box is taken here: `POST /sessions` takes that of the first \
            frame, and `PUT /sessions/{id}/target` a corrected one with a later frame."
                .to_owned()
        }
        _ => return None,
    };
    Some(Problem::malformed(detail))
}

/// The problem of a parameter of the tracker that is given as a setting.
fn parameter<S: Settings>(name: &str, text: &str) -> Option<Problem> {
    Params::TABLE.iter().find(|row| row.name == name)?;
    let value = serde_json::from_str::<Value>(text).unwrap_or_else(|_| text.into());
    let detail = match is_setting::<S>("parameters") {
        true => format!(
            "`{name}` is a parameter of the tracker: it goes into the JSON object `parameters`, like parameters={}.",
            json!({ name: value })
        ),
        false => format!(
            "`{name}` is a parameter of the tracker. It is given when the session is opened, in the JSON object \
             `parameters`, and stays."
        ),
    };
    Some(Problem::malformed(detail))
}

fn shown(name: &str) -> String {
    name.chars().take(64).collect()
}
