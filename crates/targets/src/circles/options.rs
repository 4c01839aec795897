use crate::{Error, error::Result};

/// Which discs are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polarity {
    /// Brighter than their ground.
    Bright,
    /// Darker than their ground.
    Dark,
    /// Both.
    #[default]
    Either,
}

/// How discs are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleOptions {
    /// Bright discs, dark ones or both. Default: [`Polarity::Either`].
    pub polarity: Polarity,
    /// Smallest semi-minor axis, pixel. Default: 1.2. Below 1 a disc cannot be told from a speck of noise.
    pub smallest_semi_axis_px: f64,
    /// Largest semi-major axis, pixel. Default: infinite, discs of any size.
    pub largest_semi_axis_px: f64,
    /// Largest ratio of the semi-axes: 1 over the cosine of the tilt. Default: 4, which is 75°.
    pub largest_axis_ratio: f64,
    /// Smallest contrast in standard deviations of the image's noise. Default: 5.
    pub smallest_contrast_sigmas: f64,
    /// Largest misfit of the model beside the noise, in parts of the contrast: what is no disc (a square, a letter) has more,
    /// a picture that a camera sharpened up to 0.1. Default: 0.15.
    pub largest_misfit: f64,
    /// Value from which on a pixel is saturated, unit of the image. Default: infinite, none is.
    pub saturation: f64,
    /// Standard deviation of a pixel's noise, unit of the image. Default: `None`, estimated from the image.
    pub noise: Option<f64>,
}

impl Default for CircleOptions {
    fn default() -> Self {
        Self {
            polarity: Polarity::Either,
            smallest_semi_axis_px: 1.2,
            largest_semi_axis_px: f64::INFINITY,
            largest_axis_ratio: 4.0,
            smallest_contrast_sigmas: 5.0,
            largest_misfit: 0.15,
            saturation: f64::INFINITY,
            noise: None,
        }
    }
}

impl CircleOptions {
    /// Refuses what cannot be met.
    pub fn validate(&self) -> Result<()> {
        let limits = [
            ("smallest_semi_axis_px", self.smallest_semi_axis_px, 0.0),
            ("largest_semi_axis_px", self.largest_semi_axis_px, 0.0),
            ("largest_axis_ratio", self.largest_axis_ratio, 1.0),
            ("smallest_contrast_sigmas", self.smallest_contrast_sigmas, 0.0),
            ("largest_misfit", self.largest_misfit, 0.0),
        ];
        for (name, value, least) in limits {
            if value.is_nan() || value < least {
                let expected = if least > 0.0 { "a number of at least 1" } else { "a number that is not negative" };
                return Err(Error::Invalid { name, value, expected });
            }
        }
        if self.saturation.is_nan() {
            return Err(Error::Invalid {
                name: "saturation",
                value: self.saturation,
                expected: "a value, or infinite",
            });
        }
        if let Some(value) = self.noise.filter(|noise| !(noise.is_finite() && *noise > 0.0)) {
            let expected = "a standard deviation is positive and finite";
            return Err(Error::Invalid { name: "noise", value, expected });
        }
        Ok(())
    }
}
