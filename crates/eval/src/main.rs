//! The program `bagtrack-eval`: accuracy and speed on annotated sequences.
//!
//! Exit status: 0, or 1 after an error that is printed as one line on standard error, or 2 from clap on wrong usage.

use bagtrack_cli::{ModelFlag, ParamFlags, frames, output, read_boxes};
use bagtrack_eval::{
    Comparison, Playback, Report, Sequence, SequenceRuns, Variant, ablation, results,
};
use bagtrack_ingest::Limits;
use bagtrack_tracker::Params;
use clap::Parser;
use std::error::Error;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures accuracy and speed on annotated sequences.
#[derive(Debug, Parser)]
#[command(name = "bagtrack-eval", version, about)]
struct Args {
    /// Sequences in the OTB layout: a folder with img/ and groundtruth_rect.txt each. Files among them are passed over,
    /// so that `bagtrack-eval sequences/*` works with a note beside the folders.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    #[command(flatten)]
    params: ParamFlags,
    #[command(flatten)]
    model: ModelFlag,
    /// Runs of each sequence, with the seeds 0, 1, 2 …
    #[arg(long, default_value = "1")]
    seeds: NonZeroUsize,
    /// Threads that share the seeds of a sequence. Times (ms/frame) are honest with 1 only.
    #[arg(long, default_value = "1")]
    jobs: NonZeroUsize,
    /// Plays each sequence from its end: the run starts at the last annotated frame.
    #[arg(long)]
    backwards: bool,
    /// Passes over this share of the frames, 0 <= SHARE < 1, from the end with --backwards: the run starts at the first
    /// annotated frame after them.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    start_at: Option<f64>,
    /// Plays one frame in so many, as from a client that sends fewer frames a second.
    #[arg(long, value_name = "N")]
    every: Option<NonZeroUsize>,
    /// The first boxes are off by this share of their sides, 0 < SHARE < 0.5: moved in eight directions, or smaller or
    /// larger, another way with each of twelve seeds.
    #[arg(long, value_name = "SHARE", value_parser = first_box_error)]
    first_box_error: Option<f64>,
    /// A table for people, or JSON.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// What the tracker is without each of its extensions: the means over the sequences, a row each.
    #[arg(long)]
    ablate: bool,
    /// Writes the boxes into this folder as the toolkits of OTB and pysot read them: NAME.txt for each sequence, a box
    /// a line, 1-based; with several seeds in a folder for each. Over files of these names.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["ablate", "backwards", "start_at", "every", "first_box_error"])]
    results: Option<PathBuf>,
    /// Writes a line of JSON for each scored frame into this file: its figures, and what its score is made of.
    #[arg(long, value_name = "FILE", conflicts_with = "ablate")]
    frames: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Format {
    Table,
    Json,
}

impl Args {
    fn playback(&self) -> Playback {
        Playback {
            backwards: self.backwards,
            start_at: self.start_at,
            every: self.every,
            first_box_error: self.first_box_error,
        }
    }
}

/// Reads a share of the frames.
fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if (0.0..1.0).contains(&share) {
        Ok(share)
    } else {
        Err("it must be at least 0 and less than 1".to_owned())
    }
}

/// Reads by what share of its sides the first box is off.
fn first_box_error(text: &str) -> Result<f64, String> {
    match share(text)? {
        share if share > 0.0 && share < 0.5 => Ok(share),
        _ => Err("it must be more than 0 and less than 0.5".to_owned()),
    }
}

fn main() -> ExitCode {
    match run(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bagtrack-eval: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: Args) -> Result<(), Box<dyn Error>> {
    let base = args.params.params()?;
    let variants = variants(&args);
    let evaluated = evaluate(&args, &base, &variants)?;
    if let Some(dir) = &args.results {
        results::write(dir, &evaluated[0])?;
    }
    if let Some(file) = &args.frames {
        results::write_frames(file, &evaluated[0])?;
    }
    let preset = args.params.preset;
    let mut reports = Vec::new();
    for (variant, runs) in variants.into_iter().zip(&evaluated) {
        let report = Report::new(preset, runs).ok_or("none of the paths is a folder")?;
        reports.push((variant, report.played(args.playback())));
    }
    if !args.ablate {
        let (_, report) = &reports[0];
        return print(args.format, report);
    }
    let names = evaluated[0].iter().map(|runs| runs.name.clone());
    let comparison = Comparison::new(preset, args.seeds.get(), names.collect(), &reports);
    let comparison = comparison.played(args.playback());
    print(args.format, &comparison)
}

/// The preset alone or, with `--ablate`, the variants of the ablation; at least one.
fn variants(args: &Args) -> Vec<Variant> {
    let mut variants = ablation::variants(&args.params.label());
    if !args.ablate {
        variants.truncate(1);
    }
    variants
}

/// Runs every variant on every sequence: for each variant the runs of the sequences. Variants with the same parameters
/// are run once.
fn evaluate(
    args: &Args,
    base: &Params,
    variants: &[Variant],
) -> Result<Vec<Vec<SequenceRuns>>, Box<dyn Error>> {
    let expert = args.model.load()?;
    let dirs: Vec<&PathBuf> = args.dirs.iter().filter(|dir| !dir.is_file()).collect();
    // A wrong path should be told now, not after the sequences before it.
    for dir in &dirs {
        frames::list(dir)?;
        read_boxes(dir)?;
    }
    let mut params = Vec::new();
    for variant in variants {
        let set = variant.params(base);
        params.push(set.map_err(|error| format!("{}: {error}", variant.label))?);
    }
    let mut evaluated: Vec<Vec<SequenceRuns>> = vec![Vec::new(); variants.len()];
    let bar = output::bar((dirs.len() * variants.len()) as u64, "sequences");
    for dir in dirs {
        let sequence = Sequence::load_played(dir, args.playback(), &Limits::default())?;
        let mut done: Vec<SequenceRuns> = Vec::new();
        for (index, set) in params.iter().enumerate() {
            let same = params[..index].iter().position(|before| before == set);
            done.push(match same {
                Some(before) => done[before].clone(),
                None => bagtrack_eval::run(&sequence, set, expert.as_ref(), args.seeds, args.jobs)?,
            });
            bar.inc(1);
        }
        for (of_variant, runs) in evaluated.iter_mut().zip(done) {
            of_variant.push(runs);
        }
    }
    bar.finish_and_clear();
    Ok(evaluated)
}

fn print<R: serde::Serialize + std::fmt::Display>(
    format: Format,
    report: &R,
) -> Result<(), Box<dyn Error>> {
    let text = match format {
        Format::Table => report.to_string(),
        Format::Json => serde_json::to_string_pretty(report)? + "\n",
    };
    Ok(output::print(&text)?)
}
