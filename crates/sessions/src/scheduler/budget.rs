//! Bounds on what all clients together, and each client alone, may hold of one thing: bytes of memory, places.
//!
//! A client may hold no more than is free (a dynamic threshold: Choudhury, Hahne 1998), and no more than its own
//! maximum. So each further greedy client gets half of what those before it left, and no number of them takes all. A
//! network of clients is bounded too: its clients together may hold no more than is free, or than one client may where
//! that is more. So many addresses of one network do not add up to many shares.
//!
//! A client may have parts, of which none holds more than it leaves of the client's budget.
//!
//! Bytes may own [their charge](ChargedBytes).

use crate::sync::atomic::{AtomicUsize, Ordering};
use bytes::Bytes;
use std::sync::Arc;

/// How many of a thing may be held at the same time, and are held. Clones are the same budget.
#[derive(Debug, Clone)]
pub struct Budget(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    most: usize,
    held: AtomicUsize,
    /// The budgets of the networks that a client is in.
    networks: Vec<Budget>,
    /// The client's budget, where this is the budget of a part of the client.
    whole: Option<Budget>,
}

/// Which budget has too little left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BudgetFull {
    /// The budget of all clients: it is used up, or this client holds as much as is free.
    #[error("all clients together hold as much as they may")]
    All,
    /// The client's own budget.
    #[error("the client holds as much as it may")]
    Client,
}

impl Budget {
    /// A budget of `most`.
    pub fn new(most: usize) -> Self {
        Self::of_client(most, Vec::new())
    }

    /// The budget of a client in these networks.
    pub fn of_client(most: usize, networks: Vec<Self>) -> Self {
        Self(Arc::new(Inner {
            most,
            held: AtomicUsize::new(0),
            networks,
            whole: None,
        }))
    }

    /// The budget of a part of this client: what the part holds, the client holds too.
    pub fn part(&self) -> Self {
        Self(Arc::new(Inner {
            most: self.0.most,
            held: AtomicUsize::new(0),
            networks: self.0.networks.clone(),
            whole: Some(self.clone()),
        }))
    }

    /// How many are left.
    pub fn left(&self) -> usize {
        self.0.most.saturating_sub(self.held())
    }

    /// How many are held.
    pub fn held(&self) -> usize {
        self.0.held.load(Ordering::Acquire)
    }

    /// Takes `count` until the returned value is dropped; `None` if too few are left.
    pub(crate) fn hold(&self, count: usize) -> Option<Charge> {
        let mut charge = Charge::new(self, &Self::new(usize::MAX));
        charge.grow(count).ok()?;
        Some(charge)
    }

    /// Takes `count`, if no more than `limit` are held then. Returns whether it did.
    fn take(&self, count: usize, limit: usize) -> bool {
        let limit = limit.min(self.0.most);
        let more = |held: usize| held.checked_add(count).filter(|held| *held <= limit);
        let held = &self.0.held;
        count == 0
            || held
                .fetch_update(Ordering::AcqRel, Ordering::Acquire, more)
                .is_ok()
    }

    fn give_back(&self, count: usize) {
        self.0.held.fetch_sub(count, Ordering::AcqRel);
    }
}

/// What a client holds of its own budget and of the budget of all clients. Given back when this is dropped.
#[derive(Debug)]
pub struct Charge {
    all: Budget,
    client: Budget,
    count: usize,
}

impl Charge {
    /// A charge of nothing yet, to the budgets of all clients and of this client.
    pub fn new(all: &Budget, client: &Budget) -> Self {
        Self {
            all: all.clone(),
            client: client.clone(),
            count: 0,
        }
    }

    /// Takes `count` more.
    ///
    /// # Errors
    /// One of the budgets has too few left. Nothing was taken.
    pub fn grow(&mut self, count: usize) -> Result<(), BudgetFull> {
        let (client, free) = (&self.client.0, self.all.left());
        let most = client.whole.as_ref().map_or(client.most, Budget::left);
        if count > most.saturating_sub(self.client.held()) {
            return Err(BudgetFull::Client);
        }
        let whole = client.whole.as_ref().unwrap_or(&self.client);
        // A client that alone holds anything may have all that is free.
        let is_alone = self.all.held() <= whole.held();
        let limit = if is_alone { usize::MAX } else { free };
        // A network has at least what one client may have.
        let networks = client.networks.iter();
        let levels = networks.map(|network| (network, free.max(client.most)));
        let part = client.whole.as_ref().map(|_| (&self.client, most));
        let levels = levels.chain(part);
        let levels = levels.chain([(whole, limit), (&self.all, usize::MAX)]);
        let mut taken: Vec<&Budget> = Vec::new();
        for (budget, limit) in levels {
            if !budget.take(count, limit) {
                taken.iter().for_each(|taken| taken.give_back(count));
                return Err(BudgetFull::All);
            }
            taken.push(budget);
        }
        self.count += count;
        Ok(())
    }

    /// Gives back all above `count`.
    pub fn shrink(&mut self, count: usize) {
        let less = self.count.saturating_sub(count);
        self.count -= less;
        let client = &self.client.0;
        let above = client.networks.iter().chain(&client.whole);
        let budgets = above.chain([&self.client, &self.all]);
        budgets.for_each(|budget| budget.give_back(less));
    }
}

impl Drop for Charge {
    fn drop(&mut self) {
        self.shrink(0);
    }
}

/// Bytes with the charge for their memory. Converted to [`Bytes`], the last clone gives the charge back when it is
/// dropped: that of an upload when the last worker is done with it, that of an answer when the client has received it.
#[derive(Debug)]
pub struct ChargedBytes<B> {
    bytes: B,
    _charge: Arc<Charge>,
}

impl<B: AsRef<[u8]>> ChargedBytes<B> {
    /// Bytes for which `charge` has been reserved. What the charge has above their length is given back at once.
    pub fn new(bytes: B, mut charge: Charge) -> Self {
        charge.shrink(bytes.as_ref().len());
        Self::sharing(bytes, &Arc::new(charge))
    }

    /// Some of several byte strings that are charged together: the charge is given back when all are dropped.
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
    use proptest::prelude::*;

    #[test]
    fn a_charge_grows_until_a_budget_is_used_up_and_gives_all_back() {
        let (all, client) = (Budget::new(4096), Budget::new(3000));
        let mut charge = Charge::new(&all, &client);
        charge.grow(10).unwrap();
        charge.grow(2000).unwrap();
        assert_eq!((all.left(), client.left()), (2086, 990));
        assert_eq!(charge.grow(2000), Err(BudgetFull::Client));
        let other = Budget::new(9000);
        let mut second = Charge::new(&all, &other);
        assert_eq!(second.grow(2087), Err(BudgetFull::All));
        assert_eq!(other.left(), 9000, "nothing was charged");
        second.grow(2086).unwrap();
        second.shrink(1000);
        assert_eq!((all.left(), other.left()), (1086, 8000));
        drop((charge, second));
        assert_eq!((all.left(), client.left()), (4096, 3000));
    }

    #[test]
    fn greedy_clients_leave_half_of_what_is_free_to_the_next() {
        let all = Budget::new(512);
        let greedy = || {
            let client = Budget::new(128);
            let mut charge = Charge::new(&all, &client);
            while charge.grow(1).is_ok() {}
            charge
        };
        let charges: Vec<Charge> = (0..6).map(|_| greedy()).collect();
        let held: Vec<usize> = charges.iter().map(|charge| charge.count).collect();
        assert_eq!(held, [128, 128, 128, 64, 32, 16]);
        drop(charges);
        assert_eq!(all.left(), 512);
    }

    #[test]
    fn the_clients_of_one_network_hold_no_more_than_is_free_together() {
        let (all, network) = (Budget::new(512), Budget::new(usize::MAX));
        let clients: Vec<Budget> = (0..16)
            .map(|_| Budget::of_client(128, vec![network.clone()]))
            .collect();
        let mut charges: Vec<Charge> = Vec::new();
        for client in &clients {
            let mut charge = Charge::new(&all, client);
            while charge.grow(1).is_ok() {}
            charges.push(charge);
        }
        assert!(network.held() <= 256, "{network:?}");
        let mut other = Charge::new(&all, &Budget::new(128));
        assert_eq!(other.grow(128), Ok(()));
    }

    #[test]
    fn a_part_of_a_client_holds_no_more_than_it_leaves() {
        let (all, client) = (Budget::new(512), Budget::new(128));
        let hold_all = |budget: &Budget| {
            let mut charge = Charge::new(&all, budget);
            while charge.grow(1).is_ok() {}
            charge
        };
        let parts: Vec<Charge> = (0..3).map(|_| hold_all(&client.part())).collect();
        let held: Vec<usize> = parts.iter().map(|charge| charge.count).collect();
        assert_eq!(held, [64, 32, 16]);
        assert_eq!((client.held(), all.held()), (112, 112));
        // The client itself has the rest.
        let rest = hold_all(&client);
        assert_eq!(rest.count, 16);
        let mut part = Charge::new(&all, &client.part());
        assert_eq!(part.grow(1), Err(BudgetFull::Client));
        drop((part, rest, parts));
        assert_eq!((client.held(), all.held()), (0, 0));
    }

    proptest! {
        #[test]
        fn no_sequence_of_charges_goes_over_a_budget_or_keeps_anything(
            steps in prop::collection::vec((0..5_usize, 0..3_usize, 0..300_usize), 0..200)
        ) {
            let (all, network) = (Budget::new(1000), Budget::new(usize::MAX));
            let clients: Vec<Budget> = (0..5)
                .map(|_| Budget::of_client(250, vec![network.clone()]))
                .collect();
            let mut charges: Vec<Charge> = clients.iter().map(|client| Charge::new(&all, client)).collect();
            for (who, what, count) in steps {
                match what {
                    0 => drop(charges[who].grow(count)),
                    1 => charges[who].shrink(count),
                    _ => charges[who] = Charge::new(&all, &clients[who]),
                }
                let held: usize = charges.iter().map(|charge| charge.count).sum();
                prop_assert_eq!(all.held(), held);
                prop_assert_eq!(network.held(), held);
                prop_assert!(held <= 1000);
                prop_assert!(clients.iter().all(|client| client.held() <= 250));
            }
            drop(charges);
            prop_assert_eq!(all.held(), 0);
        }
    }

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
