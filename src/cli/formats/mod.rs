//! How `bagtrack track` writes boxes: one file a format.
//!
//! In: a [`Row`] for each target in each frame. Out: a line. `text`, `json` and `csv` have 0-based pixels, as the
//! service does, with the score and the status; `otb` and `mot` are what the tools of these benchmarks read.

mod csv;
mod json;
mod mot;
mod otb;
mod row;
mod text;

pub use row::{Columns, Row};

/// A format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
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
}

impl Format {
    /// Whether its lines say which frame and target they are of.
    pub fn has_target(self) -> bool {
        self != Self::Otb
    }

    /// What the file begins with.
    pub fn header(self, columns: Columns) -> Option<String> {
        match self {
            Self::Text => Some(text::header(columns)),
            Self::Csv => Some(csv::HEADER.to_owned()),
            Self::Json | Self::Otb | Self::Mot => None,
        }
    }

    /// The line of a target in a frame.
    pub fn line(self, row: &Row, columns: Columns) -> serde_json::Result<String> {
        Ok(match self {
            Self::Text => text::line(row, columns),
            Self::Json => json::line(row)?,
            Self::Csv => csv::line(row),
            Self::Otb => otb::line(row),
            Self::Mot => mot::line(row),
        })
    }
}
