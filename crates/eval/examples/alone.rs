//! NanoTrack without the particle filter, on annotated sequences in the layout of OTB.
//!
//!     cargo run --release -p bagtrack-eval --example alone -- BACKBONE HEAD full|working DIR...
//!
//! With `working` NanoTrack gets the frames in a session's working size, with `full` as they are in the files. Prints
//! for each sequence the mean overlap, the share of frames within 20 pixels, the milliseconds of a look, and with the
//! variable BOXES set every box.

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use bagtrack_cli::{frames, read_boxes};
use bagtrack_ingest::{Limits, decode_to};
use bagtrack_siamese::NanoTrack;
use bagtrack_tracker::{Expert, FrameFormat, Preset, Rect};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [backbone, head, size, dirs @ ..] = &args[..] else {
        return Err("usage: alone BACKBONE HEAD full|working DIR...".into());
    };
    let network = NanoTrack::from_onnx(&std::fs::read(backbone)?, &std::fs::read(head)?)?;
    let mut sums = [0.0; 3];
    for dir in dirs {
        let figures = follow(&network, Path::new(dir), size == "full")?;
        println!(
            "{dir} {:.3} {:.3} {:.2}",
            figures[0], figures[1], figures[2]
        );
        for (sum, figure) in sums.iter_mut().zip(figures) {
            *sum += figure / dirs.len() as f64;
        }
    }
    println!("mean {:.3} {:.3} {:.2}", sums[0], sums[1], sums[2]);
    Ok(())
}

/// Mean overlap, precision at 20 pixels, and milliseconds of a look.
fn follow(network: &NanoTrack, dir: &Path, full: bool) -> Result<[f64; 3], Box<dyn Error>> {
    let boxes = read_boxes(dir)?;
    let first = boxes[0].ok_or("the first frame has no box")?;
    let format = |source: (u32, u32)| match full {
        true => FrameFormat {
            size: source,
            has_color: true,
        },
        false => Preset::Robust.params().frame_format(source, &first),
    };
    let (mut place, mut template) = (first, Vec::new());
    let (mut overlap, mut near, mut scored) = (0.0, 0.0, 0.0);
    let mut time = Duration::ZERO;
    let paths = frames::list(dir)?;
    for (index, (path, annotated)) in paths.iter().zip(&boxes).enumerate() {
        let frame = decode_to(&std::fs::read(path)?, &Limits::default(), &format)?;
        let source = frame.source_size();
        let horizontal = f64::from(frame.width()) / f64::from(source.0);
        let vertical = f64::from(frame.height()) / f64::from(source.1);
        if index == 0 {
            place = first.scaled(horizontal, vertical);
            template = network.start(&frame, &place);
            continue;
        }
        let start = Instant::now();
        let sighting = network.look(&frame, &template, &place);
        time += start.elapsed();
        let (x, y) = sighting.target.center();
        let center = (
            x.clamp(0.0, f64::from(frame.width())),
            y.clamp(0.0, f64::from(frame.height())),
        );
        place = Rect::centered(
            center.0,
            center.1,
            sighting.target.width,
            sighting.target.height,
        );
        let found = place.scaled(1.0 / horizontal, 1.0 / vertical);
        if std::env::var_os("BOXES").is_some() {
            let Rect { x, y, .. } = found;
            println!(
                "{index} {x:.2} {y:.2} {:.2} {:.2} {:.3}",
                found.width, found.height, sighting.score
            );
        }
        if let Some(annotated) = annotated {
            scored += 1.0;
            overlap += found.overlap(annotated);
            near += f64::from(u8::from(found.center_distance(annotated) <= 20.0));
        }
    }
    let ms = time.as_secs_f64() * 1000.0 / (paths.len() - 1) as f64;
    Ok([overlap / scored, near / scored, ms])
}
