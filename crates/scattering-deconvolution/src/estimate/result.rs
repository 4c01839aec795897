//! What an estimation answers.

use std::fmt;

use nalgebra::DMatrix;

use crate::Psf;

/// What the captures do not tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ambiguity {
    /// No capture shows light of an object that rises above the noise.
    NoObjectLight,
    /// The light of the objects is not known: too many of their pixels are saturated or without data.
    ObjectLightLost,
    /// Hardly any background is left beside the objects.
    NoBackground,
    /// Scatter of the share that matters would not show above the noise.
    SignalBelowNoise,
    /// A weight or a width is not significant, or known by less than a factor of two: the Gaussians asked for cannot be
    /// told apart.
    TermsIndistinguishable,
    /// A Gaussian is so wide that the image shows a constant: only weight over width squared is known.
    WidthBeyondImage,
    /// No Gaussians with positive weights fit, or the adjustment finds no end.
    NoFit,
}

/// Whether the captures tell the point spread function.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// All parameters are significant and determined.
    Determined,
    /// The captures would have shown scatter that matters, and there is none.
    NothingToCorrect,
    /// They do not tell.
    Undetermined {
        /// What is not known.
        what: Ambiguity,
        /// What would help.
        advice: &'static str,
    },
}

/// A parameter of the point spread function.
#[derive(Debug, Clone, PartialEq)]
pub struct PsfParameter {
    /// For example `weight 1` or `sigma_px 2`.
    pub name: String,
    /// Share of the light, or pixels.
    pub value: f64,
    /// Standard deviation, scaled as [`PsfEstimate::covariance`]; zero where the value was held.
    pub sigma: f64,
}

/// A number and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Estimated {
    /// The number.
    pub value: f64,
    /// Its standard deviation, prior-scaled or, where residuals are larger than noise says, posterior-scaled; zero where it
    /// was held.
    pub sigma: f64,
}

/// Estimated change between the two frames of a capture that is no scattering.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NuisanceValues {
    /// Relative change of the background's light: amplitude, and phase in radians.
    pub drift: Option<[Estimated; 2]>,
    /// Constant light, real and imaginary part.
    pub constant: Option<[Estimated; 2]>,
}

/// How one frequency of one capture took part.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureReport {
    /// Number of the capture, as given.
    pub capture: usize,
    /// Number of the frequency.
    pub channel: usize,
    /// Pixels whose light is scattered: object, shadow and rim; the whole image of two planes.
    pub source_pixels: usize,
    /// Block means that were observed in the end.
    pub blocks: usize,
    /// Blocks that were given up because their light changed by more than scattering.
    pub rejected_blocks: usize,
    /// Root mean square of the observed block means: what scattering and nuisances did.
    pub rms_before: f64,
    /// Root mean square of what the model leaves.
    pub rms_after: f64,
    /// The same when the parameters come from the other captures alone; where there are several.
    pub rms_held_out: Option<f64>,
    /// What changed besides.
    pub nuisances: NuisanceValues,
    /// Why it took no part.
    pub unused: Option<Ambiguity>,
}

/// A number of Gaussians that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Number of Gaussians.
    pub terms: usize,
    /// Schwarz's criterion; the smallest is best. NaN where the adjustment gave no answer.
    pub bic: f64,
    /// Posterior standard deviation of unit weight.
    pub sigma0: f64,
    /// Why it was not taken, however good its criterion.
    pub refused: Option<Ambiguity>,
}

/// A point spread function and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct PsfEstimate {
    /// The point spread function, without terms where there is nothing to correct. `None` where the captures do not tell;
    /// with [`Ambiguity::WidthBeyondImage`] a reduced one, whose widest width was held at the longer side of the image: it
    /// restores images of this size as well as any other.
    pub psf: Option<Psf>,
    /// Whether it may be trusted.
    pub verdict: Verdict,
    /// Weights and widths, Gaussian by Gaussian, the narrowest first.
    pub parameters: Vec<PsfParameter>,
    /// Covariance matrix of the parameters: prior-scaled, times the square of `sigma0` where that is above one.
    pub covariance: DMatrix<f64>,
    /// Posterior standard deviation of unit weight: 1 where residuals are as large as noise says. NaN without an
    /// adjustment.
    pub sigma0: f64,
    /// Observed numbers less unknowns.
    pub redundancy: i64,
    /// Share of the observed blocks that were rejected or have less than half of their weight.
    pub outlier_share: f64,
    /// Smallest weight of a single Gaussian that would have been found, whatever its width, from that of rim and block
    /// (what is narrower is hidden) to 0.6 of the image. Infinite where nothing would have been.
    pub detection_limit: f64,
    /// Numbers of Gaussians that were tried.
    pub candidates: Vec<Candidate>,
    /// Each frequency of each capture.
    pub captures: Vec<CaptureReport>,
}

impl PsfEstimate {
    /// Correlations of the parameters; zero beside held ones.
    pub fn correlation(&self) -> DMatrix<f64> {
        let sigma: Vec<f64> = self.covariance.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect();
        let value = |i: usize, j: usize| self.covariance[(i, j)] / (sigma[i] * sigma[j]);
        DMatrix::from_fn(sigma.len(), sigma.len(), |i, j| if sigma[i] * sigma[j] > 0.0 { value(i, j) } else { 0.0 })
    }
}

impl Ambiguity {
    /// What would help.
    pub fn advice(self) -> &'static str {
        match self {
            Self::NoObjectLight => {
                "put a bright object (white board, reflective foil) close to the camera, and check the order of the frames"
            }
            Self::ObjectLightLost => {
                "shorten the integration time or move the object away, until no pixel is saturated"
            }
            Self::NoBackground => "use a smaller object, so that at least half of the image shows the background",
            Self::SignalBelowNoise => {
                "use a brighter, closer or larger object, a dimmer background, and average more frames"
            }
            Self::TermsIndistinguishable => "ask for fewer Gaussians, or add captures with the object at other places",
            Self::WidthBeyondImage => {
                "use the reduced point spread function for this image size; captures with the object in a corner and \
                 without an estimated constant tell more of the width"
            }
            Self::NoFit => "check that nothing but the object changed between the frames, and look at rejected blocks",
        }
    }
}

impl fmt::Display for Ambiguity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoObjectLight => "no object is brighter than the noise",
            Self::ObjectLightLost => "the object's light is not known (saturated or without data)",
            Self::NoBackground => "hardly any background is left beside the object",
            Self::SignalBelowNoise => "scatter that matters would not show above the noise",
            Self::TermsIndistinguishable => "the Gaussians cannot be told apart",
            Self::WidthBeyondImage => "a Gaussian is wider than the image: only weight over width squared is known",
            Self::NoFit => "no Gaussians with positive weights fit",
        })
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Determined => f.write_str("determined"),
            Self::NothingToCorrect => f.write_str("nothing to correct: no scattering"),
            Self::Undetermined { what, advice } => write!(f, "undetermined: {what}; {advice}"),
        }
    }
}

impl Verdict {
    pub(super) fn undetermined(what: Ambiguity) -> Self {
        Self::Undetermined { what, advice: what.advice() }
    }
}
