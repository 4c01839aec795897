use nalgebra::{DMatrix, DVector};

use crate::{Error, Result, Solution};

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
    /// What the residuals say of parameters that were left out.
    ///
    /// `columns` has the derivatives of the modelled values by these parameters: a row for each observed value, in the
    /// order of adding (as [`Self::residuals`]), and a column for each parameter.
    ///
    /// ```
    /// use adjust::{Adjustment, Covariance, LinearObservation, ParameterBlock, SolveOptions};
    /// use nalgebra::DMatrix;
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
    /// let slope = solution.left_out(&DMatrix::from_column_slice(3, 1, &times))?;
    /// // vᵀPv is 8, and nothing with a slope of 2.
    /// assert!((slope.statistic(&[0]).unwrap_or(f64::NAN) - 8.0).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] for another number of rows than observed values.
    pub fn left_out(&self, columns: &DMatrix<f64>) -> Result<LeftOut> {
        if columns.nrows() != self.layout.rows {
            let what = "a column of derivatives by parameters that were left out".to_owned();
            return Err(Error::Length { what, expected: self.layout.rows, found: columns.nrows() });
        }
        let (count, weights) = (columns.ncols(), self.weights());
        let whitened: Vec<Vec<f64>> = columns.column_iter().map(|column| self.whitened(column.as_slice())).collect();
        let images: Vec<Vec<f64>> =
            whitened.iter().map(|column| self.linearisation.transpose_apply(&self.layout, column)).collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).zip(weights).map(|((a, b), weight)| weight * a * b).sum();
        let mut normal = DMatrix::zeros(count, count);
        for (j, image) in images.iter().enumerate() {
            let known = self.cofactor.multiply(image);
            for i in 0..=j {
                let all: f64 = product(&whitened[i], &whitened[j]);
                let taken: f64 = images[i].iter().zip(&known).map(|(a, b)| a * b).sum();
                normal[(i, j)] = all - taken;
                normal[(j, i)] = all - taken;
            }
        }
        let right = whitened.iter().map(|column| product(column, &self.linearisation.whitened));
        let alone = whitened.iter().map(|column| product(column, column));
        let (right, alone) = (DVector::from_iterator(count, right), DVector::from_iterator(count, alone));
        Ok(LeftOut { normal, right, alone })
    }

    /// `L⁻¹ column` with `C = L Lᵀ` of each observation.
    fn whitened(&self, column: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; column.len()];
        for (place, &start) in self.layout.observations.iter().zip(&self.whitening_start) {
            let own = &column[place.rows()];
            for (row, out) in out[place.rows()].iter_mut().enumerate() {
                let weights = &self.whitening[start + row * (row + 1) / 2..=start + row * (row + 3) / 2];
                *out = weights.iter().zip(own).map(|(weight, value)| weight * value).sum();
            }
        }
        out
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
