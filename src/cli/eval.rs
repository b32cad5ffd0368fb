//! `bagtrack eval`.

use super::params::ParamFlags;
use super::progress;
use bagtrack::eval::{self, Report, Sequence};
use bagtrack::ingest::Limits;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Flags of `eval`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sequences in the OTB layout: a folder with img/ and groundtruth_rect.txt each. Files among them are passed over,
    /// so that `eval sequences/*` works with a note beside the folders.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    #[command(flatten)]
    params: ParamFlags,
    /// Runs of each sequence, with the seeds 0, 1, 2 …
    #[arg(long, default_value = "1")]
    seeds: NonZeroUsize,
    /// Threads that share the seeds of a sequence. Times (ms/frame) are honest with 1 only.
    #[arg(long, default_value = "1")]
    jobs: NonZeroUsize,
    /// A table for people, or JSON.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Format {
    Table,
    Json,
}

/// Runs `eval`.
pub fn run(args: Args) -> Result<(), Box<dyn std::error::Error>> {
    let params = args.params.params()?;
    let dirs: Vec<&PathBuf> = args.dirs.iter().filter(|dir| !dir.is_file()).collect();
    // A wrong path should be told now, not after the sequences before it.
    for dir in &dirs {
        eval::frames::list(dir)?;
        Sequence::read_boxes(dir)?;
    }
    let bar = progress::bar(dirs.len() as u64, "sequences");
    let mut sequences = Vec::new();
    for dir in dirs {
        let sequence = Sequence::load(dir, &Limits::default())?;
        sequences.push(eval::run(&sequence, &params, args.seeds, args.jobs)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = Report::new(args.params.preset, args.seeds.get(), sequences)
        .ok_or("none of the paths is a folder")?;
    match args.format {
        Format::Table => print!("{report}"),
        Format::Json => println!("{}", serde_json::to_string_pretty(&report)?),
    }
    Ok(())
}
