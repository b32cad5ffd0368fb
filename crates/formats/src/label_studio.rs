//! Label Studio's JSON: a task with a `videorectangle` for each target, for a labelling with `<VideoRectangle
//! name="box" toName="video"/>`. Frames count from 1, boxes are in percent. After a key frame that is not enabled the
//! region is not shown.

use super::clip::Clip;
use super::row::Row;
use bagtrack_tracker::Status;
use serde::Serialize;

#[derive(Serialize)]
struct Task<'a> {
    data: Data<'a>,
    annotations: [Annotation<'a>; 1],
}

#[derive(Serialize)]
struct Data<'a> {
    video: &'a str,
}

#[derive(Serialize)]
struct Annotation<'a> {
    result: Vec<Region<'a>>,
}

#[derive(Serialize)]
struct Region<'a> {
    id: String,
    r#type: &'static str,
    from_name: &'static str,
    to_name: &'static str,
    value: Value<'a>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Value<'a> {
    frames_count: u64,
    duration: f64,
    labels: [&'a str; 1],
    sequence: Vec<KeyFrame>,
}

#[derive(Serialize)]
struct KeyFrame {
    frame: u64,
    time: f64,
    enabled: bool,
    rotation: u8,
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

/// The document of rows in the order of frames.
pub fn document(clip: &Clip, rows: &[Row]) -> serde_json::Result<String> {
    let frames_count = Clip::length(rows);
    // The last frame is shown as long as a frame is on average.
    let last = rows
        .iter()
        .map(|row| seconds(clip, row))
        .fold(0.0, f64::max);
    let duration = ((last + 1.0 / clip.rate) * 1000.0).round() / 1000.0;
    let names = clip.names.iter().enumerate();
    let result = names.map(|(target, name)| Region {
        id: format!("object-{}", target + 1),
        r#type: "videorectangle",
        from_name: "box",
        to_name: "video",
        value: Value {
            frames_count,
            duration,
            labels: [name],
            sequence: sequence(clip, rows, target),
        },
    });
    super::pretty(&[Task {
        data: Data { video: &clip.name },
        annotations: [Annotation {
            result: result.collect(),
        }],
    }])
}

/// The key frames of a target. A key frame that is not enabled is itself shown, and nothing after it. So it is the last
/// row before the target is lost; where the rows are key frames and that one was left out, it is the first row in which
/// the target is lost.
fn sequence(clip: &Clip, rows: &[Row], target: usize) -> Vec<KeyFrame> {
    let mut sequence: Vec<KeyFrame> = Vec::new();
    for row in rows.iter().filter(|row| row.target == target) {
        let key_frame = key_frame(clip, row);
        if key_frame.enabled {
            sequence.push(key_frame);
            continue;
        }
        match sequence.last_mut().filter(|before| before.enabled) {
            Some(before) if before.frame + 1 == key_frame.frame => before.enabled = false,
            Some(_) => sequence.push(key_frame),
            None => {}
        }
    }
    if let Some(last) = sequence.last_mut().filter(|_| clip.goes_on) {
        last.enabled = false;
    }
    sequence
}

/// When a row's frame is shown.
fn seconds(clip: &Clip, row: &Row) -> f64 {
    row.time.unwrap_or(row.frame as f64 / clip.rate)
}

fn key_frame(clip: &Clip, row: &Row) -> KeyFrame {
    let area = row.estimate.target;
    let (width, height) = (f64::from(clip.size.0), f64::from(clip.size.1));
    KeyFrame {
        frame: row.frame + 1,
        time: seconds(clip, row),
        enabled: row.estimate.status != Status::Lost,
        rotation: 0,
        x: 100.0 * area.x / width,
        y: 100.0 * area.y / height,
        width: 100.0 * area.width / width,
        height: 100.0 * area.height / height,
    }
}
