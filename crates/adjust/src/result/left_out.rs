use nalgebra::{DMatrix, DVector};

use crate::Solution;

/// What the residuals of a solution say of parameters that were left out of it.
///
/// With the derivatives B of the modelled values by these parameters, all unknowns taken out of them, the normal equations
/// `BᵀP(I − H)B · x = BᵀPv` give what they would be estimated as, to first order, were they unknowns as well; H puts
/// observed on modelled values. What `vᵀPv` falls by with some of them is χ² of their number where they are zero:
/// the score test, which asks for no other adjustment.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct LeftOut {
    /// `BᵀP(I − H)B`.
    pub normal: DMatrix<f64>,
    /// `BᵀPv`.
    pub right: DVector<f64>,
    /// `BᵀPB`: the same, were all unknowns known.
    pub alone: DVector<f64>,
}

/// A parameter that the unknowns leave less than this share of what shows it cannot be told from them.
const ROUNDING: f64 = 1e-9;

impl Solution {
    /// What the residuals say of `count` parameters that were left out.
    ///
    /// `derivatives` writes those of one modelled value by these parameters, into zeros; values are counted in the order of
    /// adding (as [`Self::residuals`]).
    ///
    /// ```
    /// use adjust::{Adjustment, Covariance, LinearObservation, ParameterBlock, SolveOptions};
    ///
    /// # fn main() -> Result<(), adjust::Error> {
    /// // A mean of values that rise: the slope was left out.
    /// let mut adjustment = Adjustment::new();
    /// let mean = adjustment.add_block(ParameterBlock::euclidean([0.0]));
    /// let group = adjustment.add_group("heights");
    /// let times = [-1.0, 0.0, 1.0];
    /// for height in [1.0, 3.0, 5.0] {
    ///     let observation = LinearObservation::new(height, [(mean, [1.0])]);
    ///     adjustment.add_observation(group, observation, &Covariance::from_sigma(1.0))?;
    /// }
    /// let solution = adjustment.solve(&SolveOptions::default())?;
    /// let slope = solution.left_out(1, |row, out| out[0] = times[row]);
    /// // vᵀPv is 8, and nothing with a slope of 2.
    /// assert!((slope.statistic(&[0]).unwrap_or(f64::NAN) - 8.0).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    pub fn left_out(&self, count: usize, mut derivatives: impl FnMut(usize, &mut [f64])) -> LeftOut {
        let unknowns = self.layout.unknowns;
        // AᵀPB by parameters, one after another; BᵀPB; BᵀPv.
        let mut images = vec![0.0; count * unknowns];
        let (mut normal, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let mut memory = (Vec::new(), vec![0.0; count]);
        for (place, &start) in self.layout.observations.iter().zip(&self.whitening_start) {
            let (raw, whitened) = (&mut memory.0, &mut memory.1);
            raw.clear();
            raw.resize(place.dimension * count, 0.0);
            place.rows().zip(raw.chunks_exact_mut(count.max(1))).for_each(|(row, out)| derivatives(row, out));
            let jacobian = &self.linearisation.jacobian[place.jacobian_range()];
            for (row, index) in place.rows().enumerate() {
                // L⁻¹ B with C = L Lᵀ.
                let weights = &self.whitening[start + row * (row + 1) / 2..=start + row * (row + 3) / 2];
                for (column, out) in whitened.iter_mut().enumerate() {
                    let own = raw[column..].iter().step_by(count);
                    *out = weights.iter().zip(own).map(|(weight, value)| weight * value).sum();
                }
                let weight = self.weights()[index];
                for (j, value) in whitened.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                    let value = weight * value;
                    right[j] += value * self.linearisation.whitened[index];
                    (0..=j).for_each(|i| normal[(i, j)] += value * whitened[i]);
                    for part in self.layout.parts(place) {
                        let image = &mut images[j * unknowns..][part.columns()];
                        let entries = &jacobian[row * place.width..][part.entries()];
                        image.iter_mut().zip(entries).for_each(|(out, a)| *out += a * value);
                    }
                }
            }
        }
        let alone = normal.diagonal();
        // What is left of the gradient at the end of the iteration is no score.
        let gradient = self.linearisation.transpose_apply(&self.layout, &self.linearisation.whitened);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (j, image) in images.chunks_exact(unknowns.max(1)).enumerate() {
            let known = self.cofactor.multiply(image);
            right[j] -= dot(&known, &gradient);
            for (i, other) in images.chunks_exact(unknowns.max(1)).enumerate().take(j + 1) {
                normal[(i, j)] -= dot(other, &known);
            }
        }
        normal.fill_lower_triangle_with_upper_triangle();
        LeftOut { normal, right, alone }
    }
}

impl LeftOut {
    /// What `vᵀPv` falls by with these parameters, by their columns; `None` where the unknowns of the solution, or each
    /// other, imitate one of them.
    pub fn statistic(&self, chosen: &[usize]) -> Option<f64> {
        let is_shown = |&i: &usize| self.normal[(i, i)] > ROUNDING * self.alone[i];
        if chosen.is_empty() || !chosen.iter().all(is_shown) {
            return None;
        }
        let unit = DVector::from_iterator(chosen.len(), chosen.iter().map(|&i| self.normal[(i, i)].sqrt()));
        let scaled = |i: usize, j: usize| self.normal[(chosen[i], chosen[j])] / (unit[i] * unit[j]);
        let normal = DMatrix::from_fn(chosen.len(), chosen.len(), scaled);
        let right = DVector::from_fn(chosen.len(), |i, _| self.right[chosen[i]] / unit[i]);
        let factor = normal.cholesky()?;
        let weakest = factor.l_dirty().diagonal().min();
        (weakest * weakest > ROUNDING).then(|| right.dot(&factor.solve(&right)))
    }
}
