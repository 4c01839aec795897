//! Control is tested as observations are: the coordinates of a point, or the components of a pose, all at once.

use adjust::{BlockId, Scale};
use calibration_network::functional_model::{Setup, Solved, Source};
use nalgebra::{Cholesky, DMatrix, DVector};
use statistics::Distribution;

use crate::outliers::rejection::{Suspect, TESTABLE};
use crate::{NetworkError, Result};

/// Points and poses of the control that are farther off than `level` lets expect, largest first: the row of the first
/// component, and a statistic that is comparable with that of a single value at this level. Deviations are taken
/// `scale` times as large as stated.
///
/// With v = observed − adjusted of a block that is observed with covariance C and has covariance Q after the adjustment,
/// `vᵀ(C − Q)⁻¹v` is χ². Directions that nothing else checks are left out.
pub(crate) fn control_suspects(
    setup: &Setup<'_>,
    solved: &Solved,
    level: f64,
    scale: f64,
) -> Result<Vec<Suspect>, NetworkError> {
    let critical = Distribution::Normal.critical(level);
    let mut out = Vec::new();
    for (first, row) in solved.rows.iter().enumerate() {
        let (block, covariance): (Option<BlockId>, Option<DMatrix<f64>>) = match row.source {
            Source::Target(index, 0) => {
                let covariance = setup.network.targets[index].covariance;
                (solved.blocks.targets[index], covariance.map(|c| DMatrix::from_fn(3, 3, |i, j| c[(i, j)])))
            }
            Source::Station(index, 0) => {
                let covariance = setup.network.stations[index].covariance;
                (Some(solved.blocks.stations[index]), covariance.map(|c| DMatrix::from_fn(6, 6, |i, j| c[(i, j)])))
            }
            _ => continue,
        };
        let (Some(block), Some(given)) = (block, covariance) else { continue };
        let residuals = DVector::from_column_slice(&solved.solution.residuals()[first..first + given.nrows()]);
        let adjusted = solved.solution.covariance(block, Scale::Prior)?;
        let Some((square, degrees)) = joint_statistic(&residuals, &given, &adjusted) else { continue };
        let limit = Distribution::ChiSquared { dof: degrees }.upper_quantile(level);
        let statistic = critical * (square / limit).sqrt() / scale;
        if statistic > critical {
            out.push(Suspect { row: first, statistic });
        }
    }
    out.sort_by(|a, b| b.statistic.total_cmp(&a.statistic).then(a.row.cmp(&b.row)));
    Ok(out)
}

/// `vᵀ(C − Q)⁻¹v` over the directions that other observations check, and their number; `None` where there are none.
fn joint_statistic(residuals: &DVector<f64>, given: &DMatrix<f64>, adjusted: &DMatrix<f64>) -> Option<(f64, f64)> {
    let root = Cholesky::new(given.clone())?.l();
    let whitened = root.solve_lower_triangular(residuals)?;
    // The covariance of the whitened residuals: 1 where all else is exact, 0 where nothing else is known.
    let half = root.solve_lower_triangular(adjusted)?;
    let known = root.solve_lower_triangular(&half.transpose())?;
    let information =
        (DMatrix::identity(given.nrows(), given.nrows()) - 0.5 * (&known + known.transpose())).symmetric_eigen();
    let directions = information.eigenvalues.iter().zip(information.eigenvectors.column_iter());
    let checked = directions.filter(|(share, _)| **share > TESTABLE);
    let squares: Vec<f64> = checked.map(|(share, direction)| direction.dot(&whitened).powi(2) / share).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum(), squares.len() as f64))
}
