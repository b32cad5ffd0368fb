//! The loop of `bagtrack track`: frame by frame, from the first to the last or to a signal.

use super::drawn::{Destination, Drawn};
use super::frames::{FrameFile, Frames};
use super::interrupt::Interrupt;
use super::rows::Rows;
use super::targets::Targets;
use bagtrack_formats::{Clip, Row};
use bagtrack_sessions::Selection;
use bagtrack_tracker::{Expert, Params, Rect, box_warnings};
use indicatif::ProgressBar;
use std::error::Error;
use std::io::{self, ErrorKind};
use std::sync::Arc;

/// The parts of one run of `track`.
pub struct Job {
    pub frames: Frames,
    /// The targets in the first frame that is wanted.
    pub boxes: Vec<Rect>,
    pub params: Params,
    /// The network for a second opinion, where one is wanted.
    pub expert: Option<Arc<dyn Expert>>,
    /// Where drawn frames go, if they are wanted.
    pub destination: Option<Destination>,
    /// Most frames that are tracked after the first one.
    pub count: Option<u64>,
    /// Which boxes are written.
    pub selection: Selection<Row>,
    pub rows: Rows,
    /// The name of the video or folder.
    pub name: String,
    /// The names of the targets.
    pub names: Vec<String>,
    /// The progress bar, which takes a step for each frame.
    pub bar: ProgressBar,
}

/// Whether to go on.
enum Then {
    GoOn,
    Stop,
}

impl Job {
    /// Follows the targets to the last frame that is wanted, or to a signal, and closes what is drawn. Returns how many
    /// frames were tracked.
    pub fn run(mut self, interrupt: &Interrupt) -> Result<u64, Box<dyn Error>> {
        let (mut targets, mut drawn) = (None, None);
        let followed = self.follow(interrupt, &mut targets, &mut drawn);
        // Written even after an error: the frames before it are worth keeping.
        write(&mut self.rows, self.selection.finish())?;
        if let Some(targets) = targets {
            self.finish(&targets)?;
        }
        let finished = drawn.map_or(Ok(()), Drawn::finish);
        // If the encoder has ended, its error is the cause of the one in the loop, so it is returned first.
        finished?;
        followed
    }

    /// Writes the formats that need all rows.
    fn finish(&mut self, targets: &Targets) -> io::Result<()> {
        let length = self.rows.length();
        let clip = Clip {
            name: self.name.clone(),
            size: targets.frame_size(),
            rate: self.frames.rate().value(),
            names: self.names.clone(),
            goes_on: self.frames.go_on_after(length),
        };
        or_stop(self.rows.finish(&clip)).map(|_| ())
    }

    fn follow(
        &mut self,
        interrupt: &Interrupt,
        targets: &mut Option<Targets>,
        drawn: &mut Option<Drawn>,
    ) -> Result<u64, Box<dyn Error>> {
        let mut count = 0;
        while !interrupt.came() && self.count.is_none_or(|most| count <= most) {
            if self.frames.are_before_first() {
                self.frames.pass_over()?;
                self.bar.inc(1);
                continue;
            }
            let Some(frame) = self.frames.next()? else {
                break;
            };
            if let Then::Stop = self.take(&frame, targets, drawn)? {
                break;
            }
            count += 1;
            self.bar.inc(1);
        }
        Ok(count)
    }

    /// Tracks through a frame, draws and writes the boxes.
    fn take(
        &mut self,
        frame: &FrameFile,
        targets: &mut Option<Targets>,
        drawn: &mut Option<Drawn>,
    ) -> Result<Then, Box<dyn Error>> {
        let named = |error: Box<dyn Error>| format!("{}: {error}", frame.shown);
        let targets = match targets {
            Some(targets) => {
                targets.step(&frame.bytes).map_err(named)?;
                targets
            }
            None => {
                let started = Targets::start(
                    &frame.bytes,
                    &self.boxes,
                    &self.params,
                    self.expert.as_ref(),
                );
                let started = started.map_err(named)?;
                let warnings = box_warnings(&self.boxes, started.frame_size());
                for warning in warnings.into_iter().flatten() {
                    self.bar.suspend(|| eprintln!("bagtrack: {warning}"));
                }
                if let Some(destination) = &self.destination {
                    *drawn = Some(destination.open(self.frames.rate(), frame)?);
                }
                targets.insert(started)
            }
        };
        let estimates = targets.estimates();
        if let Some(drawn) = drawn {
            drawn.add(frame, &estimates)?;
        }
        let answers = estimates.into_iter().enumerate();
        let rows = self.selection.take(answers.map(|(target, estimate)| {
            let row = Row {
                frame: frame.index,
                time: frame.time,
                file: frame.file.clone(),
                target,
                estimate,
            };
            (estimate, row)
        }));
        match write(&mut self.rows, rows)? {
            Then::GoOn if self.selection.has_ended() => Ok(Then::Stop),
            then => Ok(then),
        }
    }
}

/// Writes rows. Stops without an error where the reader has closed the pipe, as in `bagtrack track … | head`.
fn write(to: &mut Rows, rows: Vec<Row>) -> io::Result<Then> {
    if rows.is_empty() {
        return Ok(Then::GoOn);
    }
    or_stop(to.write(rows))
}

/// Turns a closed pipe into `Then::Stop`: a reader that has seen enough is no error.
fn or_stop(written: io::Result<()>) -> io::Result<Then> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(Then::Stop),
        written => written.map(|()| Then::GoOn),
    }
}
