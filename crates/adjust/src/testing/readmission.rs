use nalgebra::{DMatrix, DVector};

use crate::{
    Adjustment, Distribution, Error, ObservationId, Rejection, Result, SnoopingOptions, SnoopingTest, Solution,
};

impl Adjustment<'_> {
    /// The prediction errors of excluded components over their standard deviations, each taken by itself. The statistic
    /// is the one that the component would have if it were admitted alone.
    pub(crate) fn predictions(
        &self,
        solution: &Solution,
        components: &[(ObservationId, usize)],
        snooping: &SnoopingOptions,
    ) -> Result<Vec<Rejection>> {
        let images = solution.images(components);
        let (critical, sigma0) = critical(solution, snooping);
        let mut fits = Vec::with_capacity(components.len());
        for (&(observation, component), image) in components.iter().zip(images) {
            let covariance = self.whole_covariance(observation)?;
            let row = solution.row(observation, component)?;
            let rows = solution.rows(observation)?;
            let used: Vec<usize> = (0..rows.len()).filter(|&i| !solution.is_excluded(rows.start + i)).collect();
            let (direction, own) = conditional(&covariance, component, &used)?;
            let error: f64 = direction.iter().zip(solution.residual(observation)?).map(|(d, v)| d * v).sum();
            let predicted = direction.dot(&(&image * &direction)).max(0.0);
            let statistic = error / ((own + predicted).sqrt() * sigma0);
            fits.push(Rejection {
                observation,
                component,
                statistic,
                critical,
                residual: solution.residuals()[row],
                redundancy_number: own / (own + predicted),
                step: 0,
            });
        }
        Ok(fits)
    }
}

/// Critical value of the prediction errors, and the standard deviation of unit weight they are measured in. Where that is
/// estimated without them, they follow Student's t; the decision is the same as by τ with them.
fn critical(solution: &Solution, snooping: &SnoopingOptions) -> (f64, f64) {
    match snooping.test {
        SnoopingTest::Baarda => (Distribution::Normal.critical(snooping.level), 1.0),
        SnoopingTest::Pope => {
            let student = Distribution::StudentT { dof: solution.redundancy() as f64 };
            (student.critical(snooping.level), solution.sigma0().unwrap_or(f64::NAN))
        }
    }
}

/// The direction `eₖ − B` that makes component k free of the used ones, `B = C_ku C_uu⁻¹`, and the variance that is left.
fn conditional(covariance: &DMatrix<f64>, component: usize, used: &[usize]) -> Result<(DVector<f64>, f64)> {
    let mut direction = DVector::zeros(covariance.nrows());
    direction[component] = 1.0;
    let mut own = covariance[(component, component)];
    if used.is_empty() {
        return Ok((direction, own));
    }
    let block = DMatrix::from_fn(used.len(), used.len(), |i, j| covariance[(used[i], used[j])]);
    let cross = DVector::from_fn(used.len(), |i, _| covariance[(used[i], component)]);
    let failed = Error::Decomposition { what: "factorisation of an observation's covariance" };
    let share = block.cholesky().ok_or(failed)?.solve(&cross);
    own -= share.dot(&cross);
    for (&index, share) in used.iter().zip(share.iter()) {
        direction[index] = -share;
    }
    Ok((direction, own))
}

impl Solution {
    /// `A Q Aᵀ` of the observations that the components belong to, in the unit of the observations.
    fn images(&self, components: &[(ObservationId, usize)]) -> Vec<DMatrix<f64>> {
        let mut out = vec![DMatrix::zeros(0, 0); components.len()];
        if components.is_empty() {
            return out;
        }
        let mut wanted: Vec<(usize, usize)> =
            components.iter().enumerate().map(|(index, one)| (self.layout.observations[one.0.0].row, index)).collect();
        wanted.sort_unstable();
        self.for_each_observation(|place, local| {
            let first = wanted.partition_point(|&(row, _)| row < place.row);
            for &(_, index) in wanted[first..].iter().take_while(|&&(row, _)| row == place.row) {
                let d = place.dimension;
                let factor = DMatrix::from_row_slice(d, d, local.factor());
                out[index] = &factor * DMatrix::from_row_slice(d, d, local.image) * factor.transpose();
            }
        });
        out
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{Covariance, FunctionObservation, ParameterBlock, SolveOptions};
    use approx::assert_relative_eq;
    use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};

    /// Six observations of three correlated components each.
    fn adjustment() -> Adjustment<'static> {
        let mut a = Adjustment::new();
        let x = a.add_block(ParameterBlock::euclidean([0.0, 0.0]));
        let group = a.add_group("triples");
        let covariance = Matrix3::new(1.0, 0.6, 0.3, 0.6, 2.0, -0.5, 0.3, -0.5, 1.5);
        for i in 0..6 {
            let t = f64::from(i);
            let design = Matrix3x2::new(1.0, t, 0.5, -t, t, 0.2);
            let observed = Vector3::new((3.0 * t).sin(), (5.0 * t).cos(), (7.0 * t).sin());
            let observation = FunctionObservation::new([x], 3, move |parameters, residual, jacobians| {
                residual.copy_from_slice((observed - design * Vector2::from_column_slice(parameters[0])).as_slice());
                if let Some(jacobians) = jacobians {
                    jacobians.set(0, &design);
                }
                Ok(())
            });
            a.add_observation(group, observation, &Covariance::from_matrix(&covariance)).unwrap();
        }
        a
    }

    #[test]
    fn a_prediction_has_the_statistic_of_the_test_with_it() {
        // Leaving a component out and predicting it is the same as testing it: sign and size, with two and with one of
        // its partners used.
        let options = SolveOptions::default();
        for others in [&[][..], &[(ObservationId(2), 0)]] {
            let mut a = adjustment();
            for &(observation, component) in others {
                a.exclude(observation, component).unwrap();
            }
            for test in [SnoopingTest::Baarda, SnoopingTest::Pope] {
                let snooping = SnoopingOptions { test, ..SnoopingOptions::default() };
                let with = a.solve(&options).unwrap();
                let row = with.row(ObservationId(2), 1).unwrap();
                let w = with.snoop(SnoopingTest::Baarda, 0.001).unwrap().statistics[row];
                let share = with.reliability(&crate::ReliabilityOptions::default()).unwrap()[row].control;
                a.exclude(ObservationId(2), 1).unwrap();
                let without = a.solve(&options).unwrap();
                let fit = a.predictions(&without, &[(ObservationId(2), 1)], &snooping).unwrap()[0];
                let expected = if test == SnoopingTest::Baarda { w } else { w / without.sigma0().unwrap() };
                assert_relative_eq!(fit.statistic, expected, max_relative = 1e-9);
                assert_relative_eq!(fit.redundancy_number, share, max_relative = 1e-9);
                a.readmit(ObservationId(2), 1).unwrap();
            }
        }
    }
}
