//! Forged snapshots, as a client that knows the format can write them.

use bagtrack_sessions::{MAC_BYTES, MacKeys, SNAPSHOT_KEY_CONTEXT, SNAPSHOT_MAGIC};
use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use std::io::{Read, Write};

const LENGTH_BYTES: usize = 4;

/// Splits a snapshot into magic and version, and the compressed content with its length before it.
fn parts(snapshot: &[u8]) -> (&[u8], &[u8]) {
    let (head, rest) = snapshot.split_at(SNAPSHOT_MAGIC.len() + 1);
    (head, &rest[..rest.len() - MAC_BYTES])
}

/// What a snapshot holds, uncompressed.
pub(crate) fn content(snapshot: &[u8]) -> Vec<u8> {
    let (length, compressed) = parts(snapshot)
        .1
        .split_first_chunk::<LENGTH_BYTES>()
        .unwrap();
    let mut content = Vec::new();
    DeflateDecoder::new(compressed)
        .read_to_end(&mut content)
        .unwrap();
    assert_eq!(content.len(), u32::from_le_bytes(*length) as usize);
    content
}

/// A snapshot with this content, stored without compression, and with the code of unsigned snapshots.
pub(crate) fn with_content(snapshot: &[u8], content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::none());
    encoder.write_all(content).unwrap();
    with_compressed(snapshot, content.len() as u32, &encoder.finish().unwrap())
}

/// A snapshot with this compressed content, which claims that the uncompressed one has `length` bytes.
pub(crate) fn with_compressed(snapshot: &[u8], length: u32, compressed: &[u8]) -> Vec<u8> {
    let mut bytes = [parts(snapshot).0, &length.to_le_bytes(), compressed].concat();
    let keys = MacKeys::new(SNAPSHOT_KEY_CONTEXT, &[""; 0]).accepting_unsigned(false);
    let code = keys.sign(&bytes);
    bytes.extend(code);
    bytes
}
