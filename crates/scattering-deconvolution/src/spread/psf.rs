use range_image::Modulation;

use crate::{CompositePsf, Error, GhostDelay, Result};

/// One Gaussian of a point spread function, isotropic or elliptic along the image axes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct GaussianTerm {
    /// Share of a pixel's light that this term scatters: the sum of the sampled term over the whole plane.
    pub weight: f64,
    /// Standard deviation along a row and along a column, pixels.
    pub sigma_px: [f64; 2],
}

/// The scattered part of the point spread function: without its central impulse, so that
/// `z_observed = z + psf * z`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Psf {
    /// A sum of Gaussians.
    Gaussians(Vec<GaussianTerm>),
    /// A sampled kernel of odd size, row by row, its centre at the middle element.
    Kernel {
        /// Columns, odd.
        width: usize,
        /// Rows, odd.
        height: usize,
        /// Row-major values.
        values: Vec<f64>,
    },
    /// Gaussians, scattering that changes over the field, and ghosts with a phase of their own.
    Composite(CompositePsf),
}

impl Psf {
    /// Checks what a value read from a file may get wrong: weights that are negative or not finite, widths that are not
    /// positive, kernels of even size or with values that are not finite, polynomials that are negative somewhere in the
    /// image, ghosts that lie nowhere. Kernel values may be negative.
    pub fn validate(&self) -> Result<()> {
        match self {
            Self::Gaussians(terms) => terms.iter().try_for_each(GaussianTerm::validate),
            Self::Kernel { width, height, values } => validate_kernel(*width, *height, values),
            Self::Composite(composite) => composite.validate(),
        }
    }

    /// Share of a pixel's light that is scattered in all: the sum of the point spread function over the whole plane, where
    /// it changes over the field its mean over the image, of ghosts the modulus.
    pub fn total_weight(&self) -> f64 {
        match self {
            Self::Gaussians(terms) => terms.iter().map(|term| term.weight).sum(),
            Self::Kernel { values, .. } => values.iter().sum(),
            Self::Composite(composite) => composite.total_weight(),
        }
    }

    /// Whether nothing is scattered at all.
    pub fn is_empty(&self) -> bool {
        let values_are_zero = |values: &[f64]| values.iter().all(|value| value.abs() <= 0.0);
        match self {
            Self::Gaussians(terms) => terms.iter().all(|term| term.weight.abs() <= 0.0),
            Self::Kernel { values, .. } => values_are_zero(values),
            Self::Composite(composite) => composite.widths().all(|term| term.weight.abs() <= 0.0),
        }
    }

    /// Whether the phase of a ghost depends on the modulation frequency.
    pub fn depends_on_modulation(&self) -> bool {
        let late = |delay| matches!(delay, GhostDelay::ExtraPath(length) if length > 0.0);
        let Self::Composite(composite) = self else { return false };
        composite.ghosts.iter().any(|ghost| ghost.weight > 0.0 && late(ghost.delay))
    }

    /// The same for images of one modulation: extra ways of ghosts become phases.
    #[must_use]
    pub fn at_modulation(&self, modulation: &Modulation) -> Self {
        self.with_delays(|delay| match delay {
            GhostDelay::ExtraPath(length) => GhostDelay::Phase(modulation.phase_from_range(0.5 * length)),
            GhostDelay::Phase(_) => delay,
        })
    }

    /// The same for the mean of the samples: light without modulation is late, but has no phase.
    #[must_use]
    pub fn without_phases(&self) -> Self {
        self.with_delays(|_| GhostDelay::default())
    }

    fn with_delays(&self, change: impl Fn(GhostDelay) -> GhostDelay) -> Self {
        let mut changed = self.clone();
        if let Self::Composite(composite) = &mut changed {
            composite.ghosts.iter_mut().for_each(|ghost| ghost.delay = change(ghost.delay));
        }
        changed
    }
}

impl GaussianTerm {
    pub(crate) fn validate(&self) -> Result<()> {
        if !(self.weight.is_finite() && self.weight >= 0.0) {
            let expected = "the share of light that is scattered is finite and not negative";
            return Err(Error::OutOfDomain { name: "weight", value: self.weight, expected });
        }
        for sigma in self.sigma_px {
            if !(sigma.is_finite() && sigma > 0.0) {
                let expected = "the width of a Gaussian is positive and finite";
                return Err(Error::OutOfDomain { name: "sigma_px", value: sigma, expected });
            }
        }
        Ok(())
    }
}

fn validate_kernel(width: usize, height: usize, values: &[f64]) -> Result<()> {
    for (name, size) in [("kernel width", width), ("kernel height", height)] {
        if size % 2 == 0 {
            let expected = "a kernel has an odd number of columns and rows, so that it has a centre";
            return Err(Error::OutOfDomain { name, value: size as f64, expected });
        }
    }
    if width.checked_mul(height) != Some(values.len()) {
        return Err(Error::KernelLength { width, height, found: values.len() });
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(Error::OutOfDomain { name: "kernel value", value, expected: "kernel values are finite" }),
        None => Ok(()),
    }
}
