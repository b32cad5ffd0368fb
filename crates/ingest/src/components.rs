//! JPEG with rusty_jpeg: its components as they are stored, reduced by their inverse DCT.

use super::jpeg_markers::Markers;
use super::stored_image::Channel;
use bagtrack_tracker::FrameFormat;
use rusty_jpeg::Decoder;
use rusty_jpeg::decode::{Error, PlanarComponent};
use std::borrow::Cow;

/// Luma and, where it is wanted and there, chroma.
pub(super) type Channels<'memory> = (Channel<'memory>, Option<[Channel<'memory>; 2]>);

/// The reductions that cost less than none, the strongest first. The one to a half is not vectorised.
const REDUCTIONS: [u32; 2] = [8, 4];

/// The channels of a file with one scan, in the smallest size that is not smaller than that of `format`. `memory` is
/// that of an earlier file.
pub(super) fn decode<'memory>(
    file: &[u8],
    markers: &Markers,
    format: FrameFormat,
    memory: &'memory mut Vec<Vec<u8>>,
) -> Result<Channels<'memory>, Error> {
    let mut decoder = Decoder::new(file);
    decoder.set_single_threaded(true);
    // It takes the last one first.
    memory.reverse();
    decoder.recycle_planes(std::mem::take(memory));
    let divisor = markers.reduction(format.size, &REDUCTIONS);
    let reduced = |side: u32| (side / divisor) as u16;
    decoder.scale(reduced(markers.width), reduced(markers.height))?;
    let mut image = decoder.decode_planar()?;
    image.components.iter_mut().for_each(remove_padding);
    let size = |component: &PlanarComponent| (component.width, component.height);
    let sizes: Vec<(usize, usize)> = image.components.iter().map(size).collect();
    *memory = image.into_planes();
    let mut channels = memory
        .iter()
        .zip(sizes)
        .map(|(values, (width, height))| Channel {
            values: Cow::Borrowed(&values[..width * height]),
            size: (width as u32, height as u32),
        });
    let luma = channels.next().expect("a decoded image has a component");
    let chroma = channels.next().zip(channels.next());
    let chroma = chroma.filter(|_| format.has_color);
    Ok((luma, chroma.map(<[_; 2]>::from)))
}

/// Moves the rows together: they are stored in whole blocks.
fn remove_padding(component: &mut PlanarComponent) {
    let (width, stride) = (component.width, component.stride);
    if width < stride {
        for row in 1..component.height {
            let from = row * stride;
            component.data.copy_within(from..from + width, row * width);
        }
    }
}
