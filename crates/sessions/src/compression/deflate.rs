//! Writes DEFLATE (RFC 1951) with Huffman codes alone.

use super::prefix_code::{self, Code};

/// Bytes of a chunk. A block is one or more neighbouring chunks with similar counts of bytes.
const CHUNK: usize = 4096;
/// A block that is stored as it is has fewer than 2^16 bytes.
const MAX_BLOCK: usize = 15 * CHUNK;
/// A block of its own must save this many bits. Its codes take 600 to 800 bits. The rest weighs the time that they
/// take: with half of this value a state has 1.4 % fewer bytes, and takes a seventh longer to write.
const MIN_SAVED_BITS: f32 = 3000.0;
const END_OF_BLOCK: usize = 256;
/// The bytes and the end of a block. The format's other symbols are for matches.
const SYMBOLS: usize = END_OF_BLOCK + 1;
/// Longest code of a byte. The format allows 15 bits; with 14, [`BitWriter`] takes four codes at once.
const MAX_BITS: usize = 14;

/// Symbols of the code of lengths.
const LENGTH_SYMBOLS: usize = 19;
const MAX_LENGTH_BITS: usize = 7;
/// Most bits of a block's header: its fixed fields, the lengths of the code of lengths, and 258 lengths of at most
/// [`MAX_LENGTH_BITS`].
const MAX_HEADER_BITS: usize = 3 + 14 + 3 * LENGTH_SYMBOLS + (SYMBOLS + 1) * MAX_LENGTH_BITS;
/// The order in which the lengths of the code of lengths are written (RFC 1951, section 3.2.7).
const ORDER: [usize; LENGTH_SYMBOLS] = [
    16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15,
];

/// Appends `content` to `out`, compressed.
pub(super) fn deflate(content: &[u8], out: &mut Vec<u8>) {
    out.reserve(content.len());
    let mut bits = BitWriter::new(out);
    let mut chunks = content.chunks(CHUNK);
    let mut block = Block::of(chunks.next().unwrap_or_default());
    let mut rest = content;
    for chunk in chunks {
        let next = Block::of(chunk);
        let joined = block.joined(&next);
        let saved = joined.entropy - block.entropy - next.entropy;
        if saved < MIN_SAVED_BITS && joined.len <= MAX_BLOCK {
            block = joined;
        } else {
            let bytes;
            (bytes, rest) = rest.split_at(block.len);
            block.write(bytes, false, &mut bits);
            block = next;
        }
    }
    block.write(rest, true, &mut bits);
    bits.align();
}

/// Bytes that share a code.
struct Block {
    counts: [u32; END_OF_BLOCK],
    len: usize,
    /// The entropy of the bytes as independent draws, in bits for the whole block.
    entropy: f32,
}

impl Block {
    fn of(bytes: &[u8]) -> Self {
        // In four tables, so that equal bytes in a row do not wait for each other.
        let mut tables = [[0_u32; END_OF_BLOCK]; 4];
        let (fours, rest) = bytes.as_chunks::<4>();
        for four in fours {
            for (table, &byte) in tables.iter_mut().zip(four) {
                table[usize::from(byte)] += 1;
            }
        }
        for &byte in rest {
            tables[0][usize::from(byte)] += 1;
        }
        let count = |byte| tables.iter().map(|table| table[byte]).sum();
        Self::counted(std::array::from_fn(count), bytes.len())
    }

    fn joined(&self, next: &Self) -> Self {
        let count = |byte| self.counts[byte] + next.counts[byte];
        Self::counted(std::array::from_fn(count), self.len + next.len)
    }

    fn counted(counts: [u32; END_OF_BLOCK], len: usize) -> Self {
        // Several sums, so that the compiler vectorises the loop.
        let mut sums = [0.0; 16];
        for counts in counts.as_chunks::<16>().0 {
            for (sum, &count) in sums.iter_mut().zip(counts) {
                *sum += times_log2(count);
            }
        }
        Self {
            counts,
            len,
            entropy: times_log2(len as u32) - sums.iter().sum::<f32>(),
        }
    }

    /// Writes the block with codes of its own, or stored as it is where these might make it longer.
    fn write(&self, bytes: &[u8], is_last: bool, bits: &mut BitWriter<'_>) {
        let mut counts = [1; SYMBOLS];
        counts[..END_OF_BLOCK].copy_from_slice(&self.counts);
        let lengths = prefix_code::lengths(&counts, MAX_BITS);
        if size(&counts, &lengths) + MAX_HEADER_BITS > 8 * bytes.len() {
            return bits.write_stored(bytes, is_last);
        }
        bits.write(u16::from(is_last) | 0b10 << 1, 3);
        write_lengths(&lengths, bits);
        let codes = prefix_code::codes(&lengths);
        let (fours, rest) = bytes.as_chunks::<4>();
        for four in fours {
            for &byte in four {
                bits.push(codes[usize::from(byte)]);
            }
            bits.flush();
        }
        for &byte in rest {
            bits.push(codes[usize::from(byte)]);
            bits.flush();
        }
        bits.push(codes[END_OF_BLOCK]);
        bits.flush();
    }
}

/// n log₂ n, to 0.01 n.
#[inline(always)]
fn times_log2(n: u32) -> f32 {
    let n = n.max(1) as f32;
    let exponent = (n.to_bits() >> 23) as i32 - 127;
    // log₂ of the mantissa, in [1, 2), as a parabola that is exact at both ends.
    let mantissa = f32::from_bits(n.to_bits() & 0x7F_FFFF | 0x3F80_0000);
    n * (exponent as f32 + (2.0 - mantissa / 3.0) * mantissa - 5.0 / 3.0)
}

/// The bits that the symbols take with codes of these lengths.
fn size(counts: &[u32; SYMBOLS], lengths: &[u8; SYMBOLS]) -> usize {
    let size_of = |(&count, &length): (&u32, &u8)| count as usize * usize::from(length);
    counts.iter().zip(lengths).map(size_of).sum()
}

/// Writes the lengths of the codes, in a code of lengths and of runs of them.
fn write_lengths(lengths: &[u8; SYMBOLS], bits: &mut BitWriter<'_>) {
    let runs = runs(lengths);
    let mut counts = [0; LENGTH_SYMBOLS];
    for run in &runs {
        counts[usize::from(run.symbol)] += 1;
    }
    let own_lengths = prefix_code::lengths(&counts, MAX_LENGTH_BITS);
    let last = ORDER.iter().rposition(|&symbol| own_lengths[symbol] > 0);
    let written = &ORDER[..=last.expect("there are lengths").max(3)];
    // HLIT and HDIST are 0 (257 literals, one distance); HCLEN is the number of written lengths less 4.
    bits.write((written.len() as u16 - 4) << 10, 14);
    for &symbol in written {
        bits.write(own_lengths[symbol].into(), 3);
    }
    let codes = prefix_code::codes(&own_lengths);
    for Run {
        symbol,
        rest,
        bits_of_rest,
    } in runs
    {
        bits.push(codes[usize::from(symbol)]);
        bits.write(rest, bits_of_rest);
    }
}

/// A symbol of the code of lengths: one length, or a run of equal lengths. A run has `rest` more of them than the
/// shortest run of its symbol.
struct Run {
    symbol: u8,
    rest: u16,
    bits_of_rest: u32,
}

/// The lengths of the symbols as runs, with that of one distance that does not occur.
fn runs(lengths: &[u8; SYMBOLS]) -> Vec<Run> {
    let once = |symbol| Run {
        symbol,
        rest: 0,
        bits_of_rest: 0,
    };
    let mut runs = Vec::with_capacity(SYMBOLS + 1);
    let mut with_distance = [0; SYMBOLS + 1];
    with_distance[..SYMBOLS].copy_from_slice(lengths);
    for equal in with_distance.chunk_by(PartialEq::eq) {
        let length = equal[0];
        let mut left = equal.len();
        if length > 0 {
            runs.push(once(length));
            left -= 1;
        }
        while left >= 3 {
            let (symbol, shortest, longest, bits_of_rest) = match length {
                0 if left > 10 => (18, 11, 138, 7),
                0 => (17, 3, 10, 3),
                _ => (16, 3, 6, 2),
            };
            let taken = left.min(longest);
            let rest = (taken - shortest) as u16;
            runs.push(Run {
                symbol,
                rest,
                bits_of_rest,
            });
            left -= taken;
        }
        runs.extend((0..left).map(|_| once(length)));
    }
    runs
}

/// Writes bits to bytes: the first bit is a byte's lowest.
struct BitWriter<'a> {
    bytes: &'a mut Vec<u8>,
    bits: u64,
    count: u32,
}

impl<'a> BitWriter<'a> {
    fn new(bytes: &'a mut Vec<u8>) -> Self {
        Self {
            bytes,
            bits: 0,
            count: 0,
        }
    }

    /// Adds a code: at most four of [`MAX_BITS`] between two calls of [`flush`](Self::flush).
    #[inline(always)]
    fn push(&mut self, code: Code) {
        self.bits |= u64::from(code.bits) << self.count;
        self.count += u32::from(code.length);
    }

    /// Appends the whole bytes to the output; at most seven bits are kept.
    #[inline(always)]
    fn flush(&mut self) {
        let whole = self.count / 8;
        let end = self.bytes.len() + whole as usize;
        self.bytes.extend_from_slice(&self.bits.to_le_bytes());
        self.bytes.truncate(end);
        self.bits >>= 8 * whole;
        self.count %= 8;
    }

    fn write(&mut self, bits: u16, count: u32) {
        self.bits |= u64::from(bits) << self.count;
        self.count += count;
        self.flush();
    }

    /// Fills the last byte up with zeros.
    fn align(&mut self) {
        self.count = self.count.next_multiple_of(8);
        self.flush();
    }

    /// Writes a block without compression.
    fn write_stored(&mut self, block: &[u8], is_last: bool) {
        self.write(is_last.into(), 3);
        self.align();
        let length = block.len() as u16;
        self.bytes.extend(length.to_le_bytes());
        self.bytes.extend((!length).to_le_bytes());
        self.bytes.extend(block);
    }
}
