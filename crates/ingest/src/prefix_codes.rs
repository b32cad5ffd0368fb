//! Bits and prefix codes of lossless WebP (RFC 9649, section 3.7), as far as they must be read to know how much memory
//! they take.

/// Longest code in bits.
const MAX_LENGTH: usize = 15;
/// The order in which the lengths of the codes for code lengths are stored.
const ORDER: [usize; 19] = [
    17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15,
];
/// Codes up to this length in bits have entries in the decoder's table; longer ones have nodes.
const TABLE_BITS: usize = 10;
/// Bytes of an entry of the decoder's table, and bytes of nodes for each code that is not in the table.
const ENTRY: u64 = 4;
const NODES: u64 = 4 * 16;

/// Bits, the lowest of each byte first.
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bits<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// The next bit; `None` at the end.
    pub(super) fn bit(&mut self) -> Option<usize> {
        let byte = *self.bytes.get(self.at / 8)?;
        let bit = byte >> (self.at % 8) & 1;
        self.at += 1;
        Some(usize::from(bit))
    }

    /// The next number of `count` bits.
    pub(super) fn number(&mut self, count: usize) -> Option<usize> {
        (0..count).try_fold(0, |number, place| Some(number | self.bit()? << place))
    }
}

pub(super) struct Code {
    /// How many codes have each length in bits; all 0 where there is a single symbol, which takes no bit.
    counts: [u16; MAX_LENGTH + 1],
    /// The symbols in the order of their codes.
    symbols: Vec<u16>,
}

impl Code {
    /// Reads the code of an alphabet of `alphabet` symbols; `None` where the bits are no complete code.
    pub(super) fn read(bits: &mut Bits, alphabet: usize) -> Option<Self> {
        if bits.bit()? == 1 {
            let has_two = bits.bit()? == 1;
            let width = if bits.bit()? == 1 { 8 } else { 1 };
            let mut symbols = vec![bits.number(width)? as u16];
            let mut counts = [0; MAX_LENGTH + 1];
            if has_two {
                symbols.push(bits.number(8)? as u16);
                counts[1] = 2;
            }
            return Some(Self { counts, symbols });
        }
        let mut lengths = [0; ORDER.len()];
        let stored = 4 + bits.number(4)?;
        for &symbol in ORDER.get(..stored)? {
            lengths[symbol] = bits.number(3)?;
        }
        let code = Self::of_lengths(&lengths)?;
        let lengths = code.read_lengths(bits, alphabet)?;
        Self::of_lengths(&lengths)
    }

    /// The lengths of an alphabet's codes, which are written in this code.
    fn read_lengths(&self, bits: &mut Bits, alphabet: usize) -> Option<Vec<usize>> {
        let mut left = alphabet;
        if bits.bit()? == 1 {
            let width = 2 + 2 * bits.number(3)?;
            left = 2 + bits.number(width)?;
        }
        let (mut lengths, mut before) = (Vec::with_capacity(alphabet), 8);
        while lengths.len() < alphabet && left > 0 {
            left -= 1;
            let (length, times) = match self.symbol(bits)? {
                16 => (before, 3 + bits.number(2)?),
                17 => (0, 3 + bits.number(3)?),
                18 => (0, 11 + bits.number(7)?),
                length => (usize::from(length), 1),
            };
            if length != 0 {
                before = length;
            }
            lengths.resize(lengths.len() + times, length);
        }
        (lengths.len() <= alphabet).then_some(lengths)
    }

    fn of_lengths(lengths: &[usize]) -> Option<Self> {
        let used = lengths
            .iter()
            .zip(0u16..)
            .filter(|(length, _)| **length > 0);
        let mut used: Vec<(usize, u16)> = used.map(|(length, symbol)| (*length, symbol)).collect();
        used.sort_unstable();
        let mut counts = [0u16; MAX_LENGTH + 1];
        used.iter().for_each(|(length, _)| counts[*length] += 1);
        let symbols: Vec<u16> = used.into_iter().map(|(_, symbol)| symbol).collect();
        match symbols.len() {
            0 => return None,
            1 => counts = [0; MAX_LENGTH + 1],
            _ => {
                // The code must be complete: every sequence of bits starts with a code.
                let share = |length: usize| usize::from(counts[length]) << (MAX_LENGTH - length);
                let used: usize = (1..=MAX_LENGTH).map(share).sum();
                if used != 1 << MAX_LENGTH {
                    return None;
                }
            }
        }
        Some(Self { counts, symbols })
    }

    pub(super) fn symbol(&self, bits: &mut Bits) -> Option<u16> {
        if let [symbol] = self.symbols[..] {
            return Some(symbol);
        }
        let (mut code, mut first, mut index) = (0, 0, 0);
        for &count in &self.counts[1..] {
            let count = usize::from(count);
            code |= bits.bit()?;
            if code < first + count {
                return self.symbols.get(index + code - first).copied();
            }
            index += count;
            first = (first + count) << 1;
            code <<= 1;
        }
        None
    }

    /// Most bytes that the decoder allocates for this code.
    pub(super) fn memory(&self) -> u64 {
        let longest = self.counts.iter().rposition(|&count| count > 0);
        let entries = longest.map_or(0, |longest| 1 << longest.min(TABLE_BITS));
        let longer: u16 = self.counts[TABLE_BITS + 1..].iter().sum();
        ENTRY * entries + NODES * u64::from(longer)
    }
}
