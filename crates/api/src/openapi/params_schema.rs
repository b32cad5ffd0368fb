//! The schema of the tracker's parameters, from the tracker's table; and the description of the limits on products of
//! sizes, in the words of the tracker's errors.

use crate::requests::{MAX_EXACT, number_schema, public_params};
use bagtrack_tracker::{Features, Parameter, Params, Preset};
use serde_json::Value;
use utoipa::Number;
use utoipa::openapi::schema::{
    AdditionalProperties, KnownFormat, Object, ObjectBuilder, Schema, SchemaFormat, Type,
};

/// An object with a property for each parameter.
pub(super) fn parameters() -> Object {
    let mut defaults = public_params(&Preset::default().params()).0;
    // No default: without a seed, a session draws one.
    defaults.remove("seed");
    let object = Params::TABLE.iter().fold(
        ObjectBuilder::new()
            .description(Some(
                "Parameters of the tracker. Each has a range, and some have a limit together; see the call \
                 `createSession`. The defaults are those of the preset `robust`. Without a seed a random one is \
                 drawn.",
            ))
            .additional_properties(Some(AdditionalProperties::FreeForm(false))),
        |object, row| object.property(row.name, param(row, defaults.remove(row.name))),
    );
    object.build()
}

/// The schema of the parameter in a row of the table; `default` is its value when it is left out.
fn param(row: &Parameter, default: Option<Value>) -> Schema {
    // The bounds of whole numbers are whole in the table.
    let whole = |bound| Number::Int(bound as isize);
    let (least, greatest) = row.range.unzip();
    let (schema_type, minimum, maximum) = match row.kind {
        "f64" => (
            Type::Number,
            least.map(Number::Float),
            greatest.map(Number::Float),
        ),
        "u32" => (Type::Integer, least.map(whole), greatest.map(whole)),
        _ => (Type::Integer, None, None),
    };
    let schema = match row.kind {
        "u64" => number_schema(Type::Integer, MAX_EXACT),
        kind => ObjectBuilder::new()
            .schema_type(schema_type)
            .format((kind == "u32").then_some(SchemaFormat::KnownFormat(KnownFormat::Int32)))
            .minimum(minimum)
            .maximum(maximum),
    };
    let schema = schema
        .description(Some(row.description.trim()))
        .default(default);
    schema.build().into()
}

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

/// Three sets of parameters. In each, every parameter is in its range, and together they exceed one limit: that on
/// candidates, on the kept state, or on comparisons with the background.
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
