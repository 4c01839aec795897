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
