//! `POST /track` with a video and a format: one file when all is tracked, as `bagtrack track --format` writes it.

use super::track_video::{TrackedFrame, VideoTrack};
use crate::http::problems::problem::Problem;
use crate::http::respond::body::charged_body;
use axum::response::{IntoResponse, Response};
use bagtrack_api::ProblemKind as Kind;
use bagtrack_api::media_types::LINES;
use bagtrack_api::requests::TrackSettings;
use bagtrack_formats::{Clip, Columns, FileFormat, Row};
use bagtrack_sessions::{Charge, Selection, WorkMeter};
use std::sync::Arc;

/// Most bytes that a row and its part of the file take.
const ROW_BYTES: usize = 1024;
/// Frames a second, where neither the caller nor the video tells.
const USUAL_RATE: f64 = 25.0;

/// What a file of tracked boxes says beside the boxes.
#[derive(Debug)]
pub struct TrackFile {
    format: FileFormat,
    /// What each target is called.
    names: Vec<String>,
    /// What the video is called.
    video: String,
    /// Frames a second, in place of the video's own times.
    rate: Option<f64>,
}

/// What is known of the video once it is tracked.
#[derive(Debug, Default)]
struct Seen {
    size: (u32, u32),
    /// The greatest number of a frame, and when that is shown, in seconds after frame 0.
    furthest: (u64, f64),
    /// Whether there is a frame after all that were tracked.
    goes_on: bool,
}

impl Seen {
    fn take(&mut self, frame: &TrackedFrame) {
        self.size = frame.size;
        if frame.number > self.furthest.0 {
            self.furthest = (frame.number, frame.time);
        }
    }

    /// Frames a second, on average.
    fn rate(&self) -> Option<f64> {
        let (number, time) = self.furthest;
        (time > 0.0).then(|| number as f64 / time)
    }
}

impl TrackFile {
    /// The file that is asked for; `None` without `format`, where each frame is answered by a line.
    ///
    /// # Errors
    /// The format cannot hold what is asked for, there are more names than targets, or `names`, `video_name` or `rate`
    /// come without `format`.
    pub fn asked(settings: &TrackSettings) -> Result<Option<Self>, Problem> {
        let Some(format) = settings.format else {
            let said = [
                settings.names.is_some(),
                settings.video_name.is_some(),
                settings.rate.is_some(),
            ];
            return match said.contains(&true) {
                true => Err(Problem::malformed(
                    "`names`, `video_name` and `rate` are written to a file: give its `format`.",
                )),
                false => Ok(None),
            };
        };
        let boxes = settings.boxes.as_ref();
        let targets = boxes.map_or(1, |boxes| boxes.as_slice().len());
        let fits = format.check(targets, settings.keyframes.0);
        fits.map_err(|unfit| Problem::malformed(format!("`format`: {unfit}.")))?;
        Ok(Some(Self {
            format,
            names: names(settings, targets)?,
            video: match &settings.video_name {
                Some(name) => name.0.clone(),
                None => "video".to_owned(),
            },
            rate: settings.rate.map(|rate| rate.0),
        }))
    }

    /// Tracks the video to its end, and answers with the file. Its memory is charged as its rows come.
    ///
    /// # Errors
    /// A frame cannot be decoded or tracked, or there is no memory for the rows.
    pub async fn respond(
        self,
        mut video: VideoTrack,
        mut selection: Selection<Row>,
        mut charge: Charge,
    ) -> Result<Response, Problem> {
        let (mut rows, mut seen) = (Vec::new(), Seen::default());
        while !selection.has_ended() {
            let next = video.next().await;
            let Some(frame) = next.map_err(|problem| before(problem, video.frames.given()))? else {
                break;
            };
            seen.take(&frame);
            let new = selection.take(self.rows(&frame));
            charge.grow(ROW_BYTES * new.len())?;
            rows.extend(new);
        }
        let last = selection.finish();
        charge.grow(ROW_BYTES * last.len())?;
        rows.extend(last);
        seen.goes_on = video.frames.go_on().await;
        let media_type = media_type(self.format);
        let write = move |_: &mut WorkMeter| self.write(rows, &seen);
        let queue = video.queue.clone();
        let text = video.state.service.run(queue, write).await?;
        Ok(charged_body(media_type, text, charge).into_response())
    }

    fn rows(&self, frame: &TrackedFrame) -> Vec<(bagtrack_tracker::Estimate, Row)> {
        let estimates = frame.estimates.as_slice().iter().enumerate();
        let rows = estimates.map(|(target, estimate)| {
            let row = Row {
                frame: frame.number,
                time: Some(micros(match self.rate {
                    Some(rate) => frame.number as f64 / rate,
                    None => frame.time,
                })),
                file: None,
                target,
                estimate: *estimate,
            };
            (*estimate, row)
        });
        rows.collect()
    }

    fn write(self, rows: Vec<Row>, seen: &Seen) -> Result<String, Problem> {
        let columns = Columns {
            time: true,
            target: self.names.len() > 1,
        };
        let clip = Clip {
            name: self.video,
            size: seen.size,
            rate: self.rate.or(seen.rate()).unwrap_or(USUAL_RATE),
            names: self.names,
            goes_on: seen.goes_on,
        };
        let text = self.format.text(&clip, columns, rows);
        text.map_err(|error| Problem::internal(Arc::new(error)))
    }
}

/// Adds to a problem of the video how to get the file of the frames before the bad one.
fn before(problem: Problem, given: u64) -> Problem {
    let is_of_video = matches!(
        problem.kind(),
        Kind::FrameDamaged | Kind::FrameTooLarge | Kind::RequestTooCostly | Kind::TooManyFrames
    );
    match given.checked_sub(1) {
        Some(count) if is_of_video => problem.and(&format!(
            "`count={count}` gives the file of the frames before it."
        )),
        _ => problem,
    }
}

/// A time as videos have it, whole microseconds.
fn micros(seconds: f64) -> f64 {
    (seconds * 1e6).round() / 1e6
}

fn media_type(format: FileFormat) -> &'static str {
    match format {
        FileFormat::Text | FileFormat::Otb | FileFormat::Mot => "text/plain; charset=utf-8",
        FileFormat::Json => LINES,
        FileFormat::Csv => "text/csv; charset=utf-8",
        FileFormat::Coco | FileFormat::LabelStudio => "application/json",
        FileFormat::Cvat => "application/xml",
    }
}

fn names(settings: &TrackSettings, targets: usize) -> Result<Vec<String>, Problem> {
    let given = settings.names.iter().flat_map(|names| &names.0);
    let mut names: Vec<String> = given.map(|name| name.0.clone()).collect();
    if names.len() > targets {
        let boxes = if targets == 1 { "box" } else { "boxes" };
        let detail = format!("`names` has {} names, for {targets} {boxes}.", names.len());
        return Err(Problem::malformed(detail));
    }
    names.extend((names.len()..targets).map(|target| format!("Object {}", target + 1)));
    Ok(names)
}
