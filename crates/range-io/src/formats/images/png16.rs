//! Images of one channel with 16 bits in PNG: depth, infrared, amplitude.

use std::io::BufReader;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Encoder, Limits};
use range_image::Raster;

use crate::text::fault::zeros;
use crate::text::limits::{LARGEST_DEFLATION, MOST_PIXELS};
use crate::{Error, Result};
use atomic_output::FileWriter;

/// Reads a PNG of one channel with 16 bits; 8 bits, colour, palettes and alpha are refused.
pub fn read(path: impl AsRef<Path>) -> Result<Raster<u16>> {
    let path = path.as_ref();
    let (file, length) = crate::open(path)?;
    let failed = |error: png::DecodingError| Error::format(path, format!("is no complete PNG: {error}"));
    let limits = Limits { bytes: 4 * MOST_PIXELS };
    let mut reader = Decoder::new_with_limits(BufReader::new(file), limits).read_info().map_err(failed)?;
    let (color, depth) = reader.output_color_type();
    if (color, depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let found = format!("is a PNG of {color:?} with {depth:?} bits, expected one channel with sixteen");
        return Err(Error::format(path, found));
    }
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let pixels = width.checked_mul(height).filter(|&pixels| pixels <= MOST_PIXELS);
    let pixels =
        pixels.ok_or_else(|| Error::format(path, format!("has {width} x {height} pixels, more than are read")))?;
    if (2 * pixels) as u64 > length.saturating_mul(LARGEST_DEFLATION) {
        let reason = format!("promises {width} x {height} pixels, more than its {length} bytes hold");
        return Err(Error::format(path, reason));
    }
    let mut bytes = zeros(2 * pixels).map_err(Error::io(path, "reserve memory for"))?;
    reader.next_frame(&mut bytes).map_err(failed)?;
    let values = bytes.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
    Raster::from_vec(width, height, values).map_err(|error| Error::format(path, error.to_string()))
}

/// Writes a PNG of one channel with 16 bits.
pub fn write(path: impl AsRef<Path>, image: &Raster<u16>) -> Result<()> {
    let path = path.as_ref();
    let (Ok(width), Ok(height)) = (u32::try_from(image.width()), u32::try_from(image.height())) else {
        return Err(Error::format(path, format!("cannot hold {} x {} pixels", image.width(), image.height())));
    };
    let failed = |error: png::EncodingError| match error {
        png::EncodingError::IoError(source) => Error::io(path, "write")(source),
        error => Error::format(path, format!("cannot be written: {error}")),
    };
    let mut file = FileWriter::create(path)?;
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Sixteen);
    let mut writer = encoder.write_header().map_err(failed)?;
    let bytes: Vec<u8> = image.as_slice().iter().flat_map(|value| value.to_be_bytes()).collect();
    writer.write_image_data(&bytes).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file.commit()?)
}
