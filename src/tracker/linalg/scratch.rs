//! Vectors that are kept from frame to frame so that no frame allocates.

/// Empties `values` and makes room for `count` of them.
pub(crate) fn clear_and_reserve<T>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.reserve(count);
}
