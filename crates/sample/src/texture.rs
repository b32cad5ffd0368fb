//! The surfaces of the clip, as functions of a point: they can be sampled anywhere, so motion by a fraction of
//! a pixel is exact.

use super::smoothstep::smoothstep;

/// Red, green and blue, 0 to 1.
pub(super) type Color = [f64; 3];

/// The card that is followed, at (u, v) in [0, 1] x [0, 1] from its top-left corner.
pub(super) fn card(u: f64, v: f64, seed: u64) -> Color {
    let grain = 0.12 * (noise(u * 14.0, v * 17.0, seed) - 0.5);
    let mut color = mix([0.96, 0.72, 0.26], [0.86, 0.33, 0.20], v + grain);
    // A sun of rings, stripes under it, two dark dots: edges in all directions, at more than one scale.
    let from_sun = ((u - 0.5) / 0.8).hypot((v - 0.36) * 1.1);
    let ring = smoothstep(0.5 + 6.0 * (from_sun * 25.0).cos() / 6.0);
    if from_sun < 0.38 {
        color = mix([0.99, 0.93, 0.70], [0.62, 0.14, 0.16], ring);
    }
    for dot_x in [0.2, 0.8] {
        let from_dot = ((u - dot_x) / 0.8).hypot(v - 0.72);
        color = mix(
            color,
            [0.16, 0.13, 0.22],
            smoothstep((0.085 - from_dot) / 0.02),
        );
    }
    if v > 0.82 {
        let stripe = smoothstep(0.5 + 2.0 * ((u * 2.0 + v) * 22.0).sin());
        color = mix(color, [0.20, 0.22, 0.42], stripe);
    }
    let to_edge = u.min(1.0 - u).min(v).min(1.0 - v);
    mix(
        [0.98, 0.95, 0.88],
        color,
        smoothstep((to_edge - 0.03) / 0.02),
    )
}

/// The wall behind, at a point in units of the frame's shorter side.
pub(super) fn wall(x: f64, y: f64, seed: u64) -> Color {
    let broad = layers(x * 3.0, y * 3.0, seed ^ 1, 4);
    let fine = layers(x * 16.0, y * 16.0, seed ^ 2, 3);
    let color = mix(
        [0.20, 0.34, 0.40],
        [0.56, 0.62, 0.52],
        broad * 0.75 + fine * 0.35,
    );
    // Distractors: patches with rings like the card's, in colder colours, one at most in each cell of a grid.
    let (column, row) = ((x / 0.42).floor(), (y / 0.42).floor());
    let chance = |salt: u64| hash(column as i64, row as i64, seed ^ salt);
    let (u, v) = (x / 0.42 - column, y / 0.42 - row);
    let (from_x, from_y) = (0.35 + 0.3 * chance(11), 0.35 + 0.3 * chance(12));
    let away = (u - from_x).hypot(v - from_y);
    let radius = 0.12 + 0.14 * chance(13);
    if chance(14) < 0.35 {
        return color;
    }
    let ring = smoothstep(0.5 + (away * (45.0 + 25.0 * chance(15))).cos());
    let patch = mix([0.78, 0.80, 0.70], [0.24, 0.30, 0.44], ring);
    mix(color, patch, 0.8 * smoothstep((radius - away) / 0.03))
}

/// The board that covers the card, at a point in units of the frame's shorter side from its own corner.
pub(super) fn board(x: f64, y: f64, seed: u64) -> Color {
    let warp = layers(x * 2.0, y * 6.0, seed ^ 3, 2);
    let grain = 0.5 + 0.5 * ((x * 9.0 + warp * 2.2) * 8.0).sin();
    let speckle = noise(x * 60.0, y * 9.0, seed ^ 4);
    mix(
        [0.33, 0.24, 0.18],
        [0.55, 0.42, 0.30],
        0.7 * grain + 0.3 * speckle,
    )
}

pub(super) fn mix(from: Color, to: Color, share: f64) -> Color {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|channel| from[channel] + (to[channel] - from[channel]) * share)
}

/// Value noise summed over octaves, 0 to 1.
fn layers(x: f64, y: f64, seed: u64, octaves: u32) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for octave in 0..octaves {
        let (scale, weight) = (f64::from(1 << octave), 0.5f64.powi(octave as i32));
        sum += weight * noise(x * scale, y * scale, seed.wrapping_add(u64::from(octave)));
        weights += weight;
    }
    sum / weights
}

/// Value noise: random values on the whole-numbered grid, smoothly interpolated; 0 to 1.
fn noise(x: f64, y: f64, seed: u64) -> f64 {
    let (column, row) = (x.floor(), y.floor());
    let (across, down) = (smoothstep(x - column), smoothstep(y - row));
    let at = |right: i64, below: i64| hash(column as i64 + right, row as i64 + below, seed);
    let upper = at(0, 0) + (at(1, 0) - at(0, 0)) * across;
    let lower = at(0, 1) + (at(1, 1) - at(0, 1)) * across;
    upper + (lower - upper) * down
}

/// A number in [0, 1) for a grid point (the finaliser of SplitMix64).
fn hash(x: i64, y: i64, seed: u64) -> f64 {
    let mut bits = seed
        .wrapping_add((x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
        .wrapping_add((y as u64).wrapping_mul(0xD1B5_4A32_D192_ED03));
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (bits ^ (bits >> 31)) as f64 / 2f64.powi(64)
}
