use crate::cofactors::images::Images;
use crate::linearised::layout::Place;
use crate::{Error, GroupId, Result, Scale, Solution};

/// Redundancy number below which a residual says nothing about its observation's error.
const UNCONTROLLED: f64 = 1e-9;

/// Figures of one observation group.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct GroupSummary {
    /// Name of the group.
    pub name: String,
    /// Number of observed values that are not excluded.
    pub observations: usize,
    /// Its part of vᵀPv.
    pub vtpv: f64,
    /// Its part of the redundancy: the sum of its redundancy numbers.
    pub redundancy: f64,
    /// Root mean square of its residuals, in the unit of its observations. NaN for an empty group.
    pub rms: f64,
}

impl GroupSummary {
    /// `√(vᵀPv / redundancy)` of the group: how much larger (or smaller) its standard deviations seem to be than they
    /// were given. `None` where the group has no redundancy of its own.
    pub fn sigma0(&self) -> Option<f64> {
        (self.redundancy > UNCONTROLLED * self.observations.max(1) as f64).then(|| (self.vtpv / self.redundancy).sqrt())
    }
}

impl Solution {
    /// Redundancy numbers `(I − A Q Aᵀ P)ᵢᵢ` of all observed values, in the order of [`Self::residuals`]: the share of an
    /// error that shows in its residual, 0 (not controlled) to 1. Their sum is the redundancy. P contains the robust
    /// weights. Zero for what is excluded.
    pub fn redundancy_numbers(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.observations()];
        self.for_each_observation(|place, local| {
            for (index, row) in place.rows().enumerate() {
                // With C = L Lᵀ and the whitened J: A Q AᵀP = L (w J Q Jᵀ) L⁻¹.
                let d = place.dimension;
                let mut used = 0.0;
                for first in 0..=index {
                    for second in index..d {
                        used += local.factor[index * d + first]
                            * local.image[first * d + second]
                            * local.whitening(second, index);
                    }
                }
                out[row] = if self.is_excluded(row) { 0.0 } else { 1.0 - self.weights()[row] * used };
            }
        });
        out
    }

    /// Standard deviations of the residuals, from `C − A Q Aᵀ`, prior- or posterior-scaled. An observation with the robust
    /// weight w has `C + (1 − 2w) A Q Aᵀ`: with weight zero its residual is that of a prediction.
    pub fn residual_deviations(&self, scale: Scale) -> Result<Vec<f64>> {
        let factor = self.variance_factor(scale)?.sqrt();
        let mut out = vec![0.0; self.observations()];
        self.for_each_observation(|place, local| {
            for (index, row) in place.rows().enumerate() {
                let d = place.dimension;
                let share = 1.0 - 2.0 * self.weights()[row];
                let mut variance = 0.0;
                for first in 0..=index {
                    let own = local.factor[index * d + first];
                    variance += own * own;
                    for second in 0..=index {
                        variance += share * own * local.image[first * d + second] * local.factor[index * d + second];
                    }
                }
                out[row] = factor * variance.max(0.0).sqrt();
            }
        });
        Ok(out)
    }

    /// Standardised residuals `v / σ_v`, prior-scaled ([`Scale::Prior`], Baarda's w) or posterior-scaled (Pope's τ).
    /// NaN where the redundancy number is below 1e-9: the residual is zero whatever the error.
    pub fn standardised_residuals(&self, scale: Scale) -> Result<Vec<f64>> {
        let deviations = self.residual_deviations(scale)?;
        let numbers = self.redundancy_numbers();
        let standardised = |row: usize, v: f64| {
            let controlled = numbers[row] > UNCONTROLLED || self.is_excluded(row);
            if controlled && deviations[row] > 0.0 { v / deviations[row] } else { f64::NAN }
        };
        Ok(self.residuals().iter().enumerate().map(|(row, &v)| standardised(row, v)).collect())
    }

    /// Figures of one group.
    pub fn group(&self, group: GroupId) -> Result<GroupSummary> {
        let count = self.groups.len();
        let name = self.groups.get(group.0).ok_or(Error::UnknownId { what: "group", index: group.0, count })?.clone();
        let numbers = self.redundancy_numbers();
        let (mut observations, mut vtpv, mut redundancy, mut squares) = (0, 0.0, 0.0, 0.0);
        for (place, _) in self.layout.observations.iter().zip(&self.group_of).filter(|(_, of)| **of == group) {
            for row in place.rows().filter(|&row| !self.is_excluded(row)) {
                observations += 1;
                vtpv += self.weights()[row] * self.linearisation.whitened[row].powi(2);
                redundancy += numbers[row];
                squares += self.linearisation.residual[row].powi(2);
            }
        }
        let rms = if observations > 0 { (squares / f64::from(observations)).sqrt() } else { f64::NAN };
        Ok(GroupSummary { name, observations: observations as usize, vtpv, redundancy, rms })
    }

    pub(crate) fn for_each_observation(&self, mut visit: impl FnMut(&Place, &Local<'_>)) {
        let images = self.images.get_or_init(|| Images::new(&self.layout, &self.linearisation, &self.cofactor));
        let mut factor = Vec::new();
        for (index, (place, &start)) in self.layout.observations.iter().zip(&self.whitening_start).enumerate() {
            let whitening = &self.whitening[start..];
            invert_lower(whitening, place.dimension, &mut factor);
            visit(place, &Local { image: images.image(index), factor: &factor, whitening });
        }
    }
}

/// Small matrices of one observation.
pub(crate) struct Local<'s> {
    /// `J Q Jᵀ`, row-major.
    pub(crate) image: &'s [f64],
    /// L of `C = L Lᵀ`, row-major, full.
    factor: &'s [f64],
    whitening: &'s [f64],
}

impl Local<'_> {
    /// L of `C = L Lᵀ`, row-major, full.
    pub(crate) fn factor(&self) -> &[f64] {
        self.factor
    }

    /// Element of `L⁻¹`, row >= column.
    pub(crate) fn whitening(&self, row: usize, column: usize) -> f64 {
        self.whitening[row * (row + 1) / 2 + column]
    }
}

/// Inverse of a lower triangle stored row by row, as a full row-major matrix.
fn invert_lower(packed: &[f64], n: usize, out: &mut Vec<f64>) {
    out.clear();
    out.resize(n * n, 0.0);
    for row in 0..n {
        let weights = &packed[row * (row + 1) / 2..(row + 1) * (row + 2) / 2];
        for column in 0..=row {
            let known: f64 = (column..row).map(|i| weights[i] * out[i * n + column]).sum();
            let target = if row == column { 1.0 } else { 0.0 };
            out[row * n + column] = (target - known) / weights[row];
        }
    }
}
