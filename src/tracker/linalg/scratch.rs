//! Vectors that are kept from frame to frame so that no frame allocates.

/// Empties `values` and makes room for `count` of them.
pub(crate) fn clear_and_reserve<T>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.reserve(count);
}

/// Makes `values` end with `count` zeros that begin at a cache line: returns where that is. A load that crosses two
/// lines takes as long as two.
pub(crate) fn aligned_zeros(values: &mut Vec<f64>, count: usize) -> usize {
    const LINE: usize = 64;
    const MAX_BEFORE: usize = LINE / size_of::<f64>() - 1;
    clear_and_reserve(values, MAX_BEFORE + count);
    let first = values.as_ptr().align_offset(LINE).min(MAX_BEFORE);
    values.resize(first + count, 0.0);
    first
}
