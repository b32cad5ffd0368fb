//! How long a step takes on this machine without WebAssembly, on the sample clip in 640 x 480: `tools/wasm_step.sh`
//! runs it beside the module. Frames are taken as the service takes them, decoded and in full size.

use bagtrack_sample::{Clip, Settings};
use bagtrack_tracker::{Frame, Preset, Tracker};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let settings = Settings {
        width: 640,
        height: 480,
        frames: 300,
        ..Settings::default()
    };
    let clip = Clip::new(settings)?;
    let frame = |index| {
        let picture = clip.draw(index);
        Frame::from_rgb(picture.width(), picture.height(), &picture)
    };
    let frames = (0..300).map(frame).collect::<Result<Vec<_>, _>>()?;
    let mut tracker = Tracker::new(&frames[0], clip.target(0), Preset::Robust.params())?;
    let mut millis: Vec<f64> = Vec::new();
    for frame in &frames[1..] {
        let started = Instant::now();
        tracker.step(frame)?;
        millis.push(started.elapsed().as_secs_f64() * 1e3);
    }
    millis.sort_by(f64::total_cmp);
    println!("{:.3}", millis[millis.len() / 2]);
    Ok(())
}
