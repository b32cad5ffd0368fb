//! The files of the store's folder, as they are before the database opens them.

use super::database::OpenError;
use std::fs::{self, DirBuilder, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The folder of the tables.
const TABLES: &str = "keyspaces";

/// Makes a folder that others of this machine cannot look into.
pub(super) fn make_folder(folder: &Path) -> io::Result<()> {
    let mut builder = DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::DirBuilderExt;
        builder.mode(0o700);
    }
    builder.create(folder)
}

/// Whether the database has tables of sessions. Its own table, which is always there, is named `0`.
pub(super) fn has_tables(folder: &Path) -> io::Result<bool> {
    match folder.join(TABLES).read_dir() {
        Ok(entries) => {
            let names: io::Result<Vec<_>> = entries.map(|entry| Ok(entry?.file_name())).collect();
            Ok(names?.iter().any(|name| name != "0"))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Refuses tables whose journals are gone, or were emptied: the database would go on without the sessions in them. A
/// journal file has its full length from the start, so one of length 0 was emptied.
pub(super) fn check_journals(folder: &Path, journals: &[(PathBuf, u64)]) -> Result<(), OpenError> {
    let is_there = |(path, _): &(PathBuf, u64)| path.metadata().is_ok_and(|file| file.len() > 0);
    match journals.iter().any(is_there) {
        true => Ok(()),
        false => Err(OpenError::Damaged {
            folder: folder.to_owned(),
            reason: "the journal is gone".to_owned(),
        }),
    }
}

/// Removes the files of a first start that was broken off, unless another process has locked the folder. The database
/// would refuse a folder that is not set up completely.
pub(super) fn clear_unfinished(folder: &Path) -> io::Result<()> {
    let Ok(lock) = File::options().write(true).open(folder.join("lock")) else {
        return Ok(());
    };
    if lock.try_lock().is_err() {
        return Ok(());
    }
    for journal in journal_paths(folder)? {
        fs::remove_file(journal)?;
    }
    let missing_is_fine = |removed: io::Result<()>| match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    };
    missing_is_fine(fs::remove_dir_all(folder.join(TABLES)))?;
    missing_is_fine(fs::remove_file(folder.join("version")))
}

/// The journals in a folder, and how long each is without the zeros at its end.
pub(super) fn journals(folder: &Path) -> io::Result<Vec<(PathBuf, u64)>> {
    let with_length = |path: PathBuf| {
        let length = written_length(&mut File::open(&path)?)?;
        Ok((path, length))
    };
    journal_paths(folder)?
        .into_iter()
        .map(with_length)
        .collect()
}

pub(super) fn journal_paths(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries: io::Result<Vec<_>> = folder.read_dir()?.collect();
    let paths = entries?.into_iter().map(|entry| entry.path());
    let is_journal = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "jnl");
    Ok(paths.filter(is_journal).collect())
}

/// The length of a file without the zeros at its end.
fn written_length(file: &mut File) -> io::Result<u64> {
    let mut block = vec![0; 1 << 20];
    let mut end = file.metadata()?.len();
    while end > 0 {
        let start = end.saturating_sub(block.len() as u64);
        let length = usize::try_from(end - start).expect("at most the block's");
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut block[..length])?;
        if let Some(last) = block[..length].iter().rposition(|byte| *byte != 0) {
            return Ok(start + last as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}
