//! Buffers that are used again: a run makes some hundred tensors of a few hundred kilobytes, and fresh memory for each
//! would cost as much as a layer.

/// The most buffers that are kept: a network has fewer tensors at once.
const MAX_FREE: usize = 16;

/// Free buffers.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    free: Vec<Vec<f32>>,
}

impl Memory {
    /// `len` numbers, all of them `value`.
    pub fn filled(&mut self, len: usize, value: f32) -> Vec<f32> {
        // The smallest buffer that is large enough, else the largest.
        let fits = |buffer: &Vec<f32>| buffer.capacity() >= len;
        let free = self.free.iter().enumerate();
        let best = free.min_by_key(|(_, buffer)| match fits(buffer) {
            true => (false, buffer.capacity()),
            false => (true, usize::MAX - buffer.capacity()),
        });
        let mut buffer = match best.map(|(index, _)| index) {
            Some(index) => self.free.swap_remove(index),
            None => Vec::new(),
        };
        buffer.clear();
        buffer.resize(len, value);
        buffer
    }

    /// Takes `buffer` back. Of too many buffers the smallest is freed: a large one costs most to make.
    pub fn give_back(&mut self, buffer: Vec<f32>) {
        self.free.push(buffer);
        if self.free.len() > MAX_FREE {
            let sizes = self.free.iter().map(Vec::capacity).enumerate();
            let smallest = sizes.min_by_key(|(_, capacity)| *capacity);
            self.free
                .swap_remove(smallest.map_or(0, |(index, _)| index));
        }
    }
}
