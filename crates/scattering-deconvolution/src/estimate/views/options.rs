use crate::{Error, Result};

/// How many Gaussians the point spread function is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum TermCount {
    /// As many as Schwarz's criterion asks for and the captures determine, from none to this number.
    AtMost(usize),
    /// This number, or an answer that says that the captures do not determine it.
    Exactly(usize),
}

/// Shape of the Gaussians.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum TermShape {
    /// One width.
    #[default]
    Round,
    /// A width along a row and another along a column.
    Elliptic,
}

/// What else may have changed between two frames of a capture; estimated for each capture and frequency by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Nuisance {
    /// The light of the background by a complex factor (amplitude and phase: camera and light source warming up). In a
    /// two-plane capture the phase alone.
    Drift,
    /// A complex constant, the same at all pixels (electronic crosstalk, ambient light).
    Constant,
}

/// How a point spread function is estimated.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct EstimationOptions {
    /// Number of Gaussians. Default: `AtMost(3)`.
    pub terms: TermCount,
    /// Their shape. Default: [`TermShape::Round`].
    pub shape: TermShape,
    /// What else may have changed. Default: [`Nuisance::Drift`] alone.
    pub nuisances: Vec<Nuisance>,
    /// Edge of the square blocks of pixels whose means are observed. Unless given, a 44th of the longer side of the
    /// image, 2 to 8 pixels. Default: `None`.
    pub block_px: Option<usize>,
    /// Pixels about the object that are left out: edges are mixed of object and background. Default: 3 pixels.
    pub rim_px: usize,
    /// A pixel belongs to the object where its light changed by more than this share of the largest change. Default:
    /// 0.1.
    pub object_share: f64,
    /// Observations further from the model than so many standard deviations count with less weight (Huber). `None` is
    /// least squares. Default: 3.
    pub huber_limit: Option<f64>,
    /// A weight is taken for scattering where it is so many times its standard deviation. Default: 4.
    pub significance: f64,
    /// Scatter below this share of the light does not matter. Captures that would not show so much are no proof that
    /// nothing is scattered. Default: 0.005.
    pub relevant_weight: f64,
}

impl Default for EstimationOptions {
    fn default() -> Self {
        Self {
            terms: TermCount::AtMost(3),
            shape: TermShape::Round,
            nuisances: vec![Nuisance::Drift],
            block_px: None,
            rim_px: 3,
            object_share: 0.1,
            huber_limit: Some(3.0),
            significance: 4.0,
            relevant_weight: 0.005,
        }
    }
}

/// More Gaussians than this cannot be told apart by anyone.
const MOST_TERMS: usize = 4;

impl EstimationOptions {
    /// Fails on values without meaning.
    pub fn validate(&self) -> Result<()> {
        let (TermCount::AtMost(terms) | TermCount::Exactly(terms)) = self.terms;
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let checks = [
            ("terms", terms as f64, (1..=MOST_TERMS).contains(&terms), "one to four Gaussians can be estimated"),
            ("block_px", self.block_px.unwrap_or(1) as f64, self.block_px != Some(0), "a block has at least one pixel"),
            ("object_share", self.object_share, self.object_share > 0.0 && self.object_share < 1.0, "between 0 and 1"),
            ("huber_limit", self.huber_limit.unwrap_or(1.0), self.huber_limit.is_none_or(positive), "positive"),
            ("significance", self.significance, positive(self.significance), "positive"),
            ("relevant_weight", self.relevant_weight, positive(self.relevant_weight), "positive"),
        ];
        match checks.into_iter().find(|(_, _, good, _)| !good) {
            Some((name, value, _, expected)) => Err(Error::OutOfDomain { name, value, expected }),
            None => Ok(()),
        }
    }

    pub(in crate::estimate) fn has(&self, nuisance: Nuisance) -> bool {
        self.nuisances.contains(&nuisance)
    }

    pub(in crate::estimate) fn widths_per_term(&self) -> usize {
        match self.shape {
            TermShape::Round => 1,
            TermShape::Elliptic => 2,
        }
    }
}
