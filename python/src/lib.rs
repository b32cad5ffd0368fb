//! The tracker as a Python class: `bagtrack.Tracker`.
//!
//! In: NumPy arrays and boxes of four numbers. Out: boxes as tuples. Whatever the tracker refuses is a `ValueError`
//! with the tracker's words, and changes nothing.

mod frame;
mod key_frames;
mod model;
mod params;
mod target;
mod tracker;

/// The module `bagtrack._native`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::key_frames::PyKeyFrames;
    #[pymodule_export]
    use super::model::PyNanoTrack;
    #[pymodule_export]
    use super::tracker::PyTracker;

    /// The version of the package.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "that is what Python calls it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
