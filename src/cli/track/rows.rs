//! Where the boxes are written: standard output, or a new file.

use crate::cli::formats::{Columns, Format, Row};
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// The lines of boxes. Each is written at once, so that they are kept whatever ends the process.
pub struct Rows {
    out: Box<dyn Write>,
    /// The file, if it was made for these lines.
    made: Option<PathBuf>,
    is_on_terminal: bool,
    format: Format,
    columns: Columns,
    has_begun: bool,
}

impl Rows {
    /// Lines in this format, to standard output or to a file, which must be new.
    pub fn open(file: Option<&Path>, format: Format, columns: Columns) -> Result<Self, String> {
        let file = file.filter(|file| *file != Path::new("-"));
        let (out, made): (Box<dyn Write>, _) = match file {
            None => (Box::new(io::stdout()), None),
            Some(path) => match create(path)? {
                (file, true) => (Box::new(file), Some(path.to_owned())),
                (file, false) => (Box::new(file), None),
            },
        };
        Ok(Self {
            out,
            made,
            is_on_terminal: file.is_none() && io::stdout().is_terminal(),
            format,
            columns,
            has_begun: false,
        })
    }

    /// Whether people see the lines as they come.
    pub fn are_on_terminal(&self) -> bool {
        self.is_on_terminal
    }

    /// Writes the lines of these rows.
    pub fn write(&mut self, rows: &[Row]) -> io::Result<()> {
        let mut text = String::new();
        if !self.has_begun {
            text.extend(self.format.header(self.columns));
            if !text.is_empty() {
                text.push('\n');
            }
        }
        for row in rows {
            text += &self.format.line(row, self.columns)?;
            text.push('\n');
        }
        self.has_begun = true;
        self.out.write_all(text.as_bytes())?;
        self.out.flush()
    }
}

impl Drop for Rows {
    /// Takes away a file that nothing was written to, so that the command can be given again.
    fn drop(&mut self) {
        if let (Some(path), false) = (&self.made, self.has_begun) {
            let _ = fs::remove_file(path);
        }
    }
}

/// Opens a file that is not there, or one that is no usual file, like /dev/null or a pipe; and whether it was made.
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
