//! Images of light alone, or of colours, of any kind that cameras write: PNG (grey, colour, palette, 1 to 16 bits) and JPEG.

use std::io::{BufReader, Cursor};
use std::path::Path;

use png::{Decoder, Limits, Transformations};
use range_image::Raster;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::text::fault::zeros;
use crate::text::limits::{LARGEST_DEFLATION, MOST_PIXELS};
use crate::{Error, Result};

/// First bytes of a JPEG.
const JPEG: [u8; 3] = [0xff, 0xd8, 0xff];

/// Markers of a JPEG: its scans begin, and it ends. Within the data of a scan neither can occur.
const SCAN: u8 = 0xda;
const END: u8 = 0xd9;

/// Bytes of a JPEG that is read: four for each pixel that an image may have.
const LONGEST_JPEG: u64 = 4 * MOST_PIXELS as u64;

/// Share of red, green and blue in what is seen as light `[BT.601]`.
const LIGHT: [f32; 3] = [0.299, 0.587, 0.114];

/// Reads an image as grey values from 0 to 255, or to 65535 where it has sixteen bits; colours are weighted as the eye
/// does, and transparency is not looked at. Which kind of file it is, its content tells.
///
/// # Errors
/// [`Error::Format`] with what is wrong with the file, [`Error::Io`] where it can't be read.
///
/// ```no_run
/// let image = range_io::grey::read("frames/000.jpg")?;
/// println!("{} x {} pixels", image.width(), image.height());
/// # Ok::<(), range_io::Error>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<Raster<f32>> {
    let path = path.as_ref();
    // Of colours only the light is decoded: it is what a JPEG stores by itself.
    let image = samples(path, ColorSpace::Luma)?;
    raster(path, image.size, image.pixels().map(light).collect())
}

/// Reads red, green and blue of an image, from 0 to 255 whatever its depth; of an image without colours three times the same.
///
/// # Errors
/// As [`read`].
pub fn read_colours(path: impl AsRef<Path>) -> Result<[Raster<f32>; 3]> {
    let path = path.as_ref();
    let image = samples(path, ColorSpace::RGB)?;
    let plane = |colour: usize| {
        let value = |pixel: &[f32]| image.scale * if pixel.len() < 3 { pixel[0] } else { pixel[colour] };
        raster(path, image.size, image.pixels().map(value).collect())
    };
    Ok([plane(0)?, plane(1)?, plane(2)?])
}

/// An image as it is decoded: pixel by pixel grey, grey and alpha, colours, or colours and alpha.
struct Samples {
    size: [usize; 2],
    channels: usize,
    /// What a value is to be multiplied by to end at 255.
    scale: f32,
    values: Vec<f32>,
}

impl Samples {
    fn pixels(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks_exact(self.channels)
    }
}

fn samples(path: &Path, space: ColorSpace) -> Result<Samples> {
    let mut head = [0_u8; 3];
    let (mut file, _) = crate::open(path)?;
    let is_jpeg = std::io::Read::read_exact(&mut file, &mut head).is_ok() && head == JPEG;
    if is_jpeg { read_jpeg(path, space) } else { read_png(path) }
}

fn read_jpeg(path: &Path, space: ColorSpace) -> Result<Samples> {
    let bytes = crate::read_bytes(path, LONGEST_JPEG)?;
    let failed = |error: zune_jpeg::errors::DecodeErrors| Error::format(path, format!("is no complete JPEG: {error}"));
    // Of a file that ends too early nothing is made up: the last scan needs its end, too.
    let after = |bytes: &[u8], marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    if after(&bytes, SCAN).is_none_or(|scan| after(&bytes[scan..], END).is_none()) {
        return Err(Error::format(path, "is no complete JPEG: the end of the image is missing"));
    }
    let options = DecoderOptions::default().set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    decoder.decode_headers().map_err(failed)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    require_size(path, [width, height])?;
    let space = if decoder.input_colorspace() == Some(ColorSpace::Luma) { ColorSpace::Luma } else { space };
    decoder.set_options(options.jpeg_set_out_colorspace(space));
    let values = decoder.decode().map_err(failed)?.into_iter().map(f32::from).collect();
    Ok(Samples { size: [width, height], channels: space.num_components(), scale: 1.0, values })
}

fn read_png(path: &Path) -> Result<Samples> {
    let (file, length) = crate::open(path)?;
    let failed = |error: png::DecodingError| Error::format(path, format!("is no complete PNG or JPEG: {error}"));
    let limits = Limits { bytes: 8 * MOST_PIXELS };
    let mut decoder = Decoder::new_with_limits(BufReader::new(file), limits);
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(failed)?;
    let size = [reader.info().width as usize, reader.info().height as usize];
    let pixels = require_size(path, size)?;
    let (color, depth) = reader.output_color_type();
    let two_bytes = depth == png::BitDepth::Sixteen;
    let bytes = pixels * color.samples() * if two_bytes { 2 } else { 1 };
    if bytes as u64 > length.saturating_mul(LARGEST_DEFLATION) {
        let reason = format!("promises {} x {} pixels, more than its {length} bytes hold", size[0], size[1]);
        return Err(Error::format(path, reason));
    }
    let mut bytes = zeros(bytes).map_err(Error::io(path, "reserve memory for"))?;
    reader.next_frame(&mut bytes).map_err(failed)?;
    let values: Vec<f32> = if two_bytes {
        bytes.as_chunks().0.iter().map(|&pair| f32::from(u16::from_be_bytes(pair))).collect()
    } else {
        bytes.into_iter().map(f32::from).collect()
    };
    Ok(Samples { size, channels: color.samples(), scale: if two_bytes { 1.0 / 257.0 } else { 1.0 }, values })
}

fn light(pixel: &[f32]) -> f32 {
    match pixel {
        [red, green, blue, ..] => LIGHT[0] * red + LIGHT[1] * green + LIGHT[2] * blue,
        _ => pixel[0],
    }
}

fn require_size(path: &Path, [width, height]: [usize; 2]) -> Result<usize> {
    let pixels = width.checked_mul(height).filter(|&pixels| pixels > 0 && pixels <= MOST_PIXELS);
    pixels.ok_or_else(|| {
        Error::format(path, format!("has {width} x {height} pixels, which is none or more than are read"))
    })
}

fn raster(path: &Path, [width, height]: [usize; 2], values: Vec<f32>) -> Result<Raster<f32>> {
    Raster::from_vec(width, height, values).map_err(|error| Error::format(path, error.to_string()))
}
