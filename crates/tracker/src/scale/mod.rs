//! The target's scale, once its position is known: the scale filter of DSST (Danelljan et al. 2014). All of it is ours:
//! the paper's scale is that of the best particle.
//!
//! In: the feature vectors of a *scale pyramid*, 17 areas around one centre whose sizes differ by 3 % each (`pyramid`
//! says where they are and how they are described; the caller samples them), f32, one after the other.
//! Out: the logarithm of the target's scale against that of the pyramid's middle, with the height of the filter's
//! response there, 0 to 1 (`dsst`); `measure` says how much of it is applied.
//!
//! What can go wrong: a target that is covered, turned or missed gives a low response, which leaves the scale as it
//! is. A flat pyramid (all features zero) gives response 0. A filter in a snapshot is checked by
//! `ScaleFilter::is_valid_for`.

pub(crate) mod dsst;
pub(crate) mod measure;
pub(crate) mod pyramid;
