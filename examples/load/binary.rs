//! Where the server's binary is.

use std::io;
use std::path::PathBuf;

/// The given one, or `bagtrack` beside the folder of this program.
pub fn server(given: Option<PathBuf>) -> io::Result<PathBuf> {
    if let Some(binary) = given {
        return Ok(binary);
    }
    let program = std::env::current_exe()?;
    let folder = program.parent().and_then(|examples| examples.parent());
    let folder = folder.ok_or_else(|| io::Error::other("no folder above this program"))?;
    Ok(folder.join("bagtrack"))
}
