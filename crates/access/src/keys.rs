//! The API keys, from the settings and from a file.
//!
//! Only digests are kept. A key that is presented is hashed and compared with all of them in constant time.

use super::token::PREFIX;
use bagtrack_config::Secret;
use bagtrack_sessions::Owner;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

const KEY_BYTES: std::ops::RangeInclusive<usize> = 16..=256;
const MAX_NAME_BYTES: usize = 64;

/// Why there are no keys.
#[derive(Debug, thiserror::Error)]
pub enum KeysError {
    /// An entry cannot be read. It is not shown, since it may hold a key.
    #[error(
        "{place}, entry {number}: write name:key, with a name of up to 64 letters, digits, `-`, `_` or `.`, and a key \
         of 16 to 256 visible characters that does not begin like a session token, with `{PREFIX}`"
    )]
    Entry {
        /// Where the entry stands.
        place: String,
        /// The number of the entry there, counted from 1.
        number: usize,
    },
    /// The file cannot be read.
    #[error("{path} (--api-keys-file, BAGTRACK_API_KEYS_FILE) cannot be read: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file has no key: nobody could use the service.
    #[error("{0} (--api-keys-file, BAGTRACK_API_KEYS_FILE) has no key")]
    Empty(PathBuf),
    /// Two clients have the same key.
    #[error(
        "the clients {0} and {1} have the same API key (--api-keys, --api-keys-file): each needs a key of its own, which \
         tells whose a session is"
    )]
    Shared(String, String),
}

#[derive(Debug, Clone)]
struct ApiKey {
    owner: Owner,
    digest: blake3::Hash,
}

/// The API keys. Clones share them.
#[derive(Debug, Clone)]
pub struct ApiKeys(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    fixed: Vec<ApiKey>,
    file: Option<PathBuf>,
    current: RwLock<Arc<[ApiKey]>>,
}

impl ApiKeys {
    /// The keys of these texts and of this file.
    ///
    /// # Errors
    /// See [`KeysError`].
    pub fn load(texts: &[Secret], file: Option<&Path>) -> Result<Self, KeysError> {
        let texts = texts.iter().map(Secret::text);
        let fixed = parse(texts, "--api-keys (BAGTRACK_API_KEYS)")?;
        let keys = Self(Arc::new(Inner {
            fixed,
            file: file.map(Path::to_owned),
            current: RwLock::default(),
        }));
        // At the start the file may be one that can be read only once, like a pipe.
        keys.read(&|path| std::fs::read_to_string(path))?;
        Ok(keys)
    }

    /// Reads the file again. Returns the number of keys.
    ///
    /// # Errors
    /// See [`KeysError`]. The keys then stay as they were.
    pub fn reload(&self) -> Result<usize, KeysError> {
        self.read(&read_regular)
    }

    fn read(&self, file: &dyn Fn(&Path) -> io::Result<String>) -> Result<usize, KeysError> {
        let mut keys = self.0.fixed.clone();
        if let Some(path) = &self.0.file {
            let text = file(path).map_err(|source| KeysError::File {
                path: path.clone(),
                source,
            })?;
            // Some editors begin a text with a byte-order mark.
            let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
            let lines = text.lines().map(str::trim);
            let lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
            let read = parse(lines, &path.display().to_string())?;
            if read.is_empty() {
                return Err(KeysError::Empty(path.clone()));
            }
            keys.extend(read);
        }
        check_owners(&keys)?;
        let count = keys.len();
        let current = self.0.current.write();
        *current.unwrap_or_else(PoisonError::into_inner) = keys.into();
        Ok(count)
    }

    /// Whether a key is needed to use the service.
    pub fn are_needed(&self) -> bool {
        self.0.file.is_some() || !self.0.fixed.is_empty()
    }

    /// The owner of this key, and its digest.
    pub fn owner(&self, presented: &[u8]) -> Option<(Owner, blake3::Hash)> {
        let digest = blake3::hash(presented);
        let mut owner = None;
        // All keys are compared, so the time does not tell which one fits.
        for key in self.current().iter() {
            if key.digest == digest {
                owner = Some((key.owner.clone(), digest));
            }
        }
        owner
    }

    /// The digests of this owner's keys.
    pub fn of(&self, owner: &Owner) -> Vec<blake3::Hash> {
        let current = self.current();
        let own = current.iter().filter(|key| key.owner == *owner);
        own.map(|key| key.digest).collect()
    }

    fn current(&self) -> Arc<[ApiKey]> {
        // Nothing panics while the lock is held.
        let current = self.0.current.read();
        current.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The text of a regular file. Others are refused: a pipe to which nobody writes would block this and all later
/// reloads.
pub(super) fn read_regular(path: &Path) -> io::Result<String> {
    match std::fs::metadata(path)?.is_file() {
        true => std::fs::read_to_string(path),
        false => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is no regular file",
        )),
    }
}

fn check_owners(keys: &[ApiKey]) -> Result<(), KeysError> {
    let mut owners = HashMap::new();
    for key in keys {
        let owner = *owners.entry(key.digest).or_insert(&key.owner);
        if *owner != key.owner {
            let name = |owner: &Owner| owner.name().unwrap_or_default().to_owned();
            return Err(KeysError::Shared(name(owner), name(&key.owner)));
        }
    }
    Ok(())
}

/// The keys of entries `name:key`.
fn parse<'a>(
    entries: impl Iterator<Item = &'a str>,
    place: &str,
) -> Result<Vec<ApiKey>, KeysError> {
    let keys = entries.enumerate().map(|(index, entry)| {
        parse_one(entry).ok_or_else(|| KeysError::Entry {
            place: place.to_owned(),
            number: index + 1,
        })
    });
    keys.collect()
}

fn parse_one(entry: &str) -> Option<ApiKey> {
    let (name, key) = entry.split_once(':')?;
    let is_name = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
    let named = (1..=MAX_NAME_BYTES).contains(&name.len()) && name.bytes().all(is_name);
    let usable = KEY_BYTES.contains(&key.len()) && key.bytes().all(|byte| byte.is_ascii_graphic());
    let is_token = key.starts_with(PREFIX);
    (named && usable && !is_token).then(|| ApiKey {
        owner: Owner::named(name),
        digest: blake3::hash(key.as_bytes()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_entries_with_a_name_and_a_long_key_are_taken_and_no_error_shows_the_key() {
        let long = "0123456789abcdef";
        let load = |text: &str| ApiKeys::load(&[Secret::from(text)], None);
        let keys = load(&format!("me:{long}")).unwrap();
        let me = (Owner::named("me"), blake3::hash(long.as_bytes()));
        assert_eq!(keys.owner(long.as_bytes()), Some(me));
        assert_eq!(keys.owner(b"0123456789abcdeg"), None);
        for wrong in [
            "me:short-key",
            "0123456789abcdef",
            ":0123456789abcdef",
            "a b:0123456789abcdef",
            // This key would be taken for a session token.
            "me:bagtrack-session.0123456789abcdef",
        ] {
            let message = load(wrong).unwrap_err().to_string();
            assert!(
                !message.contains("0123") && !message.contains("short-key"),
                "{message}"
            );
        }
    }
}
