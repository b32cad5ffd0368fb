//! Image files: an accepted image has the size in its header, and keeps the limits.
#![no_main]

use bagtrack_ingest::{decode_to, inspect, recycle, Limits};
use bagtrack_tracker::FrameFormat;
use libfuzzer_sys::fuzz_target;
use std::cell::Cell;
use std::sync::Once;

static HOOK: Once = Once::new();

fuzz_target!(|data: &[u8]| {
    // Replaces libFuzzer's hook, which aborts at every panic: those of decoders are caught, and the file is refused.
    HOOK.call_once(|| std::panic::set_hook(Box::new(|panic| eprintln!("{panic}"))));
    let limits = Limits {
        max_side: 1024,
        max_pixels: 1 << 18,
        max_memory: 16 << 20,
        ..Limits::default()
    };
    let stored = Cell::new((0, 0));
    let format = |source: (u32, u32)| {
        assert!(source.0 > 0 && source.1 > 0, "it has no pixels");
        stored.set(source);
        FrameFormat {
            size: (source.0.div_ceil(2), source.1.div_ceil(2)),
            has_color: true,
        }
    };
    if let Ok(frame) = decode_to(data, &limits, &format) {
        let (width, height) = stored.get();
        assert_eq!(
            inspect(data, &limits).map(|file| file.size()),
            Ok((width, height)),
            "the header says otherwise"
        );
        assert!(frame.width() <= width && frame.height() <= height);
        assert!(u64::from(width) * u64::from(height) <= limits.max_pixels);
        recycle(frame);
    }
});
