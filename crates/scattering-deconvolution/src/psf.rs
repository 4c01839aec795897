use crate::{Error, Result};

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
}

impl Psf {
    /// Checks what a value read from a file may get wrong: weights that are negative or not finite, widths that are not
    /// positive, kernels of even size or with values that are not finite. Kernel values may be negative.
    pub fn validate(&self) -> Result<()> {
        match self {
            Self::Gaussians(terms) => terms.iter().try_for_each(GaussianTerm::validate),
            Self::Kernel { width, height, values } => validate_kernel(*width, *height, values),
        }
    }

    /// Share of a pixel's light that is scattered in all: the sum of the point spread function over the whole plane.
    pub fn total_weight(&self) -> f64 {
        match self {
            Self::Gaussians(terms) => terms.iter().map(|term| term.weight).sum(),
            Self::Kernel { values, .. } => values.iter().sum(),
        }
    }

    /// Whether nothing is scattered at all.
    pub fn is_empty(&self) -> bool {
        let values_are_zero = |values: &[f64]| values.iter().all(|value| value.abs() <= 0.0);
        match self {
            Self::Gaussians(terms) => terms.iter().all(|term| term.weight.abs() <= 0.0),
            Self::Kernel { values, .. } => values_are_zero(values),
        }
    }
}

impl GaussianTerm {
    fn validate(&self) -> Result<()> {
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
