//! Memory that a thread keeps from one frame to the next.

/// Bytes of a buffer that a thread keeps: enough for the luma of a frame of 4096 x 4096.
const MAX_KEPT_BYTES: usize = 16 << 20;

/// The memory of a frame's luma, Cb and Cr.
pub(super) type Planes = [Vec<u8>; 3];

/// Buffers that a thread fills again for each frame.
#[derive(Default)]
pub(super) struct Scratch {
    /// The file as the decoder gets it.
    pub(super) file: Vec<u8>,
    /// Decoded values. Those behind the values of this frame are left from an earlier one.
    pub(super) pixels: Vec<u8>,
    /// Decoded components, likewise.
    pub(super) components: Vec<Vec<u8>>,
    /// Memory for the planes of a frame; empty while a frame has it.
    pub(super) planes: Planes,
}

impl Scratch {
    /// Frees what an unusually large frame took.
    pub(super) fn trim(&mut self) {
        let components = self.components.iter_mut();
        for buffer in components.chain([&mut self.file, &mut self.pixels]) {
            if buffer.capacity() > MAX_KEPT_BYTES {
                *buffer = Vec::new();
            }
        }
    }
}
