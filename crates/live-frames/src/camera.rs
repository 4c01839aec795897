//! What a camera delivers.

use range_image::{DemodulationOptions, Modulation};

use crate::error::{Error, Result};

/// Largest number of frequencies of a frame.
pub(crate) const MOST_FREQUENCIES: usize = 4;

/// A camera and the samples that it delivers: `[F, N, H, W]`, one block of F frequencies with N phase steps each.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveCamera {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Equidistant phase steps of each frequency, 3 or more.
    pub phase_steps: usize,
    /// Modulation frequencies in the order of the samples, one to four.
    pub modulations: Vec<Modulation>,
    /// Sense, offset and scale of the samples, saturation, the amplitude that is low; noise where the calibration states none.
    pub demodulation: DemodulationOptions,
    /// Time stamp of the moment when the camera was switched on, which a drift since then is counted from.
    pub power_on_s: Option<f64>,
}

impl LiveCamera {
    /// Samples of a frame.
    pub fn samples(&self) -> usize {
        let planes = self.modulations.len().saturating_mul(self.phase_steps);
        self.width.saturating_mul(self.height).saturating_mul(planes)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        self.demodulation.validate()?;
        let count = |name, value: usize, least: usize, most: usize, expected| {
            let value = value as f64;
            if (least as f64..=most as f64).contains(&value) {
                Ok(())
            } else {
                Err(Error::OutOfDomain { name, value, expected })
            }
        };
        count("width", self.width, 1, usize::MAX, "at least 1")?;
        count("height", self.height, 1, usize::MAX, "at least 1")?;
        count("phase_steps", self.phase_steps, 3, usize::MAX, "at least 3")?;
        count("number of modulations", self.modulations.len(), 1, MOST_FREQUENCIES, "1 to 4")?;
        match self.power_on_s {
            Some(value) if !value.is_finite() => {
                Err(Error::OutOfDomain { name: "power_on_s", value, expected: "finite" })
            }
            _ => Ok(()),
        }
    }
}

/// When and how a frame was taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Exposure {
    /// Time stamp, second; later than that of the frame before.
    pub timestamp_s: f64,
    /// Integration time, second, which range models are chosen by. `None` will do where the calibration has one.
    pub integration_time_s: Option<f64>,
    /// Temperature of the camera, degree Celsius, where it is known.
    pub temperature_c: Option<f64>,
}

impl From<f64> for Exposure {
    /// A frame of which nothing is known but its time stamp, second.
    fn from(timestamp_s: f64) -> Self {
        Self { timestamp_s, ..Self::default() }
    }
}
