//! Tracked boxes as the files that other tools read: one module of this crate for each format.
//!
//! In: a [`Row`] for each target in each frame, and the [`Clip`] that they are of. Out: a line for each row, a
//! document, or the texts of a folder. `text`, `json` and `csv` have 0-based pixels, as the service does, with the
//! score and the status; the other formats are as the tools read them that they are named after. `bagtrack track`
//! writes all formats, the service answers them (`POST /track?format=…`), and the page saves them (`web/save.js`);
//! `tools/exports.sh` lets the tools' own readers read the files of all three.

mod clip;
mod coco;
mod csv;
mod cvat;
mod json;
mod label_studio;
mod mot;
mod otb;
mod row;
mod text;
mod yolo;

pub use clip::Clip;
pub use row::{Columns, Row};
pub use yolo::folder as yolo_folder;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use std::sync::LazyLock;

/// A format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// One file.
    File(FileFormat),
    /// Ultralytics' YOLO: a folder with data.yaml and a text for each frame ([`yolo_folder`]).
    Yolo,
}

/// A format of one file. Its names are those of the command and of the service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum FileFormat {
    /// A table for people, in 0-based pixels.
    Text,
    /// An object a line, in 0-based pixels.
    Json,
    /// frame,time,target,x,y,width,height,score,status with a header, in 0-based pixels.
    Csv,
    /// x,y,width,height a frame, in 1-based pixels, as tools of the Object Tracking Benchmark read it; one target only.
    Otb,
    /// frame,id,left,top,width,height,score,-1,-1,-1, all counted from 1, as tools of the MOTChallenge read it.
    Mot,
    /// COCO's JSON, with `track_id` and `video_id`; without the frames in which a target is lost.
    Coco,
    /// CVAT for video 1.1: a track for each target, outside where it is lost.
    Cvat,
    /// Label Studio's JSON: a task with a `videorectangle` for each target, switched off where it is lost.
    LabelStudio,
}

impl ValueEnum for Format {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<Format>> = LazyLock::new(|| {
            let files = FileFormat::value_variants().iter().copied();
            files.map(Format::File).chain([Format::Yolo]).collect()
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::File(format) => format.to_possible_value(),
            Self::Yolo => Some(PossibleValue::new("yolo").help(
                "Ultralytics' YOLO: a folder (`-o DIR`) with data.yaml and a text for each frame; without lost targets",
            )),
        }
    }
}

/// What a format cannot say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// The format does not tell which target a box is of.
    #[error("otb has one target a file: take mot or csv, or track each box for itself")]
    Targets,
    /// The format does not say what is between two key frames.
    #[error("otb, coco and yolo have boxes of every frame: take another format for key frames")]
    KeyFrames,
}

/// What a format of one file makes of rows.
pub enum Form {
    /// A line for each row, which is written at once.
    Lines(Lines),
    /// One text for all rows, which is written at the end.
    Document(fn(&Clip, &[Row]) -> serde_json::Result<String>),
}

/// A format that has a line for each row.
pub struct Lines {
    /// What the file begins with.
    pub header: fn(Columns) -> Option<String>,
    /// The line of a target in a frame.
    pub line: fn(&Row, Columns) -> serde_json::Result<String>,
}

impl Lines {
    fn text(&self, rows: &[Row], columns: Columns) -> serde_json::Result<String> {
        let mut text = String::new();
        if let Some(line) = (self.header)(columns) {
            text += &line;
            text.push('\n');
        }
        for row in rows {
            text += &(self.line)(row, columns)?;
            text.push('\n');
        }
        Ok(text)
    }
}

/// Rows as documents and folders have them: frame by frame, forwards.
pub fn in_order(rows: &mut [Row]) -> &[Row] {
    rows.sort_by_key(|row| (row.frame, row.target));
    rows
}

/// A text file of a folder.
#[derive(Debug)]
pub struct TextFile {
    /// Its path in the folder, with slashes.
    pub path: String,
    /// What is in it.
    pub text: String,
}

impl Format {
    /// Whether it can say what is asked for.
    ///
    /// # Errors
    /// See [`Unfit`].
    pub fn check(self, targets: usize, only_key_frames: bool) -> Result<(), Unfit> {
        match self {
            Self::File(format) => format.check(targets, only_key_frames),
            Self::Yolo if only_key_frames => Err(Unfit::KeyFrames),
            Self::Yolo => Ok(()),
        }
    }
}

impl FileFormat {
    /// The names of all formats of one file.
    pub fn names() -> impl Iterator<Item = String> {
        let values = Self::value_variants().iter();
        let values = values.filter_map(ValueEnum::to_possible_value);
        values.map(|value| value.get_name().to_owned())
    }

    /// Whether it can say what is asked for.
    ///
    /// # Errors
    /// See [`Unfit`].
    pub fn check(self, targets: usize, only_key_frames: bool) -> Result<(), Unfit> {
        match self {
            Self::Otb if targets > 1 => Err(Unfit::Targets),
            Self::Otb | Self::Coco if only_key_frames => Err(Unfit::KeyFrames),
            _ => Ok(()),
        }
    }

    /// One text of all rows of a clip, which are in the order in which they were tracked.
    ///
    /// # Errors
    /// A number cannot be written.
    pub fn text(
        self,
        clip: &Clip,
        columns: Columns,
        mut rows: Vec<Row>,
    ) -> serde_json::Result<String> {
        match self.form() {
            Form::Lines(lines) => lines.text(&rows, columns),
            Form::Document(make) => make(clip, in_order(&mut rows)),
        }
    }

    /// What the format makes of rows.
    pub fn form(self) -> Form {
        match self {
            Self::Text => Form::Lines(Lines {
                header: |columns| Some(text::header(columns)),
                line: |row, columns| Ok(text::line(row, columns)),
            }),
            Self::Csv => Form::Lines(Lines {
                header: |_| Some(csv::HEADER.to_owned()),
                line: |row, _| Ok(csv::line(row)),
            }),
            Self::Json => Form::Lines(plain(|row, _| json::line(row))),
            Self::Otb => Form::Lines(plain(|row, _| Ok(otb::line(row)))),
            Self::Mot => Form::Lines(plain(|row, _| Ok(mot::line(row)))),
            Self::Coco => Form::Document(coco::document),
            Self::Cvat => Form::Document(|clip, rows| Ok(cvat::document(clip, rows))),
            Self::LabelStudio => Form::Document(label_studio::document),
        }
    }
}

/// Lines without a header.
fn plain(line: fn(&Row, Columns) -> serde_json::Result<String>) -> Lines {
    Lines {
        header: |_| None,
        line,
    }
}

/// JSON with an indent of one space, as the page writes it.
fn pretty(value: &impl serde::Serialize) -> serde_json::Result<String> {
    let mut bytes = Vec::new();
    let formatter = serde_json::ser::PrettyFormatter::with_indent(b" ");
    value.serialize(&mut serde_json::Serializer::with_formatter(
        &mut bytes, formatter,
    ))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned() + "\n")
}
