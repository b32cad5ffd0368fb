//! Memory that uploads may take together, charged as their bytes arrive.

use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Bytes that one permit stands for.
const BYTES_PER_PERMIT: usize = 1024;

/// Bytes that may be held at the same time. Clones are the same budget.
#[derive(Debug, Clone)]
pub struct ByteBudget(Arc<Semaphore>);

/// Which budget has too little left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BytesFull {
    /// That of all clients.
    #[error("the bytes of all uploads together are used up")]
    All,
    /// The client's own.
    #[error("the client's bytes are used up")]
    Client,
}

impl ByteBudget {
    /// So many bytes, in units of 1 KiB.
    pub fn new(bytes: usize) -> Self {
        let permits = bytes.div_ceil(BYTES_PER_PERMIT);
        Self(Arc::new(Semaphore::new(
            permits.min(Semaphore::MAX_PERMITS),
        )))
    }

    /// Bytes that are left.
    pub fn left(&self) -> usize {
        self.0.available_permits().saturating_mul(BYTES_PER_PERMIT)
    }

    /// Takes bytes until the returned value is dropped; none if there are too few left.
    pub(crate) fn hold(&self, bytes: usize) -> Option<OwnedSemaphorePermit> {
        self.take(u32::try_from(bytes.div_ceil(BYTES_PER_PERMIT)).ok()?)
    }

    fn take(&self, permits: u32) -> Option<OwnedSemaphorePermit> {
        self.0.clone().try_acquire_many_owned(permits).ok()
    }
}

/// Bytes of both budgets, given back when this is dropped.
#[derive(Debug)]
pub struct ByteCharge {
    all: OwnedSemaphorePermit,
    client: OwnedSemaphorePermit,
    budgets: [ByteBudget; 2],
    bytes: usize,
}

impl ByteCharge {
    /// No bytes yet, of the budgets of all clients and of this one.
    pub fn new(all: &ByteBudget, client: &ByteBudget) -> Self {
        let nothing = |budget: &ByteBudget| budget.take(0).expect("no permits can be had always");
        Self {
            all: nothing(all),
            client: nothing(client),
            budgets: [all.clone(), client.clone()],
            bytes: 0,
        }
    }

    /// Charges so many bytes more.
    ///
    /// # Errors
    /// One of the budgets has too few left. Nothing was charged.
    pub fn grow(&mut self, bytes: usize) -> Result<(), BytesFull> {
        let total = self.bytes.saturating_add(bytes);
        let more = total.div_ceil(BYTES_PER_PERMIT) - self.bytes.div_ceil(BYTES_PER_PERMIT);
        let more = u32::try_from(more).map_err(|_| BytesFull::All)?;
        let client = self.budgets[1].take(more).ok_or(BytesFull::Client)?;
        let all = self.budgets[0].take(more).ok_or(BytesFull::All)?;
        self.client.merge(client);
        self.all.merge(all);
        self.bytes = total;
        Ok(())
    }

    /// Gives bytes back, down to so many.
    pub fn shrink(&mut self, bytes: usize) {
        let permits = |bytes: usize| bytes.div_ceil(BYTES_PER_PERMIT);
        let less = permits(self.bytes).saturating_sub(permits(bytes));
        drop((self.all.split(less), self.client.split(less)));
        self.bytes = self.bytes.min(bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_charge_grows_until_a_budget_is_used_up_and_gives_all_back() {
        let (all, client) = (ByteBudget::new(4096), ByteBudget::new(3000));
        let mut charge = ByteCharge::new(&all, &client);
        charge.grow(10).unwrap();
        charge.grow(2000).unwrap();
        assert_eq!((all.left(), client.left()), (2048, 1024));
        assert_eq!(charge.grow(2000), Err(BytesFull::Client));
        let other = ByteBudget::new(9000);
        let mut second = ByteCharge::new(&all, &other);
        assert_eq!(second.grow(2049), Err(BytesFull::All));
        assert_eq!(other.left(), 9216, "nothing was charged");
        second.grow(2048).unwrap();
        second.shrink(1000);
        assert_eq!((all.left(), other.left()), (1024, 8192));
        drop((charge, second));
        assert_eq!((all.left(), client.left()), (4096, 3072));
    }
}
