//! The address of a store, as one setting gives it: `file:DIR`, or the URL of a Redis.

#[cfg(feature = "redis")]
use super::redis::{RedisAddress, RedisAddressError};
use std::path::PathBuf;
use std::time::Duration;

/// The text is no address of a store. The error does not show the text, which may have a password in it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// The text begins with `file:`, and names no folder.
    #[error("file: is followed by a folder, like file:/var/lib/bagtrack")]
    NoFolder,
    /// The text is neither a folder nor the address of a Redis.
    #[cfg(feature = "redis")]
    #[error(transparent)]
    Redis(#[from] RedisAddressError),
    /// The text is no folder, and this build has no other stores.
    #[cfg(not(feature = "redis"))]
    #[error("this build, without the feature redis, has stores in folders only: file:DIR")]
    NoRedis,
}

/// Where a store is.
#[derive(Debug, Clone)]
pub enum StoreAddress {
    /// A Redis, which replicas share.
    #[cfg(feature = "redis")]
    Redis(RedisAddress),
    /// A folder of this machine, for one process.
    File(PathBuf),
}

impl StoreAddress {
    /// Reads `file:DIR` (also `file:///DIR`), or the address of a Redis (`RedisAddress::parse`).
    ///
    /// # Errors
    /// The text is neither.
    pub fn parse(text: &str, timeout: Duration) -> Result<Self, AddressError> {
        let Some(folder) = text.strip_prefix("file:") else {
            return Self::parse_shared(text, timeout);
        };
        // After two slashes comes a host, which has to be empty.
        let folder = match folder.strip_prefix("//") {
            Some(path) if path.starts_with('/') => path,
            Some(_) => return Err(AddressError::NoFolder),
            None => folder,
        };
        match folder {
            "" => Err(AddressError::NoFolder),
            folder => Ok(Self::File(folder.into())),
        }
    }

    #[cfg(feature = "redis")]
    fn parse_shared(text: &str, timeout: Duration) -> Result<Self, AddressError> {
        Ok(Self::Redis(RedisAddress::parse(text, timeout)?))
    }

    #[cfg(not(feature = "redis"))]
    fn parse_shared(_: &str, _: Duration) -> Result<Self, AddressError> {
        Err(AddressError::NoRedis)
    }
}

#[cfg(all(test, feature = "redis"))]
mod tests {
    use super::*;

    #[test]
    fn a_folder_or_a_redis_is_named() {
        let parse = |text| StoreAddress::parse(text, Duration::from_secs(1));
        for (text, folder) in [
            ("file:sessions", "sessions"),
            ("file:/var/lib/bagtrack", "/var/lib/bagtrack"),
            ("file:///var/lib/bagtrack", "/var/lib/bagtrack"),
        ] {
            match parse(text) {
                Ok(StoreAddress::File(path)) => assert_eq!(path, PathBuf::from(folder)),
                other => panic!("{text}: {other:?}"),
            }
        }
        assert!(matches!(
            parse("redis://localhost"),
            Ok(StoreAddress::Redis(_))
        ));
        for text in ["file:", "file://", "file://host/folder"] {
            assert_eq!(parse(text).unwrap_err(), AddressError::NoFolder, "{text}");
        }
        for text in ["/var/lib/bagtrack", "http://localhost", ""] {
            assert!(matches!(parse(text), Err(AddressError::Redis(_))), "{text}");
        }
    }
}
