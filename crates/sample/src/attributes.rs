//! What makes a clip hard, by the names of the attributes of OTB and UAV123.

use super::error::SampleError;

/// How hard a clip is. By default a clip has none of these attributes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attributes {
    /// Factor on both sides of the card, 0.05 to 2.
    pub low_resolution: f64,
    /// Factor on the card's speed in the default scene, 0 to 20: 1 is about 4 pixels a frame at 320 x 240.
    pub fast_motion: f64,
    /// Share of the time between two frames for which the shutter is open, 0 to 1.
    pub motion_blur: f64,
    /// How far the camera shakes, in shorter sides of the frame, 0 to 0.25: each frame has another offset, chosen by
    /// the seed, up to so much in each direction.
    pub camera_motion: f64,
    /// Factor on both sides of the card that is reached in the last frame, 0.1 to 10.
    pub scale_variation: f64,
    /// Factor on the card's width that is reached half way through the clip, 0.1 to 1; in the last frame it is 1 again,
    /// as of a card that turns out of the plane and back.
    pub out_of_plane_rotation: f64,
    /// Degrees a frame by which the card turns, -90 to 90. The true box is the upright one around it.
    pub in_plane_rotation: f64,
    /// Cards that look like the target and move on paths of their own behind it, 0 to 8.
    pub similar_objects: u32,
}

impl Default for Attributes {
    fn default() -> Self {
        Self {
            low_resolution: 1.0,
            fast_motion: 1.0,
            motion_blur: 0.0,
            camera_motion: 0.0,
            scale_variation: 1.0,
            out_of_plane_rotation: 1.0,
            in_plane_rotation: 0.0,
            similar_objects: 0,
        }
    }
}

impl Attributes {
    /// Checks every attribute against its range.
    pub(super) fn check(&self) -> Result<(), SampleError> {
        let ranges = [
            ("low resolution", self.low_resolution, 0.05, 2.0),
            ("fast motion", self.fast_motion, 0.0, 20.0),
            ("motion blur", self.motion_blur, 0.0, 1.0),
            ("camera motion", self.camera_motion, 0.0, MAX_CAMERA_MOTION),
            ("scale variation", self.scale_variation, 0.1, 10.0),
            (
                "out-of-plane rotation",
                self.out_of_plane_rotation,
                0.1,
                1.0,
            ),
            ("in-plane rotation", self.in_plane_rotation, -90.0, 90.0),
            ("similar objects", self.similar_objects.into(), 0.0, 8.0),
        ];
        for (name, value, least, most) in ranges {
            if !(least..=most).contains(&value) {
                return Err(SampleError::Setting {
                    name,
                    value: value.to_string(),
                    expected: format!("{least} to {most}"),
                });
            }
        }
        Ok(())
    }
}

/// The greatest [`Attributes::camera_motion`].
pub(super) const MAX_CAMERA_MOTION: f64 = 0.25;
