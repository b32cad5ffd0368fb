//! What a body has: files, and settings as texts, before they are parsed.

use super::misnamed;
use crate::http::problems::problem::Problem;
use axum::body::Bytes;
use axum::extract::Query;
use axum::http::Uri;
use bagtrack_api::requests::Settings;
use serde_json::{Map, Value};

/// Most bytes of a setting. All parameters of the tracker together take some hundred.
pub(super) const MAX_TEXT_BYTES: usize = 16 << 10;
const MAX_NAME_BYTES: usize = 64;
/// Most settings of a request; no route has nearly as many.
const MAX_SETTINGS: usize = 32;

/// The texts of settings by their names, from the query and from the body.
#[derive(Debug, Clone, Default)]
pub struct Texts(Map<String, Value>);

impl Texts {
    /// The settings in the query, all of which `S` has.
    ///
    /// # Errors
    /// The query cannot be read, or a setting is unknown, doubled or no value of its type.
    pub fn of_query<S: Settings>(uri: &Uri) -> Result<Self, Problem> {
        let pairs = uri
            .query()
            .unwrap_or_default()
            .split('&')
            .take(MAX_SETTINGS + 1);
        if pairs.count() > MAX_SETTINGS {
            let detail = format!("The query has more than {MAX_SETTINGS} settings.");
            return Err(Problem::malformed(detail));
        }
        let Query(pairs) = Query::<Vec<(String, String)>>::try_from_uri(uri)
            .map_err(|_| Problem::malformed("The query cannot be read; send name=value pairs."))?;
        let mut texts = Self::default();
        for (name, text) in pairs {
            texts.add(&name, &text)?;
        }
        texts.clone().parse::<S>()?;
        Ok(texts)
    }

    /// Adds one setting.
    ///
    /// # Errors
    /// The setting is there already, its name or text is too long, or there are too many settings.
    pub fn add(&mut self, name: &str, text: &str) -> Result<(), Problem> {
        let text = text.trim();
        if name.len() > MAX_NAME_BYTES || self.0.len() >= MAX_SETTINGS {
            let start: String = name.chars().take(MAX_NAME_BYTES).collect();
            return Err(Problem::malformed(format!(
                "There is no setting `{start}`."
            )));
        }
        if text.len() > MAX_TEXT_BYTES {
            let detail = format!("`{name}` is longer than {MAX_TEXT_BYTES} bytes.");
            return Err(Problem::malformed(detail));
        }
        match self.0.insert(name.to_owned(), text.into()) {
            None => Ok(()),
            Some(_) => Err(Problem::malformed(format!(
                "`{name}` is given twice; give it once, in one value (`box=x,y,width,height`)."
            ))),
        }
    }

    /// These settings, and those of `others` that are not among them.
    pub fn or(mut self, others: Self) -> Self {
        for (name, text) in others.0 {
            self.0.entry(name).or_insert(text);
        }
        self
    }

    /// The settings.
    ///
    /// # Errors
    /// A setting is unknown, or its text is no value of its type.
    pub fn parse<S: Settings>(self) -> Result<S, Problem> {
        let misplaced = self.0.iter().find_map(|(name, text)| {
            misnamed::setting::<S>(name, text.as_str().unwrap_or_default())
        });
        match misplaced {
            Some(problem) => Err(problem),
            None => serde_json::from_value(Value::Object(self.0)).map_err(|error| {
                Problem::malformed(format!("The settings cannot be read: {error}."))
            }),
        }
    }
}

/// The files of a body, and the texts of its settings.
#[derive(Debug, Default)]
pub(super) struct Fields {
    pub(super) files: Vec<Bytes>,
    /// The content type of a file's part, where the body is a form.
    pub(super) media_type: Option<String>,
    pub(super) snapshot: Option<Bytes>,
    pub(super) texts: Texts,
}
