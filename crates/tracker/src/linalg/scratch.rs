//! Vectors that are kept from frame to frame so that no frame allocates.

/// Empties `values` and makes room for `count` of them.
pub(crate) fn clear_and_reserve<T>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.reserve(count);
}

/// A buffer of single-precision values that begins at a cache line, as the vector loads of a product should: a step
/// of `robust` is a tenth faster.
#[derive(Debug, Default)]
pub(crate) struct AlignedBuffer {
    values: Vec<f32>,
    first: usize,
    len: usize,
}

impl AlignedBuffer {
    /// Makes the buffer `len` values long. They hold anything.
    pub fn resize(&mut self, len: usize) {
        const LINE: usize = 64;
        const MAX_BEFORE: usize = LINE / size_of::<f32>() - 1;
        if self.values.len() < MAX_BEFORE + len {
            self.values.resize(MAX_BEFORE + len, 0.0);
        }
        self.first = self.values.as_ptr().align_offset(LINE).min(MAX_BEFORE);
        self.len = len;
    }

    /// The values.
    #[inline(always)]
    pub fn values(&self) -> &[f32] {
        &self.values[self.first..][..self.len]
    }

    /// The values, to be written.
    #[inline(always)]
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values[self.first..][..self.len]
    }
}
