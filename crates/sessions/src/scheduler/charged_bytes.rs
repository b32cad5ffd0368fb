//! Bytes that own the memory which they are charged to.

use super::budget::Charge;
use bytes::Bytes;
use std::sync::Arc;

/// Bytes with their charge. As [`Bytes`] they give it back when the last clone of them is dropped: an upload when the
/// last worker is done with it, an answer when its client has taken it.
#[derive(Debug)]
pub struct ChargedBytes<B> {
    bytes: B,
    _charge: Arc<Charge>,
}

impl<B: AsRef<[u8]>> ChargedBytes<B> {
    /// Bytes for which `charge` has been reserved. What is too much of it is given back at once.
    pub fn new(bytes: B, mut charge: Charge) -> Self {
        charge.shrink(bytes.as_ref().len());
        Self::sharing(bytes, &Arc::new(charge))
    }

    /// Bytes of several that are charged together.
    pub fn sharing(bytes: B, charge: &Arc<Charge>) -> Self {
        Self {
            bytes,
            _charge: charge.clone(),
        }
    }
}

impl<B: AsRef<[u8]>> AsRef<[u8]> for ChargedBytes<B> {
    fn as_ref(&self) -> &[u8] {
        self.bytes.as_ref()
    }
}

impl<B: AsRef<[u8]> + Send + 'static> From<ChargedBytes<B>> for Bytes {
    fn from(charged: ChargedBytes<B>) -> Self {
        Self::from_owner(charged)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Budget;

    #[test]
    fn the_memory_is_free_when_the_last_clone_is_dropped() {
        let (all, client) = (Budget::new(1 << 20), Budget::new(1 << 20));
        let mut charge = Charge::new(&all, &client);
        charge.grow(64 << 10).unwrap();
        let bytes = Bytes::from(ChargedBytes::new(vec![7; 32 << 10], charge));
        assert_eq!(all.held(), 32 << 10, "what is not needed is given back");
        let part = bytes.slice(1..2);
        drop(bytes);
        assert_eq!((client.held(), &part[..]), (32 << 10, &[7][..]));
        drop(part);
        assert_eq!((all.held(), client.held()), (0, 0));
    }
}
