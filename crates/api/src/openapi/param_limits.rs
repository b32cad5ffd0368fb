//! What the document says of the limits on products of sizes: the words of the errors with which they are refused.

use bagtrack_tracker::{Features, Params, Preset};

/// The description of the call that opens a session.
pub fn create_description() -> String {
    let limits: Vec<String> = too_much()
        .iter()
        .filter_map(|params| params.validate().err())
        .map(|error| format!("- `{}` must be {}.", error.name, error.expected))
        .collect();
    format!(
        "The first frame and the target's box start the tracker. A session snapshot in the place of the frame, with \
         nothing else, restores that session under a new id; it goes on exactly where it stood.\n\n\
         Every parameter has a range. Sizes that multiply have limits together, which bound the time and memory of a \
         session. The feature length is patch_width times patch_height, and {} times that with the preset `robust`.\n\n\
         {}\n\n\
         A parameter out of these answers `invalid-parameter`, with the limit in its detail.\n\n\
         `curl --data-binary @first.jpg 'http://localhost:8080/sessions?box=10,20,30,40'`",
        Features::Gradients.channels(),
        limits.join("\n")
    )
}

/// Parameters that are each in their range, and together beyond one limit: of candidates, of what is kept, of
/// comparisons with the background.
fn too_much() -> [Params; 3] {
    let robust = || Preset::Robust.params();
    let large = || Params {
        patch_width: 64,
        patch_height: 64,
        ..robust()
    };
    [
        large(),
        Params {
            particles: 1,
            ..large()
        },
        Params {
            particles: 1000,
            background_samples: 256,
            ..robust()
        },
    ]
}
