//! Control is tested as observations are: the coordinates of a point, or the components of a pose, all at once.

use std::collections::BTreeMap;

use adjust::{BlockId, Scale};
use nalgebra::{Cholesky, DMatrix, DVector};
use statistics::Distribution;

use crate::Result;
use crate::networks::functional_model::problem::{Datum, Excluded, Row, Setup, Solved, Source};
use crate::networks::outliers::rejection::{Suspect, TESTABLE};
use crate::networks::start_values::start_finder::target_point;
use crate::networks::{CalibrationOutcome, Component, Verdict};

impl Setup<'_> {
    /// Coordinates of a control point as rows; `None` where it takes no part as weighted control.
    pub(crate) fn target_control(&self, index: usize) -> Option<Vec<Row>> {
        let target = &self.network.targets[index];
        let (point, covariance) = (target.point?, target.covariance?);
        let row = |axis: usize| Row {
            source: Source::Target(index, axis),
            component: Component::Control,
            observed: point[axis],
            sigma: covariance[(axis, axis)].sqrt(),
        };
        Some((0..3).map(row).collect())
    }

    /// Components of a control pose as rows: position, then the rotation from the given attitude, which is none.
    pub(crate) fn station_control(&self, index: usize) -> Option<Vec<Row>> {
        let station = &self.network.stations[index];
        let (pose, covariance) = (station.world_from_camera?, station.covariance?);
        let row = |component: usize| Row {
            source: Source::Station(index, component),
            component: Component::Control,
            observed: if component < 3 { pose.translation.vector[component] } else { 0.0 },
            sigma: covariance[(component, component)].sqrt(),
        };
        Some((0..6).map(row).collect())
    }

    /// Releases control points that most of their sightings contradict, and keeps these. Where that would be half of the
    /// control, it is another thing that is wrong.
    pub(crate) fn without_wrong_control(&mut self, contradicting: &Excluded) -> Excluded {
        let (network, datum) = (self.network, self.datum);
        let is_control = |target: &usize| datum != Datum::Inner && self.target_control(*target).is_some();
        let control: Vec<usize> = (0..network.targets.len()).filter(is_control).collect();
        let mut seen = vec![(0_usize, 0_usize); network.targets.len()];
        for (index, sighting) in network.sightings.iter().enumerate().filter(|(_, sighting)| sighting.pixel.is_some()) {
            seen[sighting.target].1 += 1;
            seen[sighting.target].0 += usize::from(contradicting.image_points.contains(&index));
        }
        let is_wrong = |target: &usize| seen[*target].0 >= 2 && 2 * seen[*target].0 > seen[*target].1;
        let wrong: Vec<usize> = control.iter().copied().filter(is_wrong).collect();
        let mut left = contradicting.clone();
        if 2 * wrong.len() >= control.len() {
            return left;
        }
        for target in wrong {
            let Some(point) = target_point(network, &self.calibration, &self.start.stations, target) else { continue };
            self.start.targets[target] = Some(point);
            self.excluded.control_points.insert(target);
            left.image_points.retain(|index| network.sightings[*index].target != target);
            left.ranges.retain(|index| network.sightings[*index].target != target);
        }
        left
    }

    /// Points and poses of the control that are farther off than `level` lets expect, largest first: the row of the first
    /// component, and a statistic that is comparable with that of a single value at this level. Deviations are taken
    /// `scale` times as large as stated.
    ///
    /// With v = observed − adjusted of a block that is observed with covariance C and has covariance Q after the adjustment,
    /// `vᵀ(C − Q)⁻¹v` is χ². Directions that nothing else checks are left out.
    pub(crate) fn control_suspects(&self, solved: &Solved, level: f64, scale: f64) -> Result<Vec<Suspect>> {
        let critical = Distribution::Normal.critical(level);
        let mut out = Vec::new();
        for (first, row) in solved.rows.iter().enumerate() {
            let (block, covariance): (Option<BlockId>, Option<DMatrix<f64>>) = match row.source {
                Source::Target(index, 0) => {
                    let covariance = self.network.targets[index].covariance;
                    (solved.blocks.targets[index], covariance.map(|c| DMatrix::from_fn(3, 3, |i, j| c[(i, j)])))
                }
                Source::Station(index, 0) => {
                    let covariance = self.network.stations[index].covariance;
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

impl CalibrationOutcome {
    /// A sentence for each point or pose of the control that was rejected.
    pub(crate) fn doubts_of_control(&self) -> Vec<String> {
        let mut rejected: BTreeMap<(&str, &str), Vec<[f64; 2]>> = BTreeMap::new();
        for quality in &self.residuals {
            if quality.component == Component::Control && quality.verdict == Verdict::Rejected {
                let of = rejected.entry((quality.station.as_str(), quality.target.as_str())).or_default();
                of.push([quality.residual, quality.sigma]);
            }
        }
        rejected.into_iter().map(|((station, target), parts)| sentence(station, target, &parts)).collect()
    }
}

/// `parts`: residual and standard deviation of each component.
fn sentence(station: &str, target: &str, parts: &[[f64; 2]]) -> String {
    let length = |parts: &[[f64; 2]]| parts.iter().map(|[residual, _]| residual * residual).sum::<f64>().sqrt();
    let deviations = parts.iter().map(|[residual, sigma]| (residual / sigma).abs()).fold(0.0, f64::max);
    let millimetres = 1e3 * length(&parts[..3]);
    if station.is_empty() {
        let [x, y, z] = [0, 1, 2].map(|axis| 1e3 * parts[axis][0]);
        return format!(
            "control point `{target}` was rejected: its coordinates in targets.csv are {millimetres:.1} mm (x {x:+.1}, y {y:+.1}, z \
             {z:+.1}) from where the observations put it, up to {deviations:.1} times their deviations; was it moved, mistyped, \
             or exchanged with another?"
        );
    }
    let degrees = length(&parts[3..]).to_degrees();
    format!(
        "the given pose of station `{station}` was rejected: it is {millimetres:.1} mm and {degrees:.2} degrees from where the \
         observations put it, up to {deviations:.1} times its deviations; mend its row in stations.csv"
    )
}
