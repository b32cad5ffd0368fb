//! The state of a tracker as bytes.
//!
//! A snapshot comes back from a client, so it is hostile until proven otherwise. The checksum finds damage, not
//! malice: whoever can change the bytes can change the checksum. So after decoding everything is checked that the
//! tracker relies on, and a state that passes can be stepped without a panic, a NaN, or more memory than parameters
//! allow.
//!
//! Layout: the magic `BAGTRACK`, the version and the CRC-32 of the rest (both little-endian 32-bit), the state in
//! postcard's encoding. With an expert the version is another one, and the second opinion follows.

use crate::error::TrackerError;
use crate::expert::opinion::Expert;
use crate::expert::second_opinion::SecondOpinion;
use crate::image::resolution::MAX_WORKING_SIDE;
use crate::input;
use crate::motion::orientation;
use crate::motion::particles::Particle;
use crate::params::table::Search;
use crate::state::State;
use crate::workspace;

/// The first bytes of every snapshot.
pub const MAGIC: &[u8; 8] = b"BAGTRACK";
/// Grows with every change of [`State`] or of what its numbers mean.
const VERSION: u32 = 17;
/// The version of a snapshot with a second opinion.
const EXPERT_VERSION: u32 = 0x1_0000 + VERSION;
const HEADER: usize = 16;
/// The memory that is reserved for a snapshot: most fit in, and are not moved while they grow.
const USUAL_BYTES: usize = 80 << 10;

const NO_EXPERT: &str = "the session has a second opinion by a network, which is not loaded here: give it with --model, in \
    Python as model";
const OTHER_EXPERT: &str = "the session has another second opinion than the one that is loaded here: give the same files \
    with --model, and --model-in-doubt if it was given there";

/// No feature has a greater magnitude; gray values are in [0, 1].
const MAX_FEATURE: f32 = 1e3;
/// Frame numbers are below this, so that they are exact in JSON, too.
const FRAMES: u64 = 1 << 53;

/// The snapshot of `state`.
pub(crate) fn write(state: &State) -> Vec<u8> {
    const PLAIN: &str = "the state has no type that postcard refuses";
    let mut bytes = Vec::with_capacity(USUAL_BYTES);
    bytes.resize(HEADER, 0);
    bytes = postcard::to_extend(state, bytes).expect(PLAIN);
    let mut version = VERSION;
    if let Some(opinion) = &state.second_opinion {
        version = EXPERT_VERSION;
        bytes = postcard::to_extend(opinion, bytes).expect(PLAIN);
    }
    let checksum = crc32fast::hash(&bytes[HEADER..]);
    bytes[..8].copy_from_slice(MAGIC);
    bytes[8..12].copy_from_slice(&version.to_le_bytes());
    bytes[12..HEADER].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// The state in `bytes`, fully checked. A second opinion in it must be that of `expert`. What the state shares with
/// `known`, which may be any state, is not computed again.
pub(crate) fn read(
    bytes: &[u8],
    expert: Option<&dyn Expert>,
    known: Option<&State>,
) -> Result<State, TrackerError> {
    let damaged = TrackerError::Snapshot("is damaged");
    let Some((header, body)) = bytes.split_first_chunk::<HEADER>() else {
        return Err(TrackerError::Snapshot("is too short"));
    };
    let word = |at: usize| {
        u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]])
    };
    if header[..8] != MAGIC[..] {
        return Err(TrackerError::Snapshot("is not one of this program"));
    }
    let has_opinion = word(8) == EXPERT_VERSION;
    if word(8) != VERSION && !has_opinion {
        return Err(TrackerError::Snapshot("is of another version"));
    }
    if word(12) != crc32fast::hash(body) {
        return Err(damaged);
    }
    let Ok((mut state, rest)) = postcard::take_from_bytes::<State>(body) else {
        return Err(damaged);
    };
    if has_opinion {
        state.second_opinion = Some(read_opinion(rest, state.format.size, expert)?);
    } else if !rest.is_empty() {
        return Err(damaged);
    }
    check(&state)?;
    restore(&mut state, known);
    Ok(state)
}

/// The second opinion of a session with working images of `size`.
fn read_opinion(
    bytes: &[u8],
    size: (u32, u32),
    expert: Option<&dyn Expert>,
) -> Result<SecondOpinion, TrackerError> {
    let Ok((opinion, [])) = postcard::take_from_bytes::<SecondOpinion>(bytes) else {
        return Err(TrackerError::Snapshot("is damaged"));
    };
    let expert = expert.ok_or(TrackerError::Expert(NO_EXPERT))?;
    if expert.fingerprint() != opinion.fingerprint {
        return Err(TrackerError::Expert(OTHER_EXPERT));
    }
    if opinion.is_valid_for(expert.template_len(), size) {
        Ok(opinion)
    } else {
        Err(TrackerError::Snapshot("holds a state that cannot be"))
    }
}

/// Computes what a snapshot does not carry.
fn restore(state: &mut State, known: Option<&State>) {
    let params = &state.params;
    let known = known.filter(|known| known.params == *params);
    workspace::with(|workspace| {
        let scratch = &mut workspace.scratch.learning.appearance;
        let known = known.map(|known| &known.appearance);
        state.appearance.model_mut().restore(known, params, scratch);
    });
}

fn check(state: &State) -> Result<(), TrackerError> {
    state.params.validate()?;
    let is_valid = check_numbers(state)
        && check_particles(state)
        && state.appearance.is_valid_for(&state.params, MAX_FEATURE)
        && check_extensions(state);
    if is_valid {
        Ok(())
    } else {
        Err(TrackerError::Snapshot("holds a state that cannot be"))
    }
}

/// Sizes, bounds and the last answer.
fn check_numbers(state: &State) -> bool {
    let (width, height) = state.source;
    if width == 0 || height == 0 {
        return false;
    }
    let working = state.format.size;
    let fits = |side: u32, whole: u32| (1..=whole.min(MAX_WORKING_SIDE)).contains(&side);
    if !fits(working.0, width) || !fits(working.1, height) {
        return false;
    }
    let bounds = &state.bounds;
    let (horizontal, vertical) = input::to_working(state.source, working);
    let box_sides = [
        (bounds.box_width, horizontal),
        (bounds.box_height, vertical),
    ];
    // Scaling back and forth may have rounded.
    let could_be_given = |&(side, scale): &(f64, f64)| {
        side >= 0.99 && side / scale <= 1.01 * input::max_box_side(state.source)
    };
    let target = &state.estimate.target;
    let far = 1e2 * f64::from(width.max(height)) + 1e3;
    bounds.frame_width == f64::from(working.0)
        && bounds.frame_height == f64::from(working.1)
        && box_sides.iter().all(could_be_given)
        && target.is_valid()
        && [target.x, target.y, target.width, target.height]
            .iter()
            .all(|value| value.abs() <= far)
        && (0.0..=1.0).contains(&state.estimate.score)
        && state.estimate.frame < FRAMES
        && state
            .baseline
            .distance
            .is_none_or(|distance| (0.0..=1e6).contains(&distance))
}

fn check_particles(state: &State) -> bool {
    let has_cloud = state.params.search == Search::Resampled;
    let cloud = state.cloud.as_ref();
    cloud.is_some() == has_cloud
        && (state.second_opinion.is_none() || state.params.takes_expert())
        && is_clamped(&state.answer, state)
        && cloud.is_none_or(|cloud| {
            let mut particles = cloud.particles.iter();
            cloud.is_valid_for(&state.params) && particles.all(|it| is_clamped(it, state))
        })
}

/// Whether a particle is within its bounds: to two pixels, for a box that the user gave may lie a pixel beyond, and to
/// the rounding of the scale.
fn is_clamped(particle: &Particle, state: &State) -> bool {
    let held = state.bounds.clamp(*particle);
    (held.x - particle.x).abs() <= 2.0
        && (held.y - particle.y).abs() <= 2.0
        && (held.scale - particle.scale).abs() <= 1e-9
}

/// The models of the extensions: there when their parameters ask for them, and not otherwise.
fn check_extensions(state: &State) -> bool {
    let params = &state.params;
    let (width, height) = state.format.size;
    state.discriminant.is_valid_for(params, MAX_FEATURE)
        && state
            .color
            .is_valid_for(params.histogram_weight > 0.0, state.format.has_color)
        && state.scale_filter.is_valid_for(params, MAX_FEATURE)
        && state.global_motion.is_some() == params.global_motion
        && state
            .global_motion
            .as_ref()
            .is_none_or(|global_motion| global_motion.is_valid_for(width as usize, height as usize))
        && state
            .last_seen
            .is_valid_for((width, height), params.static_penalty > 0.0)
        && orientation::is_valid_for(state.orientation, params)
        && (0.0..=1e6).contains(&state.update_gate.mean_distance)
        && (0.0..=1e6).contains(&state.update_gate.last_distance)
}
