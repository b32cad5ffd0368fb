//! Where the boxes are written: standard output, a new file, or a new folder.

use bagtrack_cli::output::new_folder;
use bagtrack_formats::{Clip, Columns, Form, Format, Lines, Row, TextFile, in_order, yolo_folder};
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Takes the rows. Formats of lines are written at once, so that the lines are kept whatever ends the process. A
/// document or a folder is written by `finish`.
pub struct Rows {
    sink: Sink,
    is_on_terminal: bool,
    columns: Columns,
}

enum Sink {
    Lines(Lines, Output),
    Document(
        fn(&Clip, &[Row]) -> serde_json::Result<String>,
        Output,
        Vec<Row>,
    ),
    Yolo(PathBuf, Vec<Row>),
}

/// A file, or standard output.
struct Output {
    out: Box<dyn Write>,
    /// The path of the file, if this program made it.
    made: Option<PathBuf>,
    has_begun: bool,
}

impl Rows {
    /// Opens standard output for rows in this format, or a file or folder at `path`, which must be new.
    pub fn open(path: Option<&Path>, format: Format, columns: Columns) -> Result<Self, String> {
        let path = path.filter(|path| *path != Path::new("-"));
        let sink = match format {
            Format::File(format) => match format.form() {
                Form::Lines(lines) => Sink::Lines(lines, Output::open(path)?),
                Form::Document(make) => Sink::Document(make, Output::open(path)?, Vec::new()),
            },
            Format::Yolo => {
                let text = "a folder of texts is written: give a new folder with -o DIR";
                let path = path.ok_or_else(|| text.to_owned())?;
                new_folder(path).map_err(|error| format!("-o {error}"))?;
                Sink::Yolo(path.to_owned(), Vec::new())
            }
        };
        let is_lines = matches!(sink, Sink::Lines(..));
        Ok(Self {
            sink,
            is_on_terminal: is_lines && path.is_none() && io::stdout().is_terminal(),
            columns,
        })
    }

    /// Whether rows go to a terminal, line by line.
    pub fn are_on_terminal(&self) -> bool {
        self.is_on_terminal
    }

    pub fn write(&mut self, new: Vec<Row>) -> io::Result<()> {
        match &mut self.sink {
            Sink::Document(_, _, rows) | Sink::Yolo(_, rows) => {
                rows.extend(new);
                Ok(())
            }
            Sink::Lines(lines, output) => {
                let mut text = String::new();
                if !output.has_begun {
                    text.extend((lines.header)(self.columns));
                    if !text.is_empty() {
                        text.push('\n');
                    }
                }
                for row in &new {
                    text += &(lines.line)(row, self.columns)?;
                    text.push('\n');
                }
                output.write(&text)
            }
        }
    }

    /// How many frames the kept rows span; 0 for formats of lines, which keep none.
    pub fn length(&self) -> u64 {
        match &self.sink {
            Sink::Lines(..) => 0,
            Sink::Document(_, _, rows) | Sink::Yolo(_, rows) => Clip::length(rows),
        }
    }

    /// Writes the kept rows, which are those of this clip.
    pub fn finish(&mut self, clip: &Clip) -> io::Result<()> {
        match &mut self.sink {
            Sink::Lines(..) => Ok(()),
            Sink::Document(make, output, rows) => output.write(&make(clip, in_order(rows))?),
            Sink::Yolo(folder, rows) => {
                for TextFile { path, text } in yolo_folder(clip, in_order(rows))? {
                    let file = folder.join(path);
                    fs::create_dir_all(file.parent().unwrap_or(folder))?;
                    fs::write(&file, text)?;
                }
                Ok(())
            }
        }
    }
}

impl Output {
    fn open(path: Option<&Path>) -> Result<Self, String> {
        let (out, made): (Box<dyn Write>, _) = match path {
            None => (Box::new(io::stdout()), None),
            Some(path) => match create(path)? {
                (file, true) => (Box::new(file), Some(path.to_owned())),
                (file, false) => (Box::new(file), None),
            },
        };
        Ok(Self {
            out,
            made,
            has_begun: false,
        })
    }

    fn write(&mut self, text: &str) -> io::Result<()> {
        self.has_begun = true;
        self.out.write_all(text.as_bytes())?;
        self.out.flush()
    }
}

impl Drop for Output {
    /// Removes a file that nothing was written to, so that the command can be repeated.
    fn drop(&mut self) {
        if let (Some(path), false) = (&self.made, self.has_begun) {
            let _ = fs::remove_file(path);
        }
    }
}

/// Makes a new file, or opens an existing one that is not a regular file, like /dev/null or a pipe. Returns whether the
/// file was made.
fn create(path: &Path) -> Result<(File, bool), String> {
    let named = |error: io::Error| match error.kind() {
        ErrorKind::AlreadyExists => {
            format!(
                "-o {}: it is there: choose another file, or remove it first",
                path.display()
            )
        }
        _ => format!("-o {}: {error}", path.display()),
    };
    let is_special = path
        .metadata()
        .is_ok_and(|about| !about.is_file() && !about.is_dir());
    let mut options = OpenOptions::new();
    options.write(true).create_new(!is_special);
    Ok((options.open(path).map_err(named)?, !is_special))
}
