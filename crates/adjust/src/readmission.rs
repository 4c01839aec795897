use nalgebra::{DMatrix, DVector};

use crate::{
    Adjustment, Distribution, Error, ObservationId, Rejection, Result, SnoopingOptions, SnoopingTest, Solution,
};

/// How an excluded component fits a solution that it has no part in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    pub(crate) record: Rejection,
}

impl Adjustment<'_> {
    /// The prediction errors of excluded components over their standard deviations, each taken by itself. The statistic
    /// is the one that the component would have if it were admitted alone.
    pub(crate) fn predictions(
        &self,
        solution: &Solution,
        components: &[(ObservationId, usize)],
        snooping: &SnoopingOptions,
    ) -> Result<Vec<Fit>> {
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
            let record = Rejection {
                observation,
                component,
                statistic,
                critical,
                residual: solution.residuals()[row],
                redundancy_number: own / (own + predicted),
                step: 0,
            };
            fits.push(Fit { record });
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
        self.for_each_observation(|place, local| {
            for (image, (observation, _)) in out.iter_mut().zip(components) {
                if self.layout.observations[observation.0].row == place.row {
                    let d = place.dimension;
                    let factor = DMatrix::from_row_slice(d, d, local.factor());
                    *image = &factor * DMatrix::from_row_slice(d, d, local.image) * factor.transpose();
                }
            }
        });
        out
    }
}
