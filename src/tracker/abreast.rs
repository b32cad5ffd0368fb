//! Sixteen candidates side by side: the same few operations are done for each of them, so each line of the code is one
//! or two vector instructions, and what one candidate would wait for (roots, divisions) is waited for together.

/// How many candidates are worked on together: a register of single-precision numbers where registers are longest.
pub(super) const ABREAST: usize = 16;

/// A number of each of [`ABREAST`] candidates.
pub(super) type Singles = [f32; ABREAST];

/// A number of each of [`ABREAST`] candidates, where single precision does not do.
pub(super) type Doubles = [f64; ABREAST];
