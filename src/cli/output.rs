//! Folders that a command writes.

use std::fs;
use std::path::Path;

/// Makes `dir`, or takes it where it is empty: nothing that somebody keeps is ever written over.
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
