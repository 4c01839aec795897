use crate::{Error, Result};

/// Size of the image and of its pixels; the bridge between pixel positions and image coordinates.
///
/// Pixel positions `(col, row)` are 0-based with integers at pixel centres. Image coordinates are in
/// millimetre, origin at the format's centre, x to the right, y **up**.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ImageFormat {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Distance of neighbouring pixel centres along a row and along a column, millimetre.
    pub pixel_pitch_mm: [f64; 2],
}

impl ImageFormat {
    /// A format of `width` x `height` pixels; refuses an empty image and a pitch that is not positive.
    pub fn new(width: usize, height: usize, pixel_pitch_mm: [f64; 2]) -> Result<Self> {
        let format = Self { width, height, pixel_pitch_mm };
        format.validate()?;
        Ok(format)
    }

    /// Checks what a value read from a file may get wrong.
    pub fn validate(&self) -> Result<()> {
        for (name, size) in [("width", self.width), ("height", self.height)] {
            if size == 0 {
                return Err(Error::OutOfDomain { name, value: 0.0, expected: "an image has at least one pixel" });
            }
        }
        for pitch in self.pixel_pitch_mm {
            if !(pitch.is_finite() && pitch > 0.0) {
                return Err(Error::OutOfDomain {
                    name: "pixel_pitch_mm",
                    value: pitch,
                    expected: "a pixel pitch is positive and finite",
                });
            }
        }
        Ok(())
    }

    /// Image coordinates in millimetre of a pixel position: `x = (col - (W-1)/2) pitch_x`, `y = ((H-1)/2 - row) pitch_y`.
    pub fn image_from_pixel(&self, [col, row]: [f64; 2]) -> [f64; 2] {
        [
            (col - (self.width as f64 - 1.0) / 2.0) * self.pixel_pitch_mm[0],
            ((self.height as f64 - 1.0) / 2.0 - row) * self.pixel_pitch_mm[1],
        ]
    }

    /// Pixel position of image coordinates in millimetre; the inverse of [`Self::image_from_pixel`].
    pub fn pixel_from_image(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            x / self.pixel_pitch_mm[0] + (self.width as f64 - 1.0) / 2.0,
            (self.height as f64 - 1.0) / 2.0 - y / self.pixel_pitch_mm[1],
        ]
    }
}
