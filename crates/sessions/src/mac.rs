//! Message authentication codes: proof that this service, or one with the same secrets, wrote some bytes.
//!
//! The code is BLAKE3 with a key. Each key is derived from a secret for one use, so that a code made for one use proves
//! nothing for another. Codes are compared in constant time, which `blake3::Hash` does.

/// Bytes of a code.
pub const MAC_BYTES: usize = blake3::OUT_LEN;

use crate::random::random;

type Key = [u8; blake3::KEY_LEN];

/// From this the key is derived that stands for "unsigned". The key is no secret, so its codes are mere checksums.
const UNSIGNED: &[u8] = b"";

/// Keys for one use: one key signs, and several are accepted, so that secrets can be replaced one after the other.
#[derive(Clone)]
pub struct MacKeys {
    context: &'static str,
    signing: Key,
    accepted: Vec<Key>,
}

impl MacKeys {
    /// Keys for the use that `context` names, which has to be unique. The first secret signs, all are accepted. Without
    /// secrets the key is random, and no other process accepts what it signs.
    pub fn new<S: AsRef<[u8]>>(context: &'static str, secrets: &[S]) -> Self {
        let derived = secrets
            .iter()
            .map(|secret| blake3::derive_key(context, secret.as_ref()));
        let mut accepted: Vec<Key> = derived.collect();
        if accepted.is_empty() {
            accepted.push(random());
        }
        Self {
            context,
            signing: accepted[0],
            accepted,
        }
    }

    /// Accepts unsigned bytes too: those whose code is made with a key that everybody knows. `signs` says whether these
    /// keys go on signing with a secret.
    pub fn accepting_unsigned(mut self, signs: bool) -> Self {
        let public = blake3::derive_key(self.context, UNSIGNED);
        self.accepted.push(public);
        if !signs {
            self.signing = public;
        }
        self
    }

    /// Whether unsigned bytes are accepted.
    pub fn accept_unsigned(&self) -> bool {
        let public = blake3::derive_key(self.context, UNSIGNED);
        self.accepted.contains(&public)
    }

    /// The code of `message`.
    pub fn sign(&self, message: &[u8]) -> [u8; MAC_BYTES] {
        *blake3::keyed_hash(&self.signing, message).as_bytes()
    }

    /// Whether `code` is the code of `message` under one of the accepted keys.
    pub fn verify(&self, message: &[u8], code: &[u8; MAC_BYTES]) -> bool {
        let code = blake3::Hash::from_bytes(*code);
        let mut keys = self.accepted.iter();
        keys.any(|key| blake3::keyed_hash(key, message) == code)
    }
}

impl std::fmt::Debug for MacKeys {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "MacKeys({} accepted)", self.accepted.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_holds_for_its_message_use_and_secret_alone() {
        let keys = MacKeys::new("a use", &["old"]);
        let code = keys.sign(b"message");
        assert!(keys.verify(b"message", &code));
        assert!(MacKeys::new("a use", &["new", "old"]).verify(b"message", &code));
        assert!(!keys.verify(b"massage", &code));
        assert!(!MacKeys::new("another use", &["old"]).verify(b"message", &code));
        assert!(!MacKeys::new("a use", &["new"]).verify(b"message", &code));
        assert!(!MacKeys::new("a use", &[""; 0]).verify(b"message", &code));
    }

    #[test]
    fn unsigned_bytes_are_accepted_only_where_that_is_asked_for() {
        let none: &[&str] = &[];
        let open = MacKeys::new("a use", none).accepting_unsigned(false);
        let code = open.sign(b"message");
        let signs = MacKeys::new("a use", &["secret"]).accepting_unsigned(true);
        assert!(signs.verify(b"message", &code));
        assert!(signs.accept_unsigned() && open.accept_unsigned());
        assert!(!MacKeys::new("a use", &["secret"]).accept_unsigned());
        assert!(!open.verify(b"message", &signs.sign(b"message")));
        assert!(!MacKeys::new("a use", &["secret"]).verify(b"message", &code));
    }

    #[test]
    fn debug_output_shows_no_key() {
        let keys = MacKeys::new("a use", &["secret"]);
        assert_eq!(format!("{keys:?}"), "MacKeys(1 accepted)");
    }
}
