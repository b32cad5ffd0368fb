//! The schema of the tracker's parameters. It is made here and nowhere else, from the tracker's table.

use crate::http::extract::overrides::ParamOverrides;
use crate::http::extract::settings::{MAX_EXACT, number_schema};
use bagtrack_tracker::{Parameter, Params, Preset};
use serde_json::Value;
use std::borrow::Cow;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{
    AdditionalProperties, KnownFormat, ObjectBuilder, Schema, SchemaFormat, Type,
};
use utoipa::{Number, PartialSchema, ToSchema};

impl ToSchema for ParamOverrides {
    fn name() -> Cow<'static, str> {
        "Parameters".into()
    }
}

impl PartialSchema for ParamOverrides {
    /// An object with a property for each parameter.
    fn schema() -> RefOr<Schema> {
        let mut defaults = ParamOverrides::from(&Preset::default().params());
        // Without one, a session draws its own.
        defaults.take("seed");
        let object = Params::TABLE.iter().fold(
            ObjectBuilder::new()
                .description(Some(
                    "Parameters of the tracker. Each has a range, and some have a limit together; see the call \
                     `createSession`. The defaults are those of the preset `robust`. Without a seed a random one is \
                     drawn.",
                ))
                .additional_properties(Some(AdditionalProperties::FreeForm(false))),
            |object, row| object.property(row.name, param(row, defaults.take(row.name))),
        );
        object.build().into()
    }
}

/// The parameters as a text, in the query and in forms.
#[derive(Debug)]
pub struct ParametersText;

impl ToSchema for ParametersText {}

impl PartialSchema for ParametersText {
    fn schema() -> RefOr<Schema> {
        let text = ObjectBuilder::new()
            .schema_type(Type::String)
            .format(Some(SchemaFormat::Custom("json".to_owned())))
            .description(Some(
                "A JSON object; its properties are those of the schema `Parameters`.",
            ));
        text.build().into()
    }
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
