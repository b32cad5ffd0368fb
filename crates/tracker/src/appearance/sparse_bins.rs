//! A histogram as a snapshot has it: most colours are never seen, so each bin that is not empty comes with the number
//! of empty ones before it. Bins have 8 significant bits, so the upper half of an `f32` holds a bin.

use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};

/// Writes the number of bins, then the pairs.
pub(crate) fn serialize<S: Serializer>(bins: &[f32], serializer: S) -> Result<S::Ok, S::Error> {
    let mut empty = 0_u16;
    let mut pairs = Vec::new();
    for &bin in bins {
        if bin == 0.0 {
            empty += 1;
        } else {
            pairs.push((empty, (bin.to_bits() >> 16) as u16));
            empty = 0;
        }
    }
    (bins.len() as u16, pairs).serialize(serializer)
}

/// Reads what [`serialize`] writes.
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(source: D) -> Result<Vec<f32>, D::Error> {
    let (count, pairs) = <(u16, Vec<(u16, u16)>)>::deserialize(source)?;
    let mut bins = vec![0.0; usize::from(count)];
    let mut next = 0;
    for (empty, value) in pairs {
        let index = next + usize::from(empty);
        let bin = bins.get_mut(index);
        let bin = bin.ok_or_else(|| D::Error::custom("a bin after the last"))?;
        *bin = f32::from_bits(u32::from(value) << 16);
        next = index + 1;
    }
    Ok(bins)
}
