//! Colour images in JPEG.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{CompressedImage, Encoding, Image, ImageParts};
use crate::Error;
use crate::error::Result;
use crate::limits::MOST_PIXELS;

impl CompressedImage {
    /// The pixels of a JPEG, as `rgb8` (feature `jpeg`).
    ///
    /// # Errors
    /// [`Error::Value`] where the data are no JPEG or are cut off.
    pub fn decode_jpeg(&self) -> Result<Image> {
        let fault = |reason: String| Error::value("JPEG", reason);
        // A side of 16384 pixels at most: what a hostile header can make of it is bounded by the check below.
        let options = DecoderOptions::default()
            .set_strict_mode(true)
            .set_max_width(1 << 14)
            .set_max_height(1 << 14)
            .jpeg_set_out_colorspace(ColorSpace::RGB);
        let mut decoder = JpegDecoder::new_with_options(Cursor::new(self.data.as_slice()), options);
        decoder.decode_headers().map_err(|error| fault(error.to_string()))?;
        let (width, height) = decoder.dimensions().ok_or_else(|| fault("has no size".to_owned()))?;
        if (width as u64) * (height as u64) > MOST_PIXELS {
            return Err(fault(format!("has {width} x {height} pixels, expected at most {MOST_PIXELS} in all")));
        }
        let data = decoder.decode().map_err(|error| fault(error.to_string()))?;
        let (width, height) = (width as u32, height as u32);
        Image::new(ImageParts {
            frame_id: self.frame_id.clone(),
            width,
            height,
            step: 3 * width,
            encoding: Encoding::Rgb8,
            big_endian: false,
            data,
        })
    }
}
