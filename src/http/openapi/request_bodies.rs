//! The bodies that have frames and settings in them, as a form and as JSON.

use crate::http::extract::settings::{FrameCount, Settings};
use std::borrow::Cow;
use std::marker::PhantomData;
use utoipa::openapi::path::ParameterIn;
use utoipa::openapi::schema::{
    AdditionalProperties, ArrayBuilder, KnownFormat, Object, ObjectBuilder, Schema, SchemaFormat,
    Type,
};
use utoipa::openapi::{RefOr, Required};
use utoipa::{PartialSchema, ToSchema};

/// A body that is one file, and the answer that is one.
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
        S::schemas(schemas);
    }
}

impl<S: Settings> PartialSchema for FormBody<S> {
    fn schema() -> RefOr<Schema> {
        let file = ObjectBuilder::new()
            .schema_type(Type::String)
            .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
            .content_media_type("application/octet-stream")
            .description(Some(FILE));
        let file: Schema = match S::FRAMES {
            FrameCount::One => file.build().into(),
            FrameCount::Several => ArrayBuilder::new()
                .items(file.build())
                .min_items(Some(1))
                .description(Some("One file or more, each as a part with this name."))
                .build()
                .into(),
        };
        let settings = S::into_params(|| Some(ParameterIn::Query));
        let mut body = Object::new();
        body.description = Some("Files and the settings as texts.".to_owned());
        body.additional_properties = Some(Box::new(AdditionalProperties::FreeForm(false)));
        for setting in settings {
            // The field itself is private.
            let example = serde_json::to_value(&setting).ok();
            let example = example.and_then(|setting| setting.get("example").cloned());
            let required = matches!(setting.required, Required::True);
            if let Some(RefOr::T(Schema::Object(mut schema))) = setting.schema {
                schema.description = setting.description;
                schema.example = example;
                body.properties.insert(setting.name.clone(), schema.into());
            } else if let Some(schema) = setting.schema {
                body.properties.insert(setting.name.clone(), schema);
            }
            if required {
                body.required.push(setting.name);
            }
        }
        body.properties.insert("frame".to_owned(), file.into());
        body.required.push("frame".to_owned());
        if S::TAKES_SNAPSHOT {
            let snapshot = ObjectBuilder::new()
                .schema_type(Type::String)
                .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
                .content_media_type("application/vnd.bagtrack.snapshot")
                .description(Some(SNAPSHOT));
            let snapshot: Schema = snapshot.build().into();
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

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        S::schemas(schemas);
    }
}

impl<S: Settings> PartialSchema for JsonBody<S> {
    fn schema() -> RefOr<Schema> {
        let RefOr::T(Schema::Object(mut body)) = S::schema() else {
            unreachable!("settings are a struct with named fields")
        };
        body.description = Some(
            "Frames as base64 or data URLs, and the settings. At least one frame has to be there."
                .to_owned(),
        );
        for property in body.properties.values_mut() {
            describe_itself(property);
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
                // One of the two has to be there. A schema that says so in full makes generators require both.
                body.min_properties = Some(1);
            }
        }
        Schema::Object(body).into()
    }
}

/// A schema that stands beside an object with nothing but its description gets that description. The two together would
/// allow objects only.
fn describe_itself(property: &mut RefOr<Schema>) {
    let RefOr::T(Schema::AllOf(both)) = property else {
        return;
    };
    let [inner, RefOr::T(Schema::Object(beside))] = &both.items[..] else {
        return;
    };
    let description = beside.description.clone();
    let mut inner = inner.clone();
    match &mut inner {
        RefOr::Ref(schema) => schema.description = description.unwrap_or_default(),
        RefOr::T(Schema::Object(schema)) => schema.description = description,
        RefOr::T(Schema::AnyOf(schema)) => schema.description = description,
        RefOr::T(_) => return,
    }
    *property = inner;
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
