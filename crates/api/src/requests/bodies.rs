//! The schemas of bodies: one file, or frames and settings as a form or as JSON.

use super::{FrameCount, Settings};
use crate::boxes::MAX_TARGETS;
use crate::parameters::{Parameters, PresetName};
use crate::rect::Rect;
use std::borrow::Cow;
use std::marker::PhantomData;
use utoipa::openapi::path::{Parameter, ParameterIn};
use utoipa::openapi::schema::{
    AdditionalProperties, AnyOfBuilder, ArrayBuilder, KnownFormat, Object, ObjectBuilder,
    OneOfBuilder, Schema, SchemaFormat, Type,
};
use utoipa::openapi::{Ref, RefOr, Required};
use utoipa::{Number, PartialSchema, ToSchema};

/// A body or an answer that is one file.
#[derive(Debug)]
pub struct BinaryBody;

impl ToSchema for BinaryBody {}

impl PartialSchema for BinaryBody {
    fn schema() -> RefOr<Schema> {
        let file = ObjectBuilder::new().schema_type(Type::String);
        let binary = SchemaFormat::KnownFormat(KnownFormat::Binary);
        file.format(Some(binary)).build().into()
    }
}

/// The `multipart/form-data` body of the route with the settings `S`: a part for each file, and a text part for each
/// setting.
#[derive(Debug)]
pub struct FormBody<S>(PhantomData<S>);

/// The JSON body of the route with the settings `S`: frames as base64, and a field for each setting.
#[derive(Debug)]
pub struct JsonBody<S>(PhantomData<S>);

impl<S: Settings> ToSchema for FormBody<S> {
    fn name() -> Cow<'static, str> {
        format!("{}Form", S::SCHEMA_PREFIX).into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((PresetName::name().into(), PresetName::schema()));
    }
}

impl<S: Settings> PartialSchema for FormBody<S> {
    fn schema() -> RefOr<Schema> {
        let mut body = body_of("Files and the settings as texts.");
        for setting in S::into_params(|| Some(ParameterIn::Query)) {
            let (name, required) = (setting.name.clone(), setting.required.clone());
            if let Some(schema) = in_form(setting) {
                body.properties.insert(name.clone(), schema);
            }
            if matches!(required, Required::True) {
                body.required.push(name);
            }
        }
        let file: Schema = match S::FRAMES {
            FrameCount::One => binary("application/octet-stream", FILE).into(),
            FrameCount::Several => ArrayBuilder::new()
                .items(binary("application/octet-stream", FILE))
                .min_items(Some(1))
                .description(Some("One file or more, each as a part with this name."))
                .build()
                .into(),
        };
        body.properties.insert("frame".to_owned(), file.into());
        body.required.push("frame".to_owned());
        if S::TAKES_SNAPSHOT {
            let snapshot: Schema = binary("application/vnd.bagtrack.snapshot", SNAPSHOT).into();
            body.properties
                .insert("snapshot".to_owned(), snapshot.into());
        }
        Schema::Object(body).into()
    }
}

impl<S: Settings> ToSchema for JsonBody<S> {
    fn name() -> Cow<'static, str> {
        format!("{}Json", S::SCHEMA_PREFIX).into()
    }
}

impl<S: Settings> PartialSchema for JsonBody<S> {
    fn schema() -> RefOr<Schema> {
        let mut body = body_of(
            "Frames as base64 or data URLs, and the settings. At least one frame has to be there.",
        );
        for setting in S::into_params(|| Some(ParameterIn::Query)) {
            let name = setting.name.clone();
            body.properties.insert(name, in_json(setting));
        }
        body.properties
            .insert("frame".to_owned(), base64(FILE).into());
        if S::TAKES_SNAPSHOT {
            let snapshot = base64(SNAPSHOT).into();
            body.properties.insert("snapshot".to_owned(), snapshot);
        }
        match S::FRAMES {
            FrameCount::One => body.required.push("frame".to_owned()),
            FrameCount::Several => {
                let frames = ArrayBuilder::new()
                    .items(base64("A JPEG, PNG or WebP file."))
                    .min_items(Some(1))
                    .description(Some("Several frames, in order."));
                body.properties.insert("frames".to_owned(), frames.into());
                // `frame` or `frames` is required. A schema that says so in full makes client generators require both.
                body.min_properties = Some(1);
            }
        }
        Schema::Object(body).into()
    }
}

fn body_of(description: &str) -> Object {
    let mut body = Object::new();
    body.description = Some(description.to_owned());
    body.additional_properties = Some(Box::new(AdditionalProperties::FreeForm(false)));
    body
}

/// The schema of a setting as a part of a form: a text, as in the query.
fn in_form(setting: Parameter) -> Option<RefOr<Schema>> {
    // The field `example` is private, but it is serialised.
    let example = serde_json::to_value(&setting).ok();
    let example = example.and_then(|setting| setting.get("example").cloned());
    Some(match setting.schema? {
        RefOr::T(Schema::Object(mut schema)) => {
            schema.description = setting.description;
            schema.example = example;
            schema.into()
        }
        schema => schema,
    })
}

/// The schema of a setting as a field of a JSON object. The parser takes a box as four numbers or as a text, too; the
/// schema has the object alone, because typed clients cannot express a choice with arrays.
fn in_json(setting: Parameter) -> RefOr<Schema> {
    let (description, null) = (setting.description, Object::with_type(Type::Null));
    let choice = |schema: RefOr<Schema>| {
        let choice = AnyOfBuilder::new().item(schema).item(null.clone());
        choice.description(description.clone()).into()
    };
    let reference = |mut schema: Ref| {
        schema.description = description.clone().unwrap_or_default();
        OneOfBuilder::new().item(schema).item(null.clone()).into()
    };
    let target = || Ref::from_schema_name(Rect::name());
    let mut schema = match setting.schema {
        Some(RefOr::T(Schema::Object(schema))) => schema,
        Some(RefOr::Ref(schema)) => return reference(schema),
        _ => unreachable!("a setting is an object or has a name"),
    };
    match schema.format.as_ref() {
        Some(SchemaFormat::Custom(format)) if format == "box" => return choice(target().into()),
        Some(SchemaFormat::Custom(format)) if format == "boxes" => {
            let list = ArrayBuilder::new()
                .items(target())
                .min_items(Some(1))
                .max_items(Some(MAX_TARGETS));
            return choice(list.into());
        }
        Some(SchemaFormat::Custom(format)) if format == "json" => {
            return reference(Ref::from_schema_name(Parameters::name()));
        }
        _ => {}
    }
    if let Some(Number::UInt(max)) = schema.maximum {
        // The number may be a text, too. The pattern allows only numbers with fewer digits than the greatest.
        schema.schema_type = [Type::Integer, Type::String, Type::Null]
            .into_iter()
            .collect();
        let digits = max.ilog10().max(1);
        schema.pattern = Some(format!("^[0-9]{{1,{digits}}}$"));
    }
    schema.description = description;
    schema.into()
}

const FILE: &str = "A frame: a JPEG, PNG or WebP file. In the call `createSession` it may be a session snapshot; \
    then nothing else is given.";

const SNAPSHOT: &str =
    "The track up to here, as the last answer had it. Without one, a track begins.";

fn base64(description: &str) -> Object {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .content_encoding("base64")
        .description(Some(description))
        .build()
}

fn binary(media_type: &str, description: &str) -> Object {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
        .content_media_type(media_type)
        .description(Some(description))
        .build()
}
