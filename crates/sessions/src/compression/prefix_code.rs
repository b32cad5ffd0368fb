//! Prefix codes of DEFLATE: Huffman's, with a longest length, in canonical order (RFC 1951, section 3.2.2).

/// Low bits of a leaf, which hold its symbol; the higher bits are the symbol's count.
const SYMBOL_BITS: u32 = 9;
/// The longest code of the format, in bits.
const MAX_LENGTH: usize = 15;
/// A bound of the tree's depth for counts of 32 bits. Counts that grow as Fibonacci's numbers make the deepest tree.
const MAX_DEPTH: usize = 48;

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Code {
    /// The first bit lowest.
    pub bits: u16,
    /// In bits; 0 for a symbol that does not occur.
    pub length: u8,
}

/// The lengths in bits of the codes of symbols that occur `counts` times (each below 2^23). No length is above `limit`;
/// that of a symbol that does not occur is 0.
pub(super) fn lengths<const N: usize>(counts: &[u32; N], limit: usize) -> [u8; N] {
    let occurs = |&(_, &count): &(u32, &u32)| count > 0;
    let mut leaves: Vec<u32> = (0..)
        .zip(counts)
        .filter(occurs)
        .map(|(symbol, count)| count << SYMBOL_BITS | symbol)
        .collect();
    leaves.sort_unstable();
    let mut codes_of = [0; MAX_DEPTH];
    count_depths(&leaves, &mut codes_of);
    limit_lengths(&mut codes_of, limit);
    let symbol_of = |leaf: &u32| (leaf & ((1 << SYMBOL_BITS) - 1)) as usize;
    let mut rarest_first = leaves.iter().map(symbol_of);
    let mut lengths = [0; N];
    for (length, &codes) in (0..=MAX_LENGTH as u8).zip(&codes_of).rev() {
        for symbol in rarest_first.by_ref().take(codes) {
            lengths[symbol] = length;
        }
    }
    lengths
}

/// Counts in `leaves_at` how many leaves Huffman's tree has at each depth. `leaves` are sorted, the rarest first.
fn count_depths(leaves: &[u32], leaves_at: &mut [usize; MAX_DEPTH]) {
    let n = leaves.len();
    if n < 2 {
        // A code of one symbol has one bit nevertheless.
        leaves_at[1] = n;
        return;
    }
    // Leaves and nodes are two queues, each in ascending order: a new node is never smaller than those before it.
    let mut nodes: Vec<u32> = Vec::with_capacity(n);
    let mut parents = vec![0; 2 * n - 1];
    let mut leaf = 0;
    let mut node = 0;
    for made in 0..n - 1 {
        let mut count = 0;
        for _ in 0..2 {
            let weight = leaves.get(leaf).map(|leaf| leaf >> SYMBOL_BITS);
            match (weight, nodes.get(node)) {
                (Some(weight), smallest) if smallest.is_none_or(|&smallest| weight <= smallest) => {
                    count += weight;
                    parents[leaf] = n + made;
                    leaf += 1;
                }
                _ => {
                    count += nodes[node];
                    parents[n + node] = n + made;
                    node += 1;
                }
            }
        }
        nodes.push(count);
    }
    let mut depths = vec![0; 2 * n - 1];
    for child in (0..2 * n - 2).rev() {
        depths[child] = depths[parents[child]] + 1;
    }
    for &depth in &depths[..n] {
        leaves_at[depth] += 1;
    }
}

/// Shortens the codes that are longer than `limit`, and lengthens others until they are a prefix code again.
fn limit_lengths(codes_of: &mut [usize; MAX_DEPTH], limit: usize) {
    codes_of[limit] += codes_of[limit + 1..].iter().sum::<usize>();
    codes_of[limit + 1..].fill(0);
    let room = 1 << limit;
    let taken = |length| codes_of[length] << (limit - length);
    let mut taken: usize = (1..=limit).map(taken).sum();
    while taken > room {
        let shorter = (1..limit).rfind(|&length| codes_of[length] > 0);
        let shorter = shorter.expect("2^limit codes have room, and no alphabet here has more");
        // This code becomes one bit longer, and one of the longest codes becomes its sibling.
        codes_of[shorter] -= 1;
        codes_of[shorter + 1] += 2;
        codes_of[limit] -= 1;
        taken -= 1;
    }
}

/// The canonical code of these lengths.
pub(super) fn codes<const N: usize>(lengths: &[u8; N]) -> [Code; N] {
    let mut next = [0_u16; MAX_LENGTH + 2];
    for &length in lengths.iter().filter(|&&length| length > 0) {
        next[usize::from(length) + 1] += 1;
    }
    let mut first = 0;
    for next in &mut next {
        first = (first + *next) << 1;
        *next = first;
    }
    lengths.map(|length| {
        if length == 0 {
            return Code::default();
        }
        let next = &mut next[usize::from(length)];
        let bits = next.reverse_bits() >> (16 - u32::from(length));
        *next += 1;
        Code { bits, length }
    })
}
