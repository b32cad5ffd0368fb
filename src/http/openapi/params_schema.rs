//! The schema of the tracker's parameters. It is made here and nowhere else, from the tracker's table.

use crate::http::upload::overrides::{ParamOverrides, by_name};
use crate::tracker::{Parameter, Params, Preset};
use serde_json::Value;
use std::borrow::Cow;
use utoipa::openapi::schema::{AdditionalProperties, ObjectBuilder, Schema, SchemaFormat, Type};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{Number, PartialSchema, ToSchema};

impl ToSchema for ParamOverrides {
    fn name() -> Cow<'static, str> {
        "Parameters".into()
    }
}

impl PartialSchema for ParamOverrides {
    /// An object with a property for each parameter.
    fn schema() -> RefOr<Schema> {
        let mut defaults = by_name(&Preset::default().params());
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
            .content_media_type("application/json")
            .content_schema(Some(Ref::from_schema_name(ParamOverrides::name())));
        text.build().into()
    }
}

/// A row of the table, with the value that the parameter has when it is left out.
fn param(row: &Parameter, default: Option<Value>) -> Schema {
    let (schema_type, number): (Type, fn(f64) -> Number) = match row.kind {
        "bool" => (Type::Boolean, Number::Float),
        "f64" => (Type::Number, Number::Float),
        // The bounds are whole numbers in the table.
        "u32" | "u64" => (Type::Integer, |bound| Number::Int(bound as isize)),
        _ => (Type::String, Number::Float),
    };
    let range = match row.kind {
        "u64" => (Some(0.0), None),
        _ => row.range.unzip(),
    };
    let choices = (!row.choices.is_empty()).then_some(row.choices.iter().copied());
    let schema = ObjectBuilder::new()
        .schema_type(schema_type)
        .description(Some(row.description.trim()))
        .minimum(range.0.map(number))
        .maximum(range.1.map(number))
        .enum_values(choices)
        .default(default);
    schema.build().into()
}
