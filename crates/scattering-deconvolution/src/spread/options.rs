use crate::{Error, Result};

/// Where scattered light is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum GridSpacing {
    /// As wide as the narrowest Gaussian allows, at most 8 pixels: scattered light is smooth. Sampled kernels are taken
    /// at every pixel.
    #[default]
    Automatic,
    /// At every pixel.
    EveryPixel,
}

/// Whether the inverse filter is all that is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Refinement {
    /// Iterations follow until the residual is below the tolerance.
    #[default]
    ToTolerance,
    /// None: one convolution, the residual of which is not measured. What light that was lost over the border leaves
    /// wrong is of second order in the share of scattered light, and nothing tells how much it is. For point spread
    /// functions that are the same for all pixels.
    FilterOnly,
}

/// What the light of saturated pixels counts for while scattered light is computed. They keep their own value either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum SaturatedLight {
    /// The clipped value: less than there was, so that some of what it scattered stays in the image.
    #[default]
    Clipped,
    /// The mean of the nearest values to the left and to the right, as for pixels without a value: for sensors whose
    /// saturated pixels have phases and amplitudes without meaning.
    Filled,
}

/// How scattering is undone.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct RestorationOptions {
    /// Weight `lambda` of the wish that the image stays as it was observed: `|F z - y|^2 + lambda |z - y|^2` becomes
    /// smallest, with `F = 1 + H`. Zero, the default, is the plain inverse.
    pub regularisation: f64,
    /// Largest residual `|y - (z + psf * z)|` allowed, relative to the largest real or imaginary part of `y`. Not asked
    /// for with a regularisation. Default: 1e-5.
    pub tolerance: f64,
    /// Iterations after which an image that has not come below the tolerance is refused. Default: 30.
    pub max_iterations: usize,
    /// Where scattered light is computed. Default: [`GridSpacing::Automatic`].
    pub grid_spacing: GridSpacing,
    /// Whether the inverse filter is all that is done. Default: [`Refinement::ToTolerance`].
    pub refinement: Refinement,
    /// What the light of saturated pixels counts for. Default: [`SaturatedLight::Clipped`].
    pub saturated_light: SaturatedLight,
    /// Share of a restored pixel's amplitude beyond which light scattered from pixels of unknown light (saturated,
    /// without a value) makes it one of [`Restorer::dependent_pixels`](crate::Restorer::dependent_pixels). Were the
    /// unknown light wrong by its own amount, the phase would be wrong by as many radians. Infinite: not looked for.
    /// Default: 0.1.
    pub dependence_limit: f64,
}

impl Default for RestorationOptions {
    fn default() -> Self {
        Self {
            regularisation: 0.0,
            tolerance: 1e-5,
            max_iterations: 30,
            grid_spacing: GridSpacing::Automatic,
            refinement: Refinement::ToTolerance,
            saturated_light: SaturatedLight::Clipped,
            dependence_limit: 0.1,
        }
    }
}

impl RestorationOptions {
    /// Fails on values without meaning.
    pub fn validate(&self) -> Result<()> {
        if !(self.regularisation.is_finite() && self.regularisation >= 0.0) {
            let expected = "a regularisation is finite and not negative";
            return Err(Error::OutOfDomain { name: "regularisation", value: self.regularisation, expected });
        }
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            let expected = "a tolerance is finite and positive";
            return Err(Error::OutOfDomain { name: "tolerance", value: self.tolerance, expected });
        }
        if self.dependence_limit.is_nan() || self.dependence_limit <= 0.0 {
            let expected = "a limit of dependence is positive";
            return Err(Error::OutOfDomain { name: "dependence_limit", value: self.dependence_limit, expected });
        }
        Ok(())
    }
}
