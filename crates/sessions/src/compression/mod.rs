//! The compression of stored sessions and snapshots: DEFLATE with Huffman codes alone.
//!
//! A state is quantised numbers, in which few runs of bytes come twice. So matches are not searched for, which saves
//! time: zlib-rs would write the same format in six times the time. `fdeflate`, the decompressor of the PNG reader,
//! reads it.

mod deflate;
mod prefix_code;

use super::targets::MAX_LIST_BYTES;
use fdeflate::Decompressor;

/// `fdeflate` wants a header of zlib before the bytes and a checksum after them. Stored states have neither, since each
/// tracker's snapshot has a checksum. The decompressor ignores the value of this one.
const ZLIB_HEADER: [u8; 2] = [0x78, 0x01];
const ZLIB_CHECKSUM: [u8; 4] = [0; 4];
/// A Huffman code has at least one bit, so a compressed byte becomes at most 8 bytes.
const MAX_RATIO: usize = 8;
/// Most bytes of a state. A list of targets is bounded to half of this, and the ranges of the parameters keep one
/// target below it.
const MAX_BYTES: usize = 2 * MAX_LIST_BYTES;
const LENGTH_BYTES: usize = 4;

/// Appends the length of `content` (32 bits, little-endian) and its compressed bytes to `out`.
///
/// # Panics
/// If `content` has 4 GiB or more.
pub(super) fn compress(content: &[u8], out: &mut Vec<u8>) {
    let length = u32::try_from(content.len()).expect("sessions are bounded far below 4 GiB");
    out.extend(length.to_le_bytes());
    deflate::deflate(content, out);
}

/// The content that [`compress`] was given. `None` if `bytes` are not its output, or the content is longer than any
/// session's.
pub(super) fn decompress(bytes: &[u8]) -> Option<Vec<u8>> {
    let (length, compressed) = bytes.split_first_chunk::<LENGTH_BYTES>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    if length > MAX_BYTES.min(MAX_RATIO * compressed.len()) {
        return None;
    }
    let zlib = [&ZLIB_HEADER, compressed, &ZLIB_CHECKSUM].concat();
    let mut content = vec![0; length];
    let mut decompressor = Decompressor::new();
    decompressor.ignore_adler32();
    let taken = decompressor.read(&zlib, &mut content, 0, true).ok()?;
    (decompressor.is_done() && taken == (zlib.len(), length)).then_some(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_content_comes_back_and_none_takes_more_than_its_share_of_memory() {
        let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8;
        for content in [
            vec![],
            vec![0; 100_000],
            (0..100_000).map(noise).collect(),
            (0..9_999).map(|i| noise(i) & 3).collect(),
            // This is stored as it is: its codes would take more bits than they save.
            (0..600).map(|i| noise(i) & 63).collect(),
            // The counts of the bytes grow as Fibonacci's numbers, so their Huffman code is longer than the format
            // allows.
            (0..20_u8)
                .flat_map(|i| vec![i; 1.618_f64.powi(i.into()) as usize])
                .collect(),
            vec![9; 8192],
            vec![1, 2, 3],
        ] {
            let mut bytes = vec![7];
            compress(&content, &mut bytes);
            assert_eq!(bytes[0], 7);
            assert!(bytes.len() <= content.len() + content.len() / 1_000 + 64);
            assert_eq!(decompress(&bytes[1..]), Some(content));
            assert_eq!(decompress(&bytes[1..bytes.len() - 1]), None);
            let mut longer = bytes[1..].to_vec();
            longer[0] ^= 1;
            assert_eq!(decompress(&longer), None);
        }
        let compressed = |content: &[u8]| {
            let mut bytes = Vec::new();
            compress(content, &mut bytes);
            bytes.len()
        };
        // Of four values three have 2 bits, one has 3: the end of the block needs a code, too. All chunks share one
        // code.
        let of_four = [0, 85, 170, 255].repeat(4096);
        let (least, header) = (16384 * 9 / 4 / 8, 40);
        assert!(compressed(&of_four) < least + header);
        // Chunks with other bytes get a code of their own.
        let then_noise: Vec<u8> = of_four.into_iter().chain((0..16384).map(noise)).collect();
        assert!(compressed(&then_noise) < least + header + 16384 + 10);
        // A gigabyte of zeros, as DEFLATE writes it at best, is refused before it is there.
        let forged = [&(1_u32 << 30).to_le_bytes()[..], &[0; 1 << 20]].concat();
        assert_eq!(decompress(&forged), None);
        let mut large = Vec::new();
        compress(&vec![0; MAX_BYTES + 1], &mut large);
        assert_eq!(decompress(&large), None);
    }
}
