//! The schema of the tracker's parameters. It is made here and nowhere else.

use crate::http::upload::overrides::{ParamOverrides, by_name};
use crate::tracker::Preset;
use serde_json::{Value, json};
use std::borrow::Cow;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, ObjectBuilder, Schema, Type};
use utoipa::{PartialSchema, ToSchema};

impl ToSchema for ParamOverrides {
    fn name() -> Cow<'static, str> {
        "Params".into()
    }
}

impl PartialSchema for ParamOverrides {
    /// An object with a property for each parameter.
    fn schema() -> RefOr<Schema> {
        let known = by_name(&Preset::default().params());
        let object = known.into_iter().fold(
            ObjectBuilder::new()
                .description(Some(
                    "Parameters of the tracker. Each has a range, and some have a limit together; see the call \
                     `createSession`.",
                ))
                .additional_properties(Some(AdditionalProperties::FreeForm(false)))
                .examples([json!({"seed": 7})]),
            |object, (name, value)| object.property(name, param(&value)),
        );
        object.build().into()
    }
}

/// A parameter whose value in the default preset is `value`.
fn param(value: &Value) -> Schema {
    let schema_type = match value {
        Value::Bool(_) => Type::Boolean,
        Value::Number(number) if number.is_u64() => Type::Integer,
        Value::Number(_) => Type::Number,
        _ => Type::String,
    };
    let schema = ObjectBuilder::new().schema_type(schema_type);
    schema.build().into()
}
