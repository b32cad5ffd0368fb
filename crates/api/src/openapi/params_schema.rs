//! The schema of the tracker's parameters. It is made here and nowhere else, from the tracker's table.

use crate::requests::{MAX_EXACT, number_schema, public_params};
use bagtrack_tracker::{Parameter, Params, Preset};
use serde_json::Value;
use utoipa::Number;
use utoipa::openapi::schema::{
    AdditionalProperties, KnownFormat, Object, ObjectBuilder, Schema, SchemaFormat, Type,
};

/// An object with a property for each parameter.
pub(super) fn parameters() -> Object {
    let mut defaults = public_params(&Preset::default().params()).0;
    // Without one, a session draws its own.
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

/// A row of the table, with the value that the parameter has when it is left out.
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
