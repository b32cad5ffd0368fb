//! The chunk structure of PNG and WebP, read before decoding: whether the file is whole. The decoders would not notice
//! a missing end, or would allocate as many bytes as a chunk claims.

const CUT_SHORT: &str = "it is cut short";

/// Walks the chunks of a PNG up to `IEND`.
pub(super) fn check_png_whole(bytes: &[u8]) -> Result<(), &'static str> {
    let mut at = 8;
    loop {
        let header: &[u8; 8] = bytes
            .get(at..)
            .and_then(<[u8]>::first_chunk)
            .ok_or(CUT_SHORT)?;
        let [l3, l2, l1, l0, kind @ ..] = *header;
        let length = u32::from_be_bytes([l3, l2, l1, l0]) as usize;
        // 8 bytes of header before the data, 4 of checksum after it.
        at = at.checked_add(length + 12).ok_or(CUT_SHORT)?;
        if at > bytes.len() {
            return Err(CUT_SHORT);
        }
        if &kind == b"IEND" {
            return Ok(());
        }
    }
}

/// Walks the chunks of a WebP up to the length that its RIFF header notes.
pub(super) fn check_webp_whole(bytes: &[u8]) -> Result<(), &'static str> {
    let length = |at: usize| -> Option<usize> {
        let field: &[u8; 4] = bytes.get(at..)?.first_chunk()?;
        usize::try_from(u32::from_le_bytes(*field)).ok()
    };
    let end = length(4)
        .and_then(|riff| riff.checked_add(8))
        .ok_or(CUT_SHORT)?;
    if end > bytes.len() {
        return Err(CUT_SHORT);
    }
    let mut at = 12;
    while at < end {
        let data = length(at + 4).ok_or(CUT_SHORT)?;
        let data_end = at.checked_add(8 + data).ok_or(CUT_SHORT)?;
        if data_end > end {
            return Err(CUT_SHORT);
        }
        at = data_end + data % 2;
    }
    Ok(())
}
