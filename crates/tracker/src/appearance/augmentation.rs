//! Augmentation of the first box's image: copies rotated by some degrees either way.
//!
//! A subspace of one vector is a point. With two rotated copies the first subspace spans what the target looks like
//! when it tilts, from the first frame on. The whole frame is rotated, so a copy shows the surroundings at its rim.

use crate::params::table::Params;

/// Rotated copies at most.
pub(crate) const MAX_VIEWS: usize = 2;

/// The angles of the copies, in radians; none where augmentation is off.
pub(crate) fn angles(params: &Params) -> impl Iterator<Item = f64> + use<> {
    let angle = params.augmentation_angle.to_radians();
    [angle, -angle].into_iter().filter(|angle| *angle != 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::presets::Preset;

    #[test]
    fn there_are_two_angles_or_none() {
        assert_eq!(angles(&Preset::Paper.params()).count(), 0);
        let found: Vec<f64> = angles(&Preset::Robust.params()).collect();
        assert_eq!(found.len(), MAX_VIEWS);
        assert_eq!(found[0], -found[1]);
    }
}
