//! What can happen to the target in a clip.

/// What happens to the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scene {
    /// The target moves in smooth turns, comes nearer, passes through a dim spell, and is half covered for a while. It
    /// is always in sight.
    #[default]
    Default,
    /// The target passes behind a broad post that stands from the top of the frame to the bottom: for 20 frames in the
    /// middle of the clip nothing of it is seen, and it comes out on the other side. The post does not move, so nothing
    /// tells where the target is behind it.
    Covered,
    /// The target leaves the frame at one side: for 25 frames in the middle of the clip nothing of it is seen, and it
    /// comes back at the same side, but higher or lower by about two of its heights.
    Leaves,
}

impl Scene {
    /// The least number of frames: the target must be in full sight before and after it is out of sight.
    pub fn min_frames(self) -> u32 {
        match self {
            Scene::Default => 1,
            Scene::Covered | Scene::Leaves => 90,
        }
    }
}
