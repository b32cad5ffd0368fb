//! The parameters, with their symbols in the paper.
//!
//! The first group is what the paper names. Each of the others is a mend of the printed tracker, with the value that
//! switches it off; the preset `paper` has all of them off. `ranges` checks the values, `presets` names two sets.

use serde::{Deserialize, Serialize};

use crate::tracker::params::presets::Preset;

/// Values of a cell with [`Features::Gradients`]: nine directions and the gray value.
pub(crate) const CELL_VALUES: usize = 10;

/// What a candidate area is turned into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// H₁ x H₂ gray values in [0, 1], as the paper has it.
    Gray,
    /// For each of H₁ x H₂ cells how strong the gradient is in nine directions, and the cell's gray value.
    Gradients,
}

/// Where the particles of a frame come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Search {
    /// From the last particles by their weights, as the paper has it.
    Resampled,
    /// From the last answer. A likelihood that is nearly flat hardly selects among particles, so a resampled cloud
    /// dissolves; one that starts from the answer does not.
    Answer,
}

/// Every parameter of the tracker. Lengths are in pixels of the working image
/// ([`WORKING_SIDE`](crate::tracker::image::frame::WORKING_SIDE)).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// N, the number of particles (section III-A), 1 to 1000.
    pub particles: u32,
    /// H₁, the width in pixels (with gradients: in cells) to which a candidate area is resized (section III-B), 4 to 64.
    pub patch_width: u32,
    /// H₂, the height in pixels (with gradients: in cells) to which a candidate area is resized (section III-B), 4 to 64.
    pub patch_height: u32,
    /// n, the number of basis vectors of an affine subspace (equation 1), 1 to 6. At most P + 1 of them exist.
    pub basis_dim: u32,
    /// P, the number of previous tracked patches in a subspace (equation 2), 1 to 10.
    pub history: u32,
    /// K, the number of subspaces in the full bag (equation 3), 1 to 32.
    pub bag_size: u32,
    /// W, the number of frames from one update of the bag to the next (section III-C), 1 to 1000.
    pub update_every: u32,
    /// α, the weight of the distance of origins against that of bases (equation 4), 0 to 1.
    pub alpha: f64,
    /// σ, the distance at which a likelihood has fallen to 1/e (equation 11), 0.0001 to 100.
    pub sigma: f64,
    /// Standard deviation of the Brownian motion along x, in pixels a frame (section III-A), 0 to 320.
    pub motion_std_x: f64,
    /// Standard deviation of the Brownian motion along y, in pixels a frame (section III-A), 0 to 320.
    pub motion_std_y: f64,
    /// Standard deviation of the Brownian motion of the scale, a frame (section III-A), 0 to 1. The scale of the
    /// first box is 1. Searching from the answer it is that of the scale's logarithm.
    pub motion_std_scale: f64,

    /// What is looked at. Gradients hardly change with the light.
    pub features: Features,
    /// The area that is looked at, as a multiple of the box on each side, 0.5 to 3. The rim of a target tells where it
    /// ends. Off: 1.
    pub context: f64,
    /// With gradients: the weight of a cell's gray value beside them, 0 to 3. A blurred target has few gradients.
    pub gray_weight: f64,
    /// Whether feature vectors are brought to length 1 before they are compared, which takes contrast out of the
    /// distance; γ is 1/4 then, since two unit vectors are at most 2 apart. Off: false.
    pub unit_length: bool,
    /// Whether a candidate's subspace is its own vector alone. As one of P + 1 columns a candidate drowns in the
    /// history that it shares with all others. Then n = 1 for the candidate, and its one principal angle is that
    /// between its vector and the entry's subspace. Off: false.
    pub single_vector_candidate: bool,

    /// How many vectors of areas beside the target the metric is made of, 0 to 256. Vectors are whitened by their
    /// covariance, so that what the background has too counts less. Off: 0.
    pub background_samples: u32,
    /// Frames from one refresh of the background to the next, 1 to 1000.
    pub background_every: u32,
    /// The ridge of the background's covariance, as a multiple of its mean eigenvalue, 0.001 to 1000.
    pub background_ridge: f64,

    /// Where particles come from. Off: `resampled`.
    pub search: Search,
    /// The share of the particles that are drawn narrowly around the best of the others, 0 to 0.9. Off: 0.
    pub refined_share: f64,
    /// Around how many of the best, 1 to 50.
    pub refined_modes: u32,
    /// Standard deviation of these draws along x and along y, in pixels, 0 to 320.
    pub refined_std: f64,
    /// Standard deviation of the logarithm of their scale, 0 to 1.
    pub refined_std_scale: f64,
    /// Standard deviation of the prior on how far the target moves in a frame, in pixels, 0 to 1000: a twin far away
    /// loses. Off: 0.
    pub displacement_std: f64,
    /// Standard deviation of the prior on how the logarithm of the scale changes in a frame, 0 to 10. Off: 0.
    pub scale_change_std: f64,
    /// Standard deviation of the prior on the logarithm of the scale against the first box, 0 to 10: without a reason a
    /// box stays as large as it was. Off: 0.
    pub scale_std: f64,
    /// The share of the newest frame in a filter that measures the scale along a pyramid of areas, 0 to 1: particles a
    /// few hundredths larger or smaller look nearly alike, and a box then grows or shrinks with what is behind the
    /// target. Off: 0.
    pub scale_learning_rate: f64,
    /// Around how many of the places where the discriminant sees most some of the first particles are drawn, 0 to 16: it
    /// looks at every place, a cell apart, for there are gaps between particles. With gradients only. Off: 0.
    pub dense_maxima: u32,
    /// How far around the last answer it looks at every place, as a multiple of the box's longer side, 0 to 4; at least
    /// as far as particles come, at most 24 cells.
    pub dense_radius: f64,
    /// First particles at places that are less likely than the best one, as seen there, by more than this are not looked at: the
    /// difference of logarithms, 0 to 1000. Off: 0.
    pub prune_margin: f64,
    /// How much less likely a particle is whose place looks as it did when the target was last seen elsewhere: the logarithm,
    /// where all of its box is beside the last one and nothing in it has changed, 0 to 100. What comes to a place changes
    /// it. Off: 0.
    pub static_penalty: f64,
    /// Whether a shift of the whole picture is looked for, and half of the particles moved by it: a camera that swings
    /// moves a target further than targets move. Off: false.
    pub global_motion: bool,
    /// The answer is the weighted mean of the particles within this distance of the most likely one, in pixels, 0 to
    /// 100. It is steadier than one particle. Off: 0, the arg max itself (equation 12).
    pub averaging_radius: f64,

    /// How many of the oldest subspaces never leave the bag, 0 to 16, fewer than K. What the user pointed at is the
    /// one look that is known to be right. Off: 0.
    pub pinned: u32,
    /// By how many degrees, either way, the look that the user pointed at is turned to make its subspace, 0 to 90: what a
    /// target that tilts a little looks like is known from the first frame on then. Off: 0.
    pub augmentation_angle: f64,
    /// By how many degrees, either way, a target is tried turned further in the picture, 0 to 30: one that tilts is
    /// followed as if the picture had turned around it. Where candidates stand alone. Off: 0.
    pub rotation_step: f64,
    /// The weight of a pinned subspace in the sum rule (equation 9), 0 to 100. Off: 1.
    pub pinned_weight: f64,
    /// The tracker learns from a frame only while the answer's distance to the first subspace is below this multiple
    /// of what is usual, 0 to 100. Off: 0.
    pub update_distance_ratio: f64,

    /// The tracker learns only from frames with this score or a greater one, 0 to 1, where there is a discriminant, but for the first
    /// twenty. Off: 0.
    pub update_min_score: f64,

    /// Weight of a linear score that is learned from all candidates of the past frames and tells the target from what
    /// is beside it; the likelihood is multiplied by exp(weight · score), 0 to 100. Off: 0.
    pub discriminant_weight: f64,
    /// How strongly that score keeps to what it was, against the mean squared error over the candidates of a frame,
    /// 0.001 to 1000.
    pub discriminant_damping: f64,
    /// Below this score of the discriminant, at the best particle, the target counts as out of sight, 0 to 1: the box
    /// stays, nothing is learned, and the search widens from frame to frame until the target is found again. Off: 0.
    pub lost_threshold: f64,

    /// Seed of all random draws: the same seed and frames give the same boxes.
    pub seed: u64,
}

impl Default for Params {
    fn default() -> Self {
        Preset::default().params()
    }
}

impl Params {
    /// D, the length of a feature vector.
    pub fn feature_len(&self) -> usize {
        let cells = self.patch_width as usize * self.patch_height as usize;
        match self.features {
            Features::Gray => cells,
            Features::Gradients => cells * CELL_VALUES,
        }
    }

    /// γ (equation 5): one over the greatest squared distance of two feature vectors.
    pub(crate) fn gamma(&self) -> f64 {
        if self.unit_length {
            0.25
        } else {
            1.0 / self.feature_len() as f64
        }
    }

    /// How many particles are kept from one frame to the next.
    pub(crate) fn stored_particles(&self) -> usize {
        match self.search {
            Search::Resampled => self.particles as usize,
            Search::Answer => 0,
        }
    }

    /// Whether the vectors that a subspace of the bag was made of are kept with it.
    pub(crate) fn keeps_templates(&self) -> bool {
        self.background_samples > 0 || self.single_vector_candidate
    }

    /// How many of the particles are drawn first; the others are drawn around the best of these.
    pub(crate) fn first_particles(&self) -> usize {
        let refined = (f64::from(self.particles) * self.refined_share) as usize;
        (self.particles as usize - refined).max(1)
    }
}
