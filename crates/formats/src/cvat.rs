//! CVAT for video 1.1: a track for each target, with a key frame for each row. CVAT interpolates between key frames,
//! and shows a box until a key frame is marked `outside`. So a key frame is `outside` where the target is lost, and
//! after the last row where the video goes on.

use super::clip::Clip;
use super::row::Row;
use bagtrack_tracker::Status;

/// The document of rows in the order of frames.
pub fn document(clip: &Clip, rows: &[Row]) -> String {
    let size = Clip::length(rows);
    let (width, height) = clip.size;
    let labels = clip.classes().into_iter().map(|name| {
        format!(
            "<label><name>{}</name><attributes></attributes></label>",
            escaped(name)
        )
    });
    let labels: String = labels.collect();
    let names = clip.names.iter().enumerate();
    let tracks: Vec<String> = names
        .map(|(target, name)| track(clip, rows, target, name))
        .collect();
    format!(
        r#"<?xml version="1.0" encoding="utf-8"?>
<annotations>
<version>1.1</version>
<meta><task><name>{name}</name><size>{size}</size><mode>interpolation</mode><start_frame>0</start_frame>
<stop_frame>{last}</stop_frame><labels>{labels}</labels>
<original_size><width>{width}</width><height>{height}</height></original_size></task></meta>
{tracks}
</annotations>
"#,
        name = escaped(&clip.name),
        last = size.saturating_sub(1),
        tracks = tracks.join("\n"),
    )
}

fn track(clip: &Clip, rows: &[Row], target: usize, name: &str) -> String {
    let own: Vec<&Row> = rows.iter().filter(|row| row.target == target).collect();
    let boxes = own
        .iter()
        .map(|row| key_frame(row, row.frame, row.estimate.status == Status::Lost));
    let end = own
        .last()
        .filter(|last| clip.goes_on && last.estimate.status != Status::Lost);
    let end = end.map(|last| key_frame(last, last.frame + 1, true));
    format!(
        "<track id=\"{target}\" label=\"{}\" source=\"semi-auto\">\n{}</track>",
        escaped(name),
        boxes.chain(end).collect::<String>()
    )
}

fn key_frame(row: &Row, frame: u64, is_outside: bool) -> String {
    let area = row.estimate.target;
    format!(
        "<box frame=\"{frame}\" outside=\"{}\" occluded=\"0\" keyframe=\"1\" xtl=\"{:.2}\" ytl=\"{:.2}\" xbr=\"{:.2}\" \
         ybr=\"{:.2}\" z_order=\"0\"></box>\n",
        u8::from(is_outside),
        area.x,
        area.y,
        area.x + area.width,
        area.y + area.height
    )
}

/// `text` escaped for the content of an element or an attribute.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for sign in text.chars() {
        match sign {
            '<' | '>' | '&' | '"' => escaped += &format!("&#{};", u32::from(sign)),
            // XML allows no control characters, and names of files may have some.
            other if other.is_control() => escaped.push('\u{fffd}'),
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}
