use crate::{Error, Result};

/// How noise is estimated from repeated frames, and what is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFitOptions {
    /// Most classes of light or amplitude that variances are averaged over. Default: 64.
    pub bins: usize,
    /// Largest share of values whose scatter no noise explains (motion, gross errors); they are left out. Default: 0.2.
    pub largest_moved_share: f64,
    /// How much more one frame may scatter than the others of its station before the frames count as unlike; more where chance
    /// alone lets the values that are taken of a frame, few in long captures, scatter by more. Default: 1.25.
    pub largest_frame_factor: f64,
    /// Largest share of the variance that a drift may leave in successive differences. Default: 0.02.
    pub largest_drift_share: f64,
    /// Largest root mean square of the relative differences between variances observed and modelled. Default: 0.25.
    pub largest_misfit: f64,
}

impl Default for NoiseFitOptions {
    /// 64 classes; a fifth of the values moved; a quarter more scatter in one frame; 2 % of drift; 25 % of misfit.
    fn default() -> Self {
        Self {
            bins: 64,
            largest_moved_share: 0.2,
            largest_frame_factor: 1.25,
            largest_drift_share: 0.02,
            largest_misfit: 0.25,
        }
    }
}

impl NoiseFitOptions {
    /// Refuses fewer than three classes and limits that are not positive numbers.
    pub(crate) fn validate(&self) -> Result<()> {
        let named = [
            ("bins", self.bins as f64 - 2.0),
            ("largest_moved_share", self.largest_moved_share),
            ("largest_frame_factor", self.largest_frame_factor - 1.0),
            ("largest_drift_share", self.largest_drift_share),
            ("largest_misfit", self.largest_misfit),
        ];
        for (name, value) in named {
            if !(value.is_finite() && value > 0.0) {
                let expected = "a positive limit, a factor above one, and at least three bins";
                return Err(Error::OutOfDomain { name, value, expected });
            }
        }
        Ok(())
    }
}

/// What the stored numbers of samples mean, as for demodulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleUnits {
    /// Sample units that one stored unit stands for.
    pub raw_scale: f64,
    /// Stored value from which on a sample is saturated; such samples are left out.
    pub saturation: Option<f64>,
}

impl Default for SampleUnits {
    fn default() -> Self {
        Self { raw_scale: 1.0, saturation: None }
    }
}
