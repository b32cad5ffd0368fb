//! Frames for the tracker's tests, drawn by a formula: a textured square that moves over a texture.

use bagtrack_tracker::{Features, Frame, Params, Preset, Rect, Search};

fn texture(x: usize, y: usize, seed: u32) -> u8 {
    let cell =
        ((x / 3) as u32).wrapping_mul(73_856_093) ^ ((y / 3) as u32).wrapping_mul(19_349_663);
    ((cell ^ seed).wrapping_mul(2_654_435_761) >> 24) as u8
}

/// A position that moves to and fro between 0 and `top`, by one a frame.
fn bounce(t: usize, top: usize) -> f64 {
    let phase = t % (2 * top);
    phase.min(2 * top - phase) as f64
}

/// The target's box in frame `t`, which moves by one pixel a frame along both axes.
pub fn target(t: usize) -> Rect {
    Rect::new(20.0 + bounce(t, 60), 18.0 + bounce(t, 40), 24.0, 20.0)
}

/// Frame `t`, 120 x 90 pixels: the target is bright texture on dark.
pub fn frame(t: usize) -> Frame {
    let (width, height) = (120, 90);
    let area = target(t);
    let (left, top) = (area.x as usize, area.y as usize);
    let luma = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let inside = (left..left + 24).contains(&x) && (top..top + 20).contains(&y);
            if inside {
                128 + texture(x - left, y - top, 5) / 2
            } else {
                texture(x, y, 9) / 4
            }
        })
        .collect();
    Frame::from_luma(width as u32, height as u32, luma).expect("a frame of this size")
}

/// Waves of several lengths without a visible period: a background that shows the motion of the camera.
fn hills(x: f64, y: f64) -> f64 {
    let waves = (x * 0.13).sin() + (x * 0.041).cos() + (y * 0.11).sin() + (y * 0.053).cos();
    60.0 + 14.0 * waves
}

/// Frame `t`, 200 x 160 pixels, and the target's box in it, of the same target over hills, seen by a camera that is
/// turned by `camera` pixels: the whole picture moves.
pub fn panned(t: usize, camera: (usize, usize)) -> (Frame, Rect) {
    let walk = target(t);
    let (left, top) = (walk.x as usize + camera.0, walk.y as usize + camera.1);
    let luma = (0..200 * 160_usize)
        .map(|i| {
            let (x, y) = (i % 200, i / 200);
            if (left..left + 24).contains(&x) && (top..top + 20).contains(&y) {
                128 + texture(x - left, y - top, 5) / 2
            } else {
                let (x, y) = (x as f64 - camera.0 as f64, y as f64 - camera.1 as f64);
                let grain = texture((x + 90.0) as usize, (y + 90.0) as usize, 9) / 8;
                hills(x, y) as u8 + grain
            }
        })
        .collect();
    let frame = Frame::from_luma(200, 160, luma).expect("a frame of this size");
    (frame, Rect::new(left as f64, top as f64, 24.0, 20.0))
}

/// Frame `t`, 320 x 240 pixels, and the target's box in it, of this width and height: the same target seen from near.
pub fn near(t: usize, (width, height): (usize, usize)) -> (Frame, Rect) {
    let (left, top) = (40 + bounce(t, 60) as usize, 20 + bounce(t, 40) as usize);
    let luma = (0..320 * 240_usize)
        .map(|i| {
            let (x, y) = (i % 320, i / 320);
            if (left..left + width).contains(&x) && (top..top + height).contains(&y) {
                let (x, y) = ((x - left) * 24 / width, (y - top) * 20 / height);
                128 + texture(x, y, 5) / 2
            } else {
                hills(x as f64, y as f64) as u8
            }
        })
        .collect();
    let frame = Frame::from_luma(320, 240, luma).expect("a frame of this size");
    let target = Rect::new(left as f64, top as f64, width as f64, height as f64);
    (frame, target)
}

/// Frame `t`, 200 x 160 pixels, and the target's box in it: over hills that stay it leaps to and fro, every fifth
/// frame.
pub fn leaping(t: usize) -> (Frame, Rect) {
    let (hills, _) = panned(0, (0, 0));
    let [(left, top), (next_left, next_top)] = [(88, 68), (122, 46)];
    let (left, top) = if (t / 5).is_multiple_of(2) {
        (left, top)
    } else {
        (next_left, next_top)
    };
    let mut luma = hills.pixels().to_vec();
    // Hills where that picture has its target.
    for y in 18..38 {
        let (row, below) = (y * 200, (y + 20) * 200);
        luma.copy_within(below + 20..below + 44, row + 20);
    }
    for y in 0..20 {
        for x in 0..24 {
            luma[(top + y) * 200 + left + x] = 70 + texture(x, y, 5) / 4;
        }
    }
    let frame = Frame::from_luma(200, 160, luma).expect("a frame of this size");
    (frame, Rect::new(left as f64, top as f64, 24.0, 20.0))
}

/// Frame `t`, 200 x 160 pixels, with two unlike targets and their boxes: the first moves as ever, the second stands
/// below it and swings a little.
pub fn pair(t: usize) -> (Frame, Rect, Rect) {
    let (frame, first) = panned(t, (0, 0));
    let second = Rect::new(30.0 + bounce(t, 50), 105.0 + bounce(t, 25), 26.0, 26.0);
    let (left, top) = (second.x as usize, second.y as usize);
    let mut luma = frame.pixels().to_vec();
    for y in 0..26 {
        for x in 0..26 {
            luma[(top + y) * 200 + left + x] = 20 + texture(x, y, 77) / 3;
        }
    }
    let frame = Frame::from_luma(200, 160, luma).expect("a frame of this size");
    (frame, first, second)
}

/// Frame `t`, 200 x 160 pixels, and the target's box in it: the target goes away, by 0.6 % a frame, while what is
/// behind it comes nearer by as much, as a car does before a bridge.
pub fn receding(t: usize) -> (Frame, Rect) {
    let scale = (-0.006 * t as f64).exp();
    let (middle_x, middle_y) = (100.0, 80.0);
    let blend = |x: f64, y: f64, seed: u32| {
        let (column, row) = (x.floor(), y.floor());
        let (right, down) = (x - column, y - row);
        let at = |i: f64, j: f64| {
            f64::from(texture(
                (column + i + 500.0) as usize,
                (row + j + 500.0) as usize,
                seed,
            ))
        };
        (1.0 - down) * ((1.0 - right) * at(0.0, 0.0) + right * at(1.0, 0.0))
            + down * ((1.0 - right) * at(0.0, 1.0) + right * at(1.0, 1.0))
    };
    let luma = (0..200 * 160_usize)
        .map(|i| {
            let (x, y) = (
                (i % 200) as f64 + 0.5 - middle_x,
                (i / 200) as f64 + 0.5 - middle_y,
            );
            let (target_x, target_y) = (x / scale, y / scale);
            let gray = if target_x.abs() < 30.0 && target_y.abs() < 24.0 {
                60.0 + blend(target_x / 2.0, target_y / 2.0, 5) / 3.0
            } else {
                40.0 + blend(x * scale / 2.0, y * scale / 2.0, 9) / 3.0
            };
            gray as u8
        })
        .collect();
    let frame = Frame::from_luma(200, 160, luma).expect("a frame of this size");
    (
        frame,
        Rect::centered(middle_x, middle_y, 60.0 * scale, 48.0 * scale),
    )
}

/// Frame `t` and the target's box in it: a face under dark hair tilts to one side around the neck, by two degrees a
/// frame up to 50, stays there, and sways; behind it are hills. From afar 200 x 160 pixels, from near (`zoom` 3) 320
/// x 240 of that three times as large.
pub fn tilting(t: usize, zoom: usize) -> (Frame, Rect) {
    let ((width, height), (left, top)) = match zoom {
        1 => ((200, 160), (0.0, 0.0)),
        _ => ((320, 240), (36.0, 42.0)),
    };
    let larger = zoom as f64;
    let angle = (2.0 * (t as f64 - 10.0)).clamp(0.0, 50.0).to_radians();
    let (sin, cos) = angle.sin_cos();
    let neck = (80.0 + bounce(t, 20), 110.0);
    let luma = (0..width * height)
        .map(|i| {
            let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let (x, y) = (left + x / larger, top + y / larger);
            let (across, up) = (x - neck.0, neck.1 - y);
            let (across, up) = (cos * across - sin * up, cos * up + sin * across);
            let within = |x: f64, y: f64, wide: f64, high: f64| {
                ((across - x) / wide).powi(2) + ((up - y) / high).powi(2) < 1.0
            };
            let eyes = within(-6.0, 36.0, 3.0, 2.0) || within(6.0, 36.0, 3.0, 2.0);
            if eyes || within(0.0, 20.0, 6.0, 2.0) {
                50
            } else if within(0.0, 28.0, 14.0, 18.0) {
                200
            } else if within(0.0, 39.0, 20.0, 20.0) {
                30
            } else {
                hills(x, y) as u8 + 30
            }
        })
        .collect();
    let frame = Frame::from_luma(width as u32, height as u32, luma);
    let (x, y) = (neck.0 + 28.0 * sin - left, neck.1 - 28.0 * cos - top);
    let target = Rect::centered(larger * x, larger * y, larger * 28.0, larger * 36.0);
    (frame.expect("a frame of this size"), target)
}

pub fn flat(width: u32, height: u32, value: u8) -> Frame {
    let pixels = vec![value; width as usize * height as usize];
    Frame::from_luma(width, height, pixels).expect("a frame of this size")
}

/// The paper's parameters with another seed.
pub fn params(seed: u64) -> Params {
    Params {
        seed,
        ..Preset::Paper.params()
    }
}

/// The default parameters with another seed.
pub fn robust(seed: u64) -> Params {
    Params {
        seed,
        ..Preset::Robust.params()
    }
}

type Change = fn(&mut Params);

/// Each extension of the preset `robust`, switched off.
const EXTENSIONS_OFF: [(&str, Change); 13] = [
    ("no background", |p| p.background_samples = 0),
    ("no discriminant", |p| p.discriminant_weight = 0.0),
    ("resampled", |p| p.search = Search::Resampled),
    ("gray", |p| p.features = Features::Gray),
    ("printed candidates", |p| p.single_vector_candidate = false),
    ("no global motion", |p| p.global_motion = false),
    ("no scale filter", |p| p.scale_learning_rate = 0.0),
    ("no dense search", |p| p.dense_maxima = 0),
    ("no augmentation", |p| p.augmentation_angle = 0.0),
    ("no change test", |p| p.static_penalty = 0.0),
    ("nothing pinned", |p| p.pinned_weight = 0.0),
    ("updates at any distance", |p| p.update_distance_ratio = 0.0),
    ("no prior", |p| p.displacement_std = 0.0),
];

/// Both presets, and `robust` with each extension switched off alone; the latter with few particles and samples, to
/// be quick.
pub fn variants(seed: u64) -> Vec<(&'static str, Params)> {
    let mut variants = vec![("paper", params(seed)), ("robust", robust(seed))];
    for (name, change) in EXTENSIONS_OFF {
        let mut params = Params {
            particles: 43,
            background_samples: 13,
            ..robust(seed)
        };
        change(&mut params);
        variants.push((name, params));
    }
    variants
}
