//! The network of a second opinion, from the command line.

use std::fs;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use bagtrack_siamese::NanoTrack;
use bagtrack_tracker::{Expert, InDoubt};

/// The flag that gives a network.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ModelFlag {
    /// A network that gives a second opinion of every frame, as KIND:FILE,FILE. The one kind is `nanotrack`, with the
    /// ONNX files of its backbone and its head. docs/laboratory/ACCURACY.md says where they are and what they bring.
    #[arg(long, value_name = "nanotrack:BACKBONE,HEAD")]
    model: Option<ModelFiles>,
    /// Asks the network only of frames of which the filter is not sure: with a score below 0.95.
    #[arg(long, requires = "model")]
    model_in_doubt: bool,
}

impl ModelFlag {
    /// The network; `None` without the flag.
    ///
    /// # Errors
    /// A file cannot be read, or is no such network; the text is one line and names the file.
    pub fn load(&self) -> Result<Option<Arc<dyn Expert>>, String> {
        let load = |files: &ModelFiles| files.load(self.model_in_doubt);
        self.model.as_ref().map(load).transpose()
    }
}

/// The files of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelFiles {
    backbone: PathBuf,
    head: PathBuf,
}

impl FromStr for ModelFiles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let files = match text.split_once(':') {
            Some(("nanotrack", files)) => files,
            Some((kind, _)) => return Err(format!("there is no kind {kind}: there is nanotrack")),
            None => return Err("it must be nanotrack:BACKBONE,HEAD".to_owned()),
        };
        match files.split(',').collect::<Vec<_>>()[..] {
            [backbone, head] if !backbone.is_empty() && !head.is_empty() => Ok(Self {
                backbone: backbone.into(),
                head: head.into(),
            }),
            _ => Err(
                "it must name two files, the backbone and the head, with a comma between"
                    .to_owned(),
            ),
        }
    }
}

impl ModelFiles {
    /// The network in these files. With `in_doubt` it is asked only of frames of which the filter is not sure.
    ///
    /// # Errors
    /// A file cannot be read, or is no such network; the text is one line and names the file.
    pub fn load(&self, in_doubt: bool) -> Result<Arc<dyn Expert>, String> {
        let read = |path: &PathBuf| {
            fs::read(path).map_err(|error| format!("--model: {}: {error}", path.display()))
        };
        let (backbone, head) = (read(&self.backbone)?, read(&self.head)?);
        let network = NanoTrack::from_onnx(&backbone, &head).map_err(|error| {
            let (backbone, head) = (self.backbone.display(), self.head.display());
            format!("--model: {backbone} and {head} are no NanoTrack: {error}")
        })?;
        let network: Arc<dyn Expert> = Arc::new(network);
        Ok(if in_doubt {
            Arc::new(InDoubt(network))
        } else {
            network
        })
    }
}
