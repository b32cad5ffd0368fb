//! A new session's first frame, with the boxes and parameters that come with it.

use super::advance;
use super::state::AppState;
use crate::http::extract::overrides::{self, ParamOverrides, PresetName};
use crate::http::extract::settings::WholeNumber;
use crate::http::problems::problem::Problem;
use crate::sessions::{
    Boxes, Fingerprint, PerTarget, SessionState, StartError, WorkMeter, frame_format,
};
use axum::body::Bytes;

/// What a session begins with, beside the frame.
#[derive(Debug)]
pub struct FirstFrame {
    /// The targets' boxes.
    pub boxes: Boxes,
    /// The set of parameters.
    pub preset: Option<PresetName>,
    /// The seed of all random draws.
    pub seed: Option<WholeNumber>,
    /// Parameters that are set otherwise than in the preset.
    pub params: Option<ParamOverrides>,
}

impl FirstFrame {
    /// The session that begins with this file.
    ///
    /// # Errors
    /// The frame, a box or a parameter cannot be used.
    pub fn begin(
        self,
        state: &AppState,
        file: &Bytes,
        meter: &mut WorkMeter,
    ) -> Result<SessionState, Problem> {
        let params = overrides::resolve(self.preset, self.seed, self.params)?;
        let boxes = &self.boxes;
        let format = |source| frame_format(&params, source, boxes);
        let (limits, metrics) = (state.config.frame_limits(), &state.metrics.tracking);
        let files = std::slice::from_ref(file);
        let frame = &advance::decode(files, &limits, &format, meter, metrics)?[0];
        let print = Fingerprint::of(file);
        let started = SessionState::start(frame, print, boxes, &params, || meter.check());
        started.map_err(|error| match (&error, boxes) {
            (StartError::Refused { target, .. }, PerTarget::List(list)) => {
                let target = *target;
                Problem::from(error).of_target(target, list.len())
            }
            _ => error.into(),
        })
    }
}
