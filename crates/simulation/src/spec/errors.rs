use error_models::{FixedPattern, InterpolatedModel, ModelSet, RangeErrorModel, WarmUp};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::NoiseModel;
use scattering_deconvolution::Psf;
use serde::{Deserialize, Serialize};

use super::check::{not_negative, positive, require};
use crate::{Error, Result};

/// Everything that keeps the samples from showing the scene as it is; what is left out does not happen.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ErrorsSpec {
    /// Systematic range errors (Eqs. 14, 15), one model a modulation frequency.
    pub range: Option<Vec<RangeErrorModel>>,
    /// The same by integration time (Sect. 4.6), interpolated between; instead of `range`.
    pub range_by_integration_time: Option<ModelSet>,
    /// Drift of the warming camera by time since power-on and temperature (Sect. 4.7).
    pub warm_up: Option<WarmUp>,
    /// A range offset of each pixel's own (Sect. 4.5).
    pub fixed_pattern: Option<FixedPatternSpec>,
    /// Light that is scattered between lens and sensor (Sect. 4.4).
    pub scattering: Option<Psf>,
    /// Shot and dark noise of a sample, in scaled sample units.
    pub noise: Option<NoiseModel>,
    /// Integer samples and their highest value. Left out: exact samples, f32.
    pub digitisation: Option<DigitisationSpec>,
    /// Pixels that see several distances. Left out: one ray through each pixel's centre.
    pub mixed_pixels: Option<MixedPixelsSpec>,
    /// Light that arrives by way of another surface (Sect. 4.9).
    pub multipath: Option<MultipathSpec>,
    /// Pixels that show anything.
    pub gross_errors: Option<GrossErrorsSpec>,
}

/// Pixels whose light has a phase that nothing in the scene explains, as behind glass and glints: the same in all
/// frames of a station, others at each station. The truth stays what the scene is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrossErrorsSpec {
    /// Part of the pixels.
    pub share: f64,
    /// Seed of their places and phases.
    #[serde(default)]
    pub seed: u64,
}

/// A normally distributed range offset for each pixel, the same in all frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedPatternSpec {
    /// Standard deviation over the pixels.
    pub sigma_m: f64,
    /// Seed of the pattern: it belongs to the camera, not to a run of the simulation.
    pub seed: u64,
}

/// How samples become numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DigitisationSpec {
    /// Type of a stored sample.
    pub sample_type: SampleType,
    /// Sample units that one raw unit stands for: the `raw_scale` of demodulation.
    #[serde(default = "one")]
    pub raw_scale: f64,
    /// Highest raw value; light beyond it is lost. Left out with `U16`: 65 535.
    #[serde(default)]
    pub saturation: Option<f64>,
}

/// Type of a stored sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SampleType {
    /// Not rounded.
    F32,
    /// Rounded to whole counts, zero and above.
    U16,
}

/// Rays spread evenly over each pixel's area; their light is added as complex numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MixedPixelsSpec {
    /// Rays along each side of a pixel: 4 means 16 rays.
    pub rays_per_pixel_side: usize,
    /// A pixel is called mixed in the truth where a ray's range leaves the surface seen at the pixel's centre by more.
    #[serde(default = "five_centimetres")]
    pub threshold_m: f64,
}

/// One diffuse bounce: surfaces that the camera's source lights, light the point that a ray hits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultipathSpec {
    /// Directions over the hemisphere of each point hit.
    pub directions: usize,
    /// Seed of the set of directions, which is one for all points.
    #[serde(default)]
    pub seed: u64,
}

fn one() -> f64 {
    1.0
}

fn five_centimetres() -> f64 {
    0.05
}

impl DigitisationSpec {
    /// The highest raw value that can be stored, if there is one.
    pub fn highest(&self) -> Option<f64> {
        match self.sample_type {
            SampleType::U16 => Some(self.saturation.unwrap_or(f64::from(u16::MAX))),
            SampleType::F32 => self.saturation,
        }
    }
}

impl FixedPatternSpec {
    /// The offsets of all pixels, row by row.
    pub(crate) fn pattern(&self, width: usize, height: usize) -> FixedPattern {
        let mut generator = Pcg64::seed_from_u64(self.seed);
        let offset = |_| {
            let unit: f64 = StandardNormal.sample(&mut generator);
            (unit * self.sigma_m) as f32
        };
        FixedPattern { width, height, offset_m: (0..width * height).map(offset).collect(), sigma_m: Vec::new() }
    }
}

impl ErrorsSpec {
    pub(crate) fn validate(&self, ambiguity_intervals_m: &[f64]) -> Result<()> {
        if let Some(models) = &self.range {
            validate_models("errors.range", models, ambiguity_intervals_m)?;
        }
        if let Some(set) = &self.range_by_integration_time {
            let field = "errors.range_by_integration_time";
            require(self.range.is_none(), field, &set.entries.len(), "only where there is no errors.range")?;
            set.validate()?;
            for (index, (_, models)) in set.entries.iter().enumerate() {
                validate_models(&format!("{field}.entries[{index}]"), models, ambiguity_intervals_m)?;
            }
        }
        if let Some(drift) = &self.warm_up {
            drift.validate()?;
        }
        if let Some(pattern) = &self.fixed_pattern {
            not_negative("errors.fixed_pattern.sigma_m", pattern.sigma_m)?;
        }
        if let Some(psf) = &self.scattering {
            psf.validate()?;
        }
        if let Some(noise) = &self.noise {
            noise.validate()?;
        }
        self.validate_sensor()?;
        self.validate_light()
    }

    /// The range errors at an integration time, one model a frequency; none where there are none.
    pub(crate) fn range_at(&self, integration_time_s: f64) -> Result<Vec<InterpolatedModel>> {
        match (&self.range, &self.range_by_integration_time) {
            (Some(models), _) => Ok(models.iter().cloned().map(InterpolatedModel::from).collect()),
            (None, Some(set)) => Ok(set.at(integration_time_s)?),
            (None, None) => Ok(Vec::new()),
        }
    }

    fn validate_sensor(&self) -> Result<()> {
        let Some(digitisation) = &self.digitisation else { return Ok(()) };
        positive("errors.digitisation.raw_scale", digitisation.raw_scale)?;
        if let Some(value) = digitisation.saturation {
            positive("errors.digitisation.saturation", value)?;
            let fits = digitisation.sample_type == SampleType::F32 || value <= f64::from(u16::MAX);
            require(fits, "errors.digitisation.saturation", &value, "at most 65535 with U16")?;
        }
        Ok(())
    }

    fn validate_light(&self) -> Result<()> {
        if let Some(mixed) = &self.mixed_pixels {
            let n = mixed.rays_per_pixel_side;
            require((1..=32).contains(&n), "errors.mixed_pixels.rays_per_pixel_side", &n, "from 1 to 32 rays")?;
            positive("errors.mixed_pixels.threshold_m", mixed.threshold_m)?;
        }
        if let Some(multipath) = &self.multipath {
            let n = multipath.directions;
            require((1..=65_536).contains(&n), "errors.multipath.directions", &n, "from 1 to 65536 directions")?;
        }
        if let Some(gross) = &self.gross_errors {
            let share = gross.share;
            require((0.0..=1.0).contains(&share), "errors.gross_errors.share", &share, "a part from 0 to 1")?;
        }
        Ok(())
    }
}

/// One model a frequency, each with the ambiguity interval of its frequency.
fn validate_models(path: &str, models: &[RangeErrorModel], ambiguity_intervals_m: &[f64]) -> Result<()> {
    let complete = models.len() == ambiguity_intervals_m.len();
    require(complete, path, &models.len(), "one model for each of camera.modulation_hz")?;
    for (index, (model, interval)) in models.iter().zip(ambiguity_intervals_m).enumerate() {
        model.validate()?;
        // A speed of light rounded to 3e8 already differs by 7e-4; digits of a written interval by less than 1e-6.
        if (model.ambiguity_interval_m - interval).abs() > 1e-6 * interval {
            return Err(Error::Field {
                field: format!("{path}[{index}].ambiguity_interval_m"),
                value: format!("{} (that of the frequency is {interval})", model.ambiguity_interval_m),
                expected: "the ambiguity interval of the modulation frequency",
            });
        }
    }
    Ok(())
}
