//! What a fitted shape stands on.

use nalgebra::{Matrix5, Point3, Vector3};
use point_uncertainty::Gradient;
use statistics::Distribution;

use super::Shape;
use super::robust::Robust;
use super::surface::Parameters;
use crate::{Cloud, Region, Result};

/// Standard deviations that a region leaves room for: what is cut off beyond three shifts a mean by less than a hundredth of one.
const SCATTER: f64 = 3.0;
/// Largest share of points that may be cut: all of them cut in the middle, the mean of a thousand points would move by as much as its
/// standard deviation. Regions whose ends run obliquely to the surface cut a few.
const LARGEST_SHARE_CUT: f64 = 0.05;

/// Whether points scatter about a shape as their errors say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Root of the weighted sum of squared residuals over its expectation from noise, neighbourhoods and common errors: 1 where the
    /// points are that shape and scatter as stated.
    pub sigma0: f64,
    /// Degrees of freedom of the χ² that the sum of squares is compared with: fewer than points where they share errors.
    pub degrees_of_freedom: f64,
    /// Probability of so large a sum of squares or a larger one, if the points scatter as stated.
    pub probability: f64,
    /// The level of the test.
    pub level: f64,
}

impl Scatter {
    /// Whether points scatter more than stated, at the level.
    pub fn exceeds(&self) -> bool {
        self.probability < self.level
    }

    /// What to say of it; `None` where nothing speaks against the shape and the stated errors.
    pub fn doubt(&self) -> Option<String> {
        let sentence = || {
            format!(
                "points lie {:.2} times as far from the surface as their errors say (probability {:.1e}, level {}): the \
                 surface has another shape, or the standard deviations are too small; nothing was scaled",
                self.sigma0, self.probability, self.level
            )
        };
        self.exceeds().then(sentence)
    }
}

/// The points that a shape was fitted to, and how it follows them.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    /// Points that the shape was fitted to, by index in the cloud.
    pub kept: Vec<usize>,
    /// Points of the region that belong to something else, or whose ray meets the shape too flat.
    pub left_out: Vec<usize>,
    /// Points without finite position or positive standard deviation.
    pub unusable: usize,
    /// Residuals of the kept points across the surface, outward, metre.
    pub residuals_m: Vec<f64>,
    /// Standard deviations of what each kept point has for itself, across the surface, metre.
    pub sigmas_m: Vec<f64>,
    /// Whether they scatter as stated.
    pub scatter: Scatter,
    influence: Vec<(Vector3<f64>, Parameters)>,
    /// Residual variance left by the fit in parts of the own one, for each kept point.
    pub(crate) redundancies: Vec<f64>,
    /// `tr Q` and `tr Q²` of the standardised residuals.
    pub(crate) expected: [f64; 2],
}

impl Support {
    pub(crate) fn new(fit: &Robust, level: f64) -> Self {
        let [mean, spread] = [fit.expected.mean, fit.expected.squares];
        let sum: f64 = fit.hits.iter().map(|hit| hit.residual * hit.residual / hit.variance).sum();
        let dof = mean * mean / spread;
        let probability = Distribution::ChiSquared { dof }.survival(sum * mean / spread);
        let scatter = Scatter { sigma0: (sum / mean).sqrt(), degrees_of_freedom: dof, probability, level };
        let leverage = |by: nalgebra::Vector5<f64>, unit: f64| by.dot(&(fit.inverse * by)) / (unit * unit);
        Self {
            kept: fit.terms.iter().map(|term| term.index).collect(),
            left_out: fit.left_out.clone(),
            unusable: fit.unusable,
            residuals_m: fit.hits.iter().map(|hit| hit.residual).collect(),
            sigmas_m: fit.hits.iter().map(|hit| hit.variance.sqrt()).collect(),
            scatter,
            influence: influence(fit, &fit.inverse),
            redundancies: fit.terms.iter().map(|term| 1.0 - leverage(term.by, term.unit)).collect(),
            expected: [mean, spread],
        }
    }

    /// Share of the region's usable points that were left out.
    pub fn share_left_out(&self) -> f64 {
        self.left_out.len() as f64 / (self.left_out.len() + self.kept.len()) as f64
    }

    /// Share of the kept points around which the region is thinner than their scatter: whose place on the surface is not in it any
    /// more when moved three standard deviations out or in. A region that cuts through the scatter keeps the points that err to one
    /// side, and the shape follows them.
    ///
    /// # Errors
    /// Those of [`Region::select`].
    pub fn share_cut(&self, cloud: &Cloud<'_>, region: &Region) -> Result<f64> {
        let parts = region.parts()?;
        let holds = |place: &Point3<f64>| parts.iter().any(|part| part.contains(place));
        let values = self.residuals_m.iter().zip(&self.sigmas_m);
        let all = self.kept.iter().zip(self.normals()).zip(values);
        let cut = all.filter(|((index, normal), (residual, sigma))| {
            let place = cloud.points.get(**index).map(|point| point - *normal * **residual);
            place.is_some_and(|place| {
                [-1.0, 1.0].iter().any(|side| !holds(&(place + *normal * (side * SCATTER * **sigma))))
            })
        });
        Ok(cut.count() as f64 / self.kept.len() as f64)
    }

    /// What to say where the region cuts through the scatter of its points; `None` where it does not.
    ///
    /// # Errors
    /// Those of [`Region::select`].
    pub fn doubt_of_cut(&self, cloud: &Cloud<'_>, region: &Region) -> Result<Option<String>> {
        let share = self.share_cut(cloud, region)?;
        let sentence = || {
            format!(
                "around {:.0} % of the points the region is thinner than {SCATTER} standard deviations of them: it keeps those that                  err inwards, and the surface follows; make the region thicker across the surface",
                100.0 * share
            )
        };
        Ok((share > LARGEST_SHARE_CUT).then(sentence))
    }

    /// Derivatives by the points of what has these derivatives by the parameters.
    pub(crate) fn gradient(&self, weights: &Parameters) -> Gradient {
        let of = |(point, (normal, by)): (&usize, &(Vector3<f64>, Parameters))| {
            (*point, normal * super::combined(by, weights))
        };
        self.kept.iter().zip(&self.influence).map(of).collect()
    }

    /// Normals of the surface at the kept points.
    pub(crate) fn normals(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.influence.iter().map(|(normal, _)| normal)
    }
}

/// Derivatives of the parameters by each kept point's shift along the normal: where `Σ A F / V` stays zero,
/// `dθ = −N⁻¹ A nᵀ dp / V`.
///
/// Derivatives of the Jacobian times residuals are left out: they are smaller by residual over extent of the surface, and average out.
fn influence(fit: &Robust, inverse: &Matrix5<f64>) -> Vec<(Vector3<f64>, Parameters)> {
    let of = |term: &super::Term| (term.normal, (-(inverse * term.by) / (term.unit * term.unit)).into());
    fit.terms.iter().map(of).collect()
}

impl Shape {
    /// Place of the radius among the parameters.
    pub(crate) fn radius_at(self) -> Parameters {
        std::array::from_fn(|at| if at + 1 == self.parameters() && self != Self::Plane { 1.0 } else { 0.0 })
    }
}
