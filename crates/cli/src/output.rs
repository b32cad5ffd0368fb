//! What a command writes: folders, and standard output.

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

/// Makes `dir`, or takes it if it is empty. Existing files are never overwritten.
pub fn new_folder(dir: &Path) -> Result<(), String> {
    fs::create_dir_all(dir).map_err(|error| format!("{}: {error}", dir.display()))?;
    let mut entries = fs::read_dir(dir).map_err(|error| format!("{}: {error}", dir.display()))?;
    if entries.next().is_some() {
        return Err(format!(
            "{} is not empty: choose another folder, or remove it first",
            dir.display()
        ));
    }
    Ok(())
}

/// Writes `text` to standard output. A reader that ends early, as in `bagtrack eval … | head`, is not an error.
pub fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}
