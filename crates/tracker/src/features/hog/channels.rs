//! The channels of a cell: a gradient histogram of nine directions, then chroma and the gray value.
//!
//! In the integral image and in cells the channels of one point lie side by side, padded with zeros to 16 lanes. They
//! fill a cache line: one or two vector instructions work on all of them, and a look-up touches one line.

use pulp::Simd;

use crate::params::table::CELL_VALUES;

/// Directions of a gradient, from 0 to 180 degrees.
pub(crate) const DIRECTIONS: usize = 9;
/// The channels of Cb and Cr, after the directions; 0 where there is no colour.
pub(crate) const CHROMA: [usize; 2] = [DIRECTIONS, DIRECTIONS + 1];
/// The channel of the gray values, the last one: the only one whose values depend on those of the whole area.
pub(crate) const GRAY: usize = DIRECTIONS + CHROMA.len();
/// The channels: the values of one cell in a feature vector.
pub(crate) const CHANNELS: usize = GRAY + 1;
const _: () = assert!(CHANNELS == CELL_VALUES);

/// The weight of the gray value beside the directions: a blurred target has few gradients.
pub(crate) const GRAY_WEIGHT: f32 = 0.3;

/// The chroma (of 128 levels either way) at which its channel has half of its greatest value: the hue of a pale target
/// counts, and a vivid one does not outweigh everything else.
pub(crate) const HALF_CHROMA: f32 = 20.0;

/// The number of channels with the zeros that pad them.
pub(crate) const LANES: usize = 16;

/// The channels of a point or a cell in a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Lanes(pub [f32; LANES]);

/// The channels in vector registers; the first [`registers`] of the array are used.
pub(crate) type Registers<S> = [<S as Simd>::f32s; LANES];

/// How many registers hold the channels.
#[inline(always)]
pub(crate) fn registers<S: Simd>() -> usize {
    CHANNELS.div_ceil(S::F32_LANES)
}

impl Lanes {
    /// 0 in every channel.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// `value` in channel `lane`, 0 in the others.
    pub const fn single(lane: usize, value: f32) -> Self {
        let mut lanes = Self::ZERO;
        lanes.0[lane] = value;
        lanes
    }

    /// `first` in the first direction, `value` in each other direction, 0 in the rest.
    pub const fn directions(first: f32, value: f32) -> Self {
        let mut lanes = Self::single(0, first);
        let mut lane = 1;
        while lane < DIRECTIONS {
            lanes.0[lane] = value;
            lane += 1;
        }
        lanes
    }

    /// The channels as registers.
    #[inline(always)]
    pub fn load<S: Simd>(&self) -> &[S::f32s] {
        S::as_simd_f32s(&self.0).0
    }

    /// The channels as registers to be written.
    #[inline(always)]
    pub fn load_mut<S: Simd>(&mut self) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(&mut self.0).0
    }
}
