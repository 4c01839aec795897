use range_image::Modulation;

use crate::{Error, FieldPolynomial, GaussianTerm, Result};

/// A point spread function of several kinds of light: the same everywhere, changing over the field, and ghosts.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct CompositePsf {
    /// Light that is spread alike from all pixels.
    pub stationary: Vec<GaussianTerm>,
    /// Light whose share depends on where it comes from and where it arrives.
    pub field_terms: Vec<FieldTerm>,
    /// Images of the image, reflected between lens and sensor.
    pub ghosts: Vec<Ghost>,
}

/// Scattering that changes over the field: `received · (g * (sent · z))`. Terms add up to a sum of low rank.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FieldTerm {
    /// The kernel `g`.
    pub gaussian: GaussianTerm,
    /// Factor at the pixel where the light arrives.
    #[cfg_attr(feature = "serde", serde(default))]
    pub received: FieldPolynomial,
    /// Factor at the pixel where the light belongs.
    #[cfg_attr(feature = "serde", serde(default))]
    pub sent: FieldPolynomial,
}

/// A second, weaker and blurred image that light makes which went to and fro between lens and sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Ghost {
    /// Share of a pixel's light that goes into the ghost.
    pub weight: f64,
    /// Where it arrives.
    pub place: GhostPlace,
    /// Standard deviation of its blur along a row and along a column, pixels.
    pub sigma_px: [f64; 2],
    /// By how much it is late.
    #[cfg_attr(feature = "serde", serde(default))]
    pub delay: GhostDelay,
}

/// Where the light of a pixel arrives in a ghost. Pixels count `(col, row)`, rows downwards.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GhostPlace {
    /// Moved by so many pixels along a row and along a column: `p = q + offset`.
    Shifted([f64; 2]),
    /// Mirrored about a point `(col, row)`, such as the principal point: `p = 2 centre - q`.
    Mirrored([f64; 2]),
}

/// Phase that a ghost's light has gained on its longer way.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GhostDelay {
    /// Extra way of the light in metres, gone once. It turns the phase by `2π f L n / c`, which looks like a range longer
    /// by `L / 2`; so one number serves all modulation frequencies.
    ExtraPath(f64),
    /// Phase in radians, at whatever frequency the image has.
    Phase(f64),
}

impl Default for GhostDelay {
    /// None.
    fn default() -> Self {
        Self::Phase(0.0)
    }
}

impl GhostDelay {
    /// The phase in radians; for an extra path only with a modulation.
    pub fn phase(&self, modulation: Option<&Modulation>) -> Result<f64> {
        match (*self, modulation) {
            (Self::Phase(phase), _) => Ok(phase),
            (Self::ExtraPath(length), Some(modulation)) => Ok(modulation.phase_from_range(0.5 * length)),
            (Self::ExtraPath(length), None) if length <= 0.0 => Ok(0.0),
            (Self::ExtraPath(extra_path_m), None) => Err(Error::ModulationNeeded { extra_path_m }),
        }
    }

    fn validate(self) -> Result<()> {
        match self {
            Self::ExtraPath(value) if !(value.is_finite() && value >= 0.0) => {
                let expected = "the extra way of a ghost's light is finite and not negative";
                Err(Error::OutOfDomain { name: "ExtraPath", value, expected })
            }
            Self::Phase(value) if !value.is_finite() => {
                Err(Error::OutOfDomain { name: "Phase", value, expected: "the phase of a ghost is finite" })
            }
            _ => Ok(()),
        }
    }
}

impl CompositePsf {
    pub(crate) fn validate(&self) -> Result<()> {
        self.stationary.iter().try_for_each(GaussianTerm::validate)?;
        for term in &self.field_terms {
            term.gaussian.validate()?;
            term.received.validate("received")?;
            term.sent.validate("sent")?;
        }
        self.ghosts.iter().try_for_each(Ghost::validate)
    }

    /// Whether all pixels scatter alike, and without a delay.
    pub(crate) fn is_sum_of_gaussians(&self) -> bool {
        self.field_terms.is_empty() && self.ghosts.is_empty()
    }

    pub(crate) fn total_weight(&self) -> f64 {
        let stationary = self.stationary.iter().map(|term| term.weight);
        let ghosts = self.ghosts.iter().map(|ghost| ghost.weight);
        stationary.chain(self.field_terms.iter().map(FieldTerm::mean_weight)).chain(ghosts).sum()
    }

    /// The light that is not in ghosts, averaged over the field.
    pub(crate) fn mean_terms(&self) -> impl Iterator<Item = GaussianTerm> {
        let mean = |term: &FieldTerm| GaussianTerm { weight: term.mean_weight(), ..term.gaussian };
        self.stationary.iter().copied().chain(self.field_terms.iter().map(mean))
    }

    /// Gaussians of all kinds, by their weights and widths.
    pub(crate) fn widths(&self) -> impl Iterator<Item = GaussianTerm> {
        let ghosts = self.ghosts.iter().map(|ghost| GaussianTerm { weight: ghost.weight, sigma_px: ghost.sigma_px });
        let field_terms = self.field_terms.iter().map(|term| term.gaussian);
        self.stationary.iter().copied().chain(field_terms).chain(ghosts)
    }
}

impl FieldTerm {
    /// The share of light scattered, averaged over the image, for a kernel that is narrow compared with it.
    fn mean_weight(&self) -> f64 {
        self.gaussian.weight * crate::spread::field::mean(|place| self.received.value(place) * self.sent.value(place))
    }
}

impl Ghost {
    fn validate(&self) -> Result<()> {
        GaussianTerm { weight: self.weight, sigma_px: self.sigma_px }.validate()?;
        self.delay.validate()?;
        let (GhostPlace::Shifted(place) | GhostPlace::Mirrored(place)) = self.place;
        match place.into_iter().find(|value| !value.is_finite()) {
            Some(value) => Err(Error::OutOfDomain { name: "place", value, expected: "the place of a ghost is finite" }),
            None => Ok(()),
        }
    }
}
