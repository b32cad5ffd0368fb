//! What there is for each target of a session: its first box, its answer.

/// Most targets of a session.
pub const MAX_TARGETS: usize = 16;

/// A value for each target of a session.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum PerTarget<T> {
    /// Of the only target of a session that was opened with a box.
    One(T),
    /// Of the targets of a session that was opened with a list of boxes, in its order: 1 to [`MAX_TARGETS`].
    List(Vec<T>),
}

impl<T> PerTarget<T> {
    /// Of the first target.
    pub fn first(&self) -> &T {
        &self.as_slice()[0]
    }

    /// Of all targets, at least one.
    pub fn as_slice(&self) -> &[T] {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::List(list) => list,
        }
    }

    /// The same, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        match self {
            Self::One(one) => std::slice::from_mut(one),
            Self::List(list) => list,
        }
    }

    /// What `change` makes of each, which gets its target's number too.
    ///
    /// # Errors
    /// The first of those of `change`.
    pub fn try_map<U, E>(
        &self,
        mut change: impl FnMut(usize, &T) -> Result<U, E>,
    ) -> Result<PerTarget<U>, E> {
        Ok(match self {
            Self::One(one) => PerTarget::One(change(0, one)?),
            Self::List(list) => {
                let changed = list.iter().enumerate();
                PerTarget::List(
                    changed
                        .map(|(k, it)| change(k, it))
                        .collect::<Result<_, E>>()?,
                )
            }
        })
    }

    /// What `change` makes of each.
    pub fn map<U>(&self, change: impl Fn(&T) -> U) -> PerTarget<U> {
        match self {
            Self::One(one) => PerTarget::One(change(one)),
            Self::List(list) => PerTarget::List(list.iter().map(change).collect()),
        }
    }
}
