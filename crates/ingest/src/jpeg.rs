//! JPEG, decoded strictly, to the channels that it stores.

use super::error::IngestError;
use super::jpeg_markers::Markers;
use super::limits::{Limits, MAX_JPEG_SCANS};
use super::sniff::Format;
use super::stored_image::{Channel, Scratch, StoredImage, orientation_of, upright_size};
use bagtrack_tracker::FrameFormat;
use bagtrack_tracker::ycbcr::{self, Order};
use image::metadata::Orientation;
use rusty_jpeg::Decoder;
use rusty_jpeg::decode::{Error, PlanarComponent};
use std::borrow::Cow;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

/// A JPEG whose markers were read.
pub(super) struct Jpeg<'file> {
    bytes: &'file [u8],
    markers: Markers,
    orientation: Orientation,
}

impl<'file> Jpeg<'file> {
    pub(super) fn read(bytes: &'file [u8], limits: &Limits) -> Result<Self, IngestError> {
        let damaged = |reason: &str| Format::Jpeg.damaged(reason);
        let markers = Markers::read(bytes).map_err(damaged)?;
        // A file with the height 0 tells its height after the first scan (DNL); no decoder here reads that.
        if markers.width == 0 || markers.height == 0 {
            return Err(damaged("its width or its height is 0"));
        }
        limits.check_size(markers.width, markers.height)?;
        if markers.is_implausibly_small() {
            return Err(damaged("it holds less data than its size needs"));
        }
        let orientation = orientation_of(markers.exif(bytes));
        Ok(Self {
            bytes,
            markers,
            orientation,
        })
    }

    /// Width and height of the upright image.
    pub(super) fn size(&self) -> (u32, u32) {
        let stored = (self.markers.width, self.markers.height);
        upright_size(stored, self.orientation)
    }

    /// Decodes luma and chroma, at full size or reduced to no less than `format`.
    pub(super) fn decode<'scratch>(
        &self,
        limits: &Limits,
        format: FrameFormat,
        scratch: &'scratch mut Scratch,
    ) -> Result<StoredImage<'scratch>, IngestError> {
        let (bytes, markers, orientation) = (self.bytes, &self.markers, self.orientation);
        let source = (markers.width, markers.height);
        // The format before the image is turned upright, as the decoder sees it.
        let format = FrameFormat {
            size: upright_size(format.size, orientation),
            has_color: format.has_color && markers.has_usual_chroma(),
        };
        #[cfg(feature = "turbo")]
        {
            let pixels = &mut scratch.pixels;
            if let Some(planes) = super::turbo::decode(bytes, markers, limits, format, pixels) {
                return Ok(planes.of(&scratch.pixels, source, orientation));
            }
        }
        let (luma, chroma) = decode_channels(bytes, markers, limits, format, scratch)?;
        Ok(StoredImage {
            luma,
            chroma,
            source,
            orientation,
        })
    }
}

/// Luma and chroma, without libjpeg-turbo. zune-jpeg reads the headers of every file, and decodes the files that
/// rusty_jpeg does not take.
fn decode_channels<'scratch>(
    bytes: &[u8],
    markers: &Markers,
    limits: &Limits,
    format: FrameFormat,
    scratch: &'scratch mut Scratch,
) -> Result<Channels<'scratch>, IngestError> {
    let damaged = |reason: &str| Format::Jpeg.damaged(reason);
    let file = &mut scratch.file;
    markers.with_guarded_end(bytes, file);
    let options = DecoderOptions::new_fast()
        .set_strict_mode(true)
        .set_max_width(limits.max_side as usize)
        .set_max_height(limits.max_side as usize)
        .jpeg_set_max_scans(MAX_JPEG_SCANS)
        .jpeg_set_out_colorspace(ColorSpace::Luma);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&file[..]), options);
    decoder.decode_headers().map_err(typed)?;
    let info = decoder.info().expect("the headers were decoded just now");
    if (u32::from(info.width), u32::from(info.height)) != (markers.width, markers.height) {
        return Err(damaged("its headers contradict each other"));
    }
    let stored = decoder.input_colorspace();
    if let Some(reason) = markers.unsupported(stored == Some(ColorSpace::CMYK)) {
        return Err(damaged(reason));
    }
    let output = match stored {
        Some(ColorSpace::Luma) => ColorSpace::Luma,
        Some(ColorSpace::YCbCr) if !format.has_color && markers.can_skip_color() => {
            ColorSpace::Luma
        }
        // RGB and CMYK have no Y channel to take.
        _ => ColorSpace::RGB,
    };
    let per_pixel = output.num_components() as u64 + 2;
    let memory = markers
        .memory(per_pixel)
        .max(markers.memory_of_components());
    limits.check_memory(memory + file.len() as u64)?;
    if markers.is_sequential() && matches!(stored, Some(ColorSpace::Luma | ColorSpace::YCbCr)) {
        // A file that rusty_jpeg does not take may still be one that zune-jpeg takes.
        if let Ok(channels) = decode_components(file, markers, format, &mut scratch.components) {
            return Ok(channels);
        }
    }
    decoder.set_options(options.jpeg_set_out_colorspace(output));
    decode_pixels(
        decoder,
        markers,
        output,
        format.has_color,
        &mut scratch.pixels,
    )
}

/// Decodes to pixels, and returns their channels.
fn decode_pixels<'memory>(
    mut decoder: JpegDecoder<ZCursor<&[u8]>>,
    markers: &Markers,
    output: ColorSpace,
    has_color: bool,
    pixels: &'memory mut Vec<u8>,
) -> Result<Channels<'memory>, IngestError> {
    let bytes = decoder
        .output_buffer_size()
        .ok_or_else(|| Format::Jpeg.damaged("its size is unknown"))?;
    // The decoder may leave pixels of a damaged file unwritten. They must not show the frame before.
    pixels.clear();
    pixels.resize(bytes, 0);
    decoder.decode_into(pixels).map_err(typed)?;
    let size = (markers.width, markers.height);
    let channel = |values, size| Channel { values, size };
    if output == ColorSpace::Luma {
        return Ok((channel(Cow::Borrowed(&pixels[..]), size), None));
    }
    let (luma, chroma) = ycbcr::planes(pixels.as_chunks::<3>().0, size, Order::Rgb);
    let half = ycbcr::chroma_size(size);
    let chroma = has_color.then(|| chroma.map(|plane| channel(Cow::Owned(plane), half)));
    Ok((channel(Cow::Owned(luma), size), chroma))
}

fn typed(error: DecodeErrors) -> IngestError {
    // Most of the decoder's messages come in quotes.
    Format::Jpeg.damaged(error.to_string().trim_matches('"'))
}

/// Luma and, where it is wanted and there, chroma.
type Channels<'memory> = (Channel<'memory>, Option<[Channel<'memory>; 2]>);

/// The reductions that cost less than decoding at full size, the strongest first. The one to a half is missing, since
/// rusty_jpeg does not vectorise it.
const REDUCTIONS: [u32; 2] = [8, 4];

/// The channels of a file with one scan, with rusty_jpeg: its components as they are stored, reduced by their inverse
/// DCT, in the smallest size that is not smaller than that of `format`. `memory` is that of an earlier file.
fn decode_components<'memory>(
    file: &[u8],
    markers: &Markers,
    format: FrameFormat,
    memory: &'memory mut Vec<Vec<u8>>,
) -> Result<Channels<'memory>, Error> {
    let mut decoder = Decoder::new(file);
    decoder.set_single_threaded(true);
    // The decoder takes the last buffer first.
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
