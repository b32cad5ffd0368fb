//! The table of parameters. Validation, the command line's help and the OpenAPI schema are made from it.
//!
//! The other fields of [`Params`] are the preset's own: its structure, and the weights of its extensions. An ablation
//! can switch each of them off (`bagtrack-eval --set search=resampled`), but they are no rows of the table: users of
//! the service choose between two measured trackers, not among thousands of mixtures.

use serde::{Deserialize, Serialize};

use crate::image::frame::FrameFormat;
use crate::image::rect::Rect;
use crate::image::resolution;

/// The difference of the seeds of two consecutive targets: 2⁶⁴ over the golden ratio.
const SEED_STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// Values of a cell with [`Features::Gradients`]: nine directions, two of chroma and the gray value.
pub(crate) const CELL_VALUES: usize = 12;

/// What a candidate area is turned into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// H₁ x H₂ gray values in \[0, 1\], as in the paper.
    Gray,
    /// For each of H₁ x H₂ cells a histogram of gradients in nine directions, the cell's chroma and its gray value.
    Gradients,
}

/// Where the particles of a frame are drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// From the last particles by their weights, as in the paper.
    Resampled,
    /// From the last answer. A likelihood that is nearly flat hardly selects among particles, so a resampled cloud
    /// spreads; a cloud drawn around the answer does not.
    Answer,
}

/// A row of the table of parameters, [`Params::TABLE`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Parameter {
    /// The field's name.
    pub name: &'static str,
    /// What it means, in the words of the field's documentation.
    pub description: &'static str,
    /// The Rust type of the field: `u32` and `f64` have a range, the seed is a `u64`.
    pub kind: &'static str,
    /// The least and the greatest value, both allowed; none for the seed.
    pub range: Option<(f64, f64)>,
}

/// A parameter out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameter {name} is {value}; it must be {expected}")]
pub struct ParamsError {
    /// The parameter's field name.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
    /// The range it must be in.
    pub expected: &'static str,
}

/// Makes [`Params`], its table and its check of ranges from two lists of `name: type [min to max]`: the rows of the
/// table, and what the presets own.
macro_rules! parameters {
    (@range) => { None };
    (@range $min:literal $max:literal) => { Some(($min as f64, $max as f64)) };
    (table { $($(#[doc = $doc:literal])* $name:ident: $kind:ident $([$min:literal to $max:literal])?;)* }
     preset { $($(#[doc = $own_doc:literal])* $own:ident: $own_kind:ident $([$own_min:literal to $own_max:literal])?;)* }) => {
        /// Every parameter of the tracker. Lengths are in pixels of the working image
        /// ([`frame_format`](Self::frame_format)).
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Params {
            $($(#[doc = $doc])* $(#[doc = concat!("\n\nRange: ", $min, " to ", $max, ".")])? pub $name: $kind,)*
            $($(#[doc = $own_doc])* $(#[doc = concat!("\n\nRange: ", $own_min, " to ", $own_max, ".")])?
                #[doc = "\n\nThe preset's own."] pub $own: $own_kind,)*
        }

        impl Params {
            /// The parameters that users set, with their meaning, type and range, in the order of the fields. The other
            /// fields are the presets' own.
            pub const TABLE: &'static [Parameter] = &[$(Parameter {
                name: stringify!($name),
                description: concat!($($doc),*),
                kind: stringify!($kind),
                range: parameters!(@range $($min $max)?),
            }),*];

            /// The value of the parameter `name` of the table. Whole numbers above 2⁵³ are rounded. None where there is
            /// no such parameter.
            pub fn value(&self, name: &str) -> Option<f64> {
                match name {
                    $(stringify!($name) => Some(self.$name as f64),)*
                    _ => None,
                }
            }

            /// Sets the parameter `name` of the table; [`validate`](Self::validate) checks its range. None where there
            /// is no such parameter, where `value` is NaN, or where the field is a whole number and `value` is not one
            /// that the field can hold.
            pub fn set(&mut self, name: &str, value: f64) -> Option<()> {
                match name {
                    $(stringify!($name) => {
                        let set = value as $kind;
                        // A value that the conversion changes is not of the field's type.
                        self.$name = (set as f64 == value).then_some(set)?;
                    })*
                    _ => return None,
                }
                Some(())
            }

            /// Checks every parameter against its range, and sizes against what they may cost together. NaN is out of
            /// every range.
            ///
            /// # Errors
            /// The first parameter that is out of its range.
            pub fn validate(&self) -> Result<(), ParamsError> {
                let ranges = [
                    $($((stringify!($name), f64::from(self.$name), $min as f64..=$max as f64,
                        concat!("from ", $min, " to ", $max)),)?)*
                    $($((stringify!($own), f64::from(self.$own), $own_min as f64..=$own_max as f64,
                        concat!("from ", $own_min, " to ", $own_max)),)?)*
                ];
                match ranges.into_iter().find(|(_, value, range, _)| !range.contains(value)) {
                    Some((name, value, _, expected)) => Err(ParamsError { name, value, expected }),
                    None => self.validate_products(),
                }
            }
        }
    };
}

parameters! {
    table {
        /// N, the number of particles (section III-A).
        particles: u32 [1 to 1000];
        /// H₁, the width to which a candidate area is resized (section III-B): in pixels, with `robust` in cells.
        patch_width: u32 [4 to 64];
        /// H₂, the height to which a candidate area is resized (section III-B): in pixels, with `robust` in cells.
        patch_height: u32 [4 to 64];
        /// n, the number of basis vectors of an affine subspace (equation 1). At most P + 1 of them exist.
        basis_dim: u32 [1 to 6];
        /// P, the number of previous tracked patches in a subspace (equation 2).
        history: u32 [1 to 10];
        /// K, the number of subspaces in the full bag (equation 3).
        bag_size: u32 [1 to 32];
        /// W, the number of frames from one update of the bag to the next (section III-C).
        update_every: u32 [1 to 1000];
        /// α, the weight of the distance of origins against that of bases (equation 4).
        alpha: f64 [0 to 1];
        /// σ, the distance at which a likelihood has fallen to 1/e (equation 11).
        sigma: f64 [0.0001 to 100];
        /// Standard deviation of the Brownian motion along x, in working pixels a frame (section III-A).
        motion_std_x: f64 [0 to 320];
        /// Standard deviation of the Brownian motion along y, in working pixels a frame (section III-A).
        motion_std_y: f64 [0 to 320];
        /// Standard deviation of the Brownian motion of the scale, a frame (section III-A). The scale of the first box
        /// is 1. With `robust` it is that of the scale's logarithm.
        motion_std_scale: f64 [0 to 1];
        /// The first box's √(width · height) in working pixels: the resolution follows the target. Off: 0, a working
        /// image of 320 pixels on its longer side.
        target_side: f64 [0 to 256];
        /// How many vectors of areas beside the target the Mahalanobis metric is made of: what the background has too
        /// counts less. With `robust`. Off: 0.
        background_samples: u32 [0 to 256];
        /// Standard deviation of the prior on the displacement in a frame, in working pixels: a look-alike far away
        /// loses. Up to twice as much for a place that looks more like the first box than the last answer does. With
        /// `robust`. Off: 0.
        displacement_std: f64 [0 to 1000];
        /// Seed of all random draws: the same seed and frames give the same boxes.
        seed: u64;
    }
    preset {
        /// What a candidate area is turned into. Gradients hardly change with the light.
        features: Features;
        /// Where particles are drawn from. The paper: `resampled`.
        search: Search;
        /// Whether a candidate's subspace is its own vector alone, brought to unit length. As one of P + 1 columns a
        /// candidate hardly counts beside the history that it shares with all others. Then n = 1 for the candidate, and
        /// its one principal angle is that between its vector and the entry's subspace. Off: false.
        single_vector_candidate: bool;
        /// Weight of the mean chroma of a cell beside its gradients. Used with gradients, in colour. Off: 0.
        chroma_weight: f64 [0 to 10];
        /// Weight of the colour histogram (of luma, without colour): the likelihood is multiplied by exp(weight · m),
        /// where m is the mean over the box of the probability that a pixel's colour is the target's, minus a half.
        /// Off: 0.
        histogram_weight: f64 [0 to 100];
        /// The sides of the area that is described, as a multiple of the box's. What surrounds a target tells where it
        /// ends. Off: 1.
        context: f64 [0.5 to 3];
        /// Learning rate of the correlation filter that measures the scale along a pyramid of areas. Off: 0.
        scale_learning_rate: f64 [0 to 1];
        /// Around how many local maxima of the discriminant's dense search particles are drawn. Used with gradients.
        /// Off: 0.
        dense_maxima: u32 [0 to 16];
        /// Log-likelihood penalty of a particle whose box, outside the last one, looks as it did when the target was
        /// last seen: the target has not come there. Off: 0.
        static_penalty: f64 [0 to 100];
        /// Whether the displacement of the whole image is measured, and half of the particles moved by it.
        /// Off: false.
        global_motion: bool;
        /// The weight of the first box's subspace in the sum rule (equation 9); this subspace never leaves the bag.
        /// Off: 0, which makes it an entry as any other.
        pinned_weight: f64 [0 to 100];
        /// By how many degrees, either way, the first box's image is rotated to augment its subspace. Off: 0.
        augmentation_angle: f64 [0 to 90];
        /// The models are updated only while the answer's distance to the first subspace is below this multiple of its
        /// running mean. Off: 0.
        update_distance_ratio: f64 [0 to 100];
        /// Weight of the discriminant, a linear classifier of the target against its surroundings: the likelihood is
        /// multiplied by exp(weight · score). Off: 0.
        discriminant_weight: f64 [0 to 100];
    }
}

impl Params {
    /// Whether a tracker with these parameters may have an expert: the tracker's score must be a probability, which
    /// takes the discriminant, and its search must begin at the last answer.
    pub fn takes_expert(&self) -> bool {
        self.discriminant_weight > 0.0 && self.search == Search::Answer
    }

    /// How a session sees frames of the size `source` (width and height in pixels, above 0). `target` is its first box,
    /// in pixels of these frames.
    pub fn frame_format(&self, source: (u32, u32), target: &Rect) -> FrameFormat {
        FrameFormat {
            size: resolution::working_size(source, target, self.target_side),
            has_color: self.features == Features::Gradients,
        }
    }

    /// The parameters of target number `target`, from 0, of several in the same frames. Each target has a seed of its
    /// own; target 0 has the seed of `self`.
    pub fn of_target(&self, target: usize) -> Self {
        let mut params = self.clone();
        params.seed = self
            .seed
            .wrapping_add(SEED_STEP.wrapping_mul(target as u64));
        params
    }

    /// D, the length of a feature vector.
    pub fn feature_len(&self) -> usize {
        let cells = self.patch_width as usize * self.patch_height as usize;
        cells * self.features.channels()
    }

    /// How many of the bag's entries are pinned.
    pub(crate) fn pinned_entries(&self) -> usize {
        usize::from(self.pinned_weight > 0.0 && self.bag_size > 1)
    }
}

impl Features {
    /// Values of a pixel or a cell.
    pub fn channels(self) -> usize {
        match self {
            Self::Gray => 1,
            Self::Gradients => CELL_VALUES,
        }
    }
}
