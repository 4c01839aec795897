//! Whether a network determines its calibration, and what would cure it where it does not.

use adjust::{Combination, NearDefect, Scale, WeaknessOptions};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6x1};

use crate::functional_model::setup::{Setup, Solved};
use crate::weakness::simulate::exact_sightings;
use crate::{Error, Network, Result, SightingOptions};

/// Weights below this share of the largest are left out of a combination.
const SMALLEST_WEIGHT: f64 = 0.05;
/// Weights from this share on take part in the choice of advice.
const LEADING_WEIGHT: f64 = 0.3;
/// Correlations from here on are told.
const STRONG: f64 = 0.9;

/// How the weakest combination of calibration parameters is known.
#[derive(Debug, Clone)]
pub struct Strength {
    /// How many times larger its deviation is than if its parameters did not share their effect with anything.
    pub inflation: f64,
    /// The combination, with weights.
    pub combination: Combination,
    /// With what of the stations it is correlated, in words.
    pub correlation: String,
    /// What to add to the network, in words.
    pub advice: String,
}

impl Strength {
    /// As an error.
    pub fn error(self) -> Error {
        Error::WeakNetwork {
            combination: self.combination.to_string(),
            inflation: self.inflation,
            correlation: self.correlation,
            advice: self.advice,
        }
    }

    /// As a sentence of a diagnosis.
    pub fn sentence(&self) -> String {
        format!(
            "weakest is {}: known {:.0} times worse than each alone ({}); to strengthen it, {}",
            self.combination, self.inflation, self.correlation, self.advice
        )
    }
}

impl Setup<'_> {
    /// Examines the calibration parameters of a solution.
    pub fn strength(&self, solved: &Solved) -> Result<Option<Strength>> {
        let calibration = std::iter::once(solved.blocks.camera).chain(solved.blocks.sets.iter().copied()).collect();
        let options = WeaknessOptions { blocks: Some(calibration), inflation: 1.0, max_count: 1 };
        let Some(worst) = solved.solution.near_defects(&options)?.combinations.pop() else { return Ok(None) };
        let correlations = station_correlations(solved, &worst)?;
        let advice = self.advice(&worst.combination, &correlations);
        let (inflation, combination) = (worst.inflation, worst.combination);
        Ok(Some(Strength { inflation, combination, correlation: correlations.sentence(), advice }))
    }

    /// What to add to the network, in the words of who observes it.
    pub fn advice(&self, combination: &Combination, motions: &Motions) -> String {
        let leading = |names: &[&str]| {
            let takes_part = |(name, weight): &(String, f64)| {
                let base = name.split('@').next().unwrap_or(name);
                weight.abs() >= LEADING_WEIGHT && names.contains(&base)
            };
            combination.terms.iter().any(takes_part)
        };
        let mut out = Vec::new();
        if leading(&["d2", "d3"]) {
            out.push(self.span_advice());
        }
        if leading(&["d0"]) && (motions.distance > 0.5 || out.is_empty()) {
            out.push("add stations at other distances, convergent stations or a known distance".to_owned());
        }
        if leading(&["c"]) && !leading(&["d0"]) {
            out.push(
                "add convergent stations, or stations at different distances from targets off one plane".to_owned(),
            );
        }
        if leading(&["xp", "yp", "p1", "p2"]) {
            out.push("roll the camera by 90 degrees at some stations".to_owned());
        }
        if leading(&["k1", "k2", "k3"]) {
            out.push("fill the corners of the images with targets, or hold the highest of k1, k2, k3".to_owned());
        }
        if leading(&["d4", "d5", "d6", "d7"]) {
            out.push(self.span_advice());
        }
        if leading(&["e1", "e2"]) {
            out.push("take ranges to targets all over the image, with the camera rolled by 90 degrees".to_owned());
        }
        if leading(&["h1", "h2", "h3"]) {
            out.push("observe targets of more different amplitudes, or hold d0".to_owned());
        }
        if out.is_empty() {
            out.push("add stations in other directions and distances, or hold one of these parameters".to_owned());
        }
        out.dedup();
        out.join("; ")
    }

    fn span_advice(&self) -> String {
        let used = (0..self.network.sightings.len()).filter(|&index| self.uses_range(index));
        let ranges = used.filter_map(|index| self.network.sightings[index].range_m);
        let (low, high) = ranges.fold((f64::INFINITY, 0.0_f64), |(low, high), range| (low.min(range), high.max(range)));
        let interval = self.network.range_model.ambiguity_interval_m;
        format!(
            "the ranges span only {:.2} of an ambiguity interval ({low:.2} m to {high:.2} m of {interval:.2} m): observe \
             ranges over a whole interval, or leave out the waves that the span cannot show",
            (high - low).max(0.0) / interval
        )
    }

    /// Where a network could not be solved: whether it would be determined at all, seen from its start values with exact
    /// observations. Answers with the weak combination, or with the error as it was.
    ///
    /// An adjustment that creeps along a weak direction ends somewhere far away, without convergence or without rank; what
    /// is undetermined there says nothing about the network.
    pub fn explain(&self, error: Error, largest_inflation: f64) -> Error {
        let Error::Adjust(failure) = &error else { return error };
        let creeping = matches!(
            failure,
            adjust::Error::NotConverged { .. } | adjust::Error::Evaluation { .. } | adjust::Error::RankDeficient { .. }
        );
        if !creeping {
            return error;
        }
        match (self.design_strength(), failure) {
            (Ok(Some(strength)), _) if strength.inflation > largest_inflation => strength.error(),
            (Err(Error::Adjust(adjust::Error::RankDeficient { combinations, .. })), _) => {
                self.undetermined(&combinations)
            }
            (_, adjust::Error::RankDeficient { combinations, .. }) => self.undetermined(combinations),
            _ => error,
        }
    }

    /// Combinations without any determination, as an error with advice on the first.
    pub fn undetermined(&self, combinations: &[Combination]) -> Error {
        let list: Vec<String> = combinations.iter().take(3).map(ToString::to_string).collect();
        let motions = Motions { distance: 1.0, ..Motions::default() };
        let advice = combinations.first().map_or_else(String::new, |first| self.advice(first, &motions));
        let correlation = "nothing determines it".to_owned();
        Error::WeakNetwork { combination: list.join("; "), inflation: f64::INFINITY, correlation, advice }
    }

    /// Strength of the same network with exact observations at its start values.
    fn design_strength(&self) -> Result<Option<Strength>> {
        let network = self.exact()?;
        let mut setup = Setup { network: &network, ..self.clone() };
        setup.excluded = self.excluded.clone();
        let solved = setup.solve()?;
        setup.strength(&solved)
    }

    /// The network as it would be observed from the start values without errors.
    fn exact(&self) -> Result<Network> {
        let mut network = self.network.clone();
        network.camera = self.calibration.camera;
        if let Some(set) = self.calibration.sets.first() {
            network.range_model = set.model.clone();
        }
        for (station, pose) in network.stations.iter_mut().zip(&self.start.stations) {
            station.world_from_camera = Some(*pose);
        }
        for (target, point) in network.targets.iter_mut().zip(&self.start.targets) {
            target.point = *point;
        }
        if let Some(passive) = network.passive.as_mut() {
            passive.range_camera_from_passive = self.start.relative;
        }
        let mut exact = exact_sightings(&network, &SightingOptions::default())?;
        for (exact, own) in exact.sightings.iter_mut().zip(&self.network.sightings) {
            exact.sigma_pixel = own.sigma_pixel;
            exact.sigma_range_m = own.sigma_range_m;
        }
        Ok(exact)
    }
}

/// Correlations of a combination with the stations' motions, means over all stations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motions {
    /// Across the viewing axis, the larger of both directions.
    pub sideways: f64,
    /// Along the viewing axis.
    pub distance: f64,
    /// Turns about the image's axes, the larger of both.
    pub tilt: f64,
    /// Turn about the viewing axis.
    pub roll: f64,
}

impl Motions {
    fn sentence(&self) -> String {
        let all = [
            ("the stations' distance along their viewing axes", self.distance),
            ("the stations' sideways position", self.sideways),
            ("the stations' tilt", self.tilt),
            ("the stations' roll", self.roll),
        ];
        let strongest = all.iter().fold(all[0], |best, next| if next.1 > best.1 { *next } else { best });
        let strong: Vec<String> = all
            .iter()
            .filter(|(_, correlation)| *correlation >= STRONG)
            .map(|(name, correlation)| format!("{correlation:.3} with {name}"))
            .collect();
        if strong.is_empty() {
            return format!("mean correlation {:.2} with {}", strongest.1, strongest.0);
        }
        format!("mean correlation {}", strong.join(" and "))
    }
}

/// Mean correlation of a functional of the calibration with the stations' motions, in camera axes.
fn station_correlations(solved: &Solved, worst: &NearDefect) -> Result<Motions> {
    let (solution, deviation) = (&solved.solution, worst.inflation);
    let mut sum = [0.0; 6];
    let mounting = solved.blocks.mounting.map(|block| solution.pose(block)).transpose()?;
    let camera_from_rig =
        mounting.map_or_else(Matrix3::identity, |pose| pose.rotation.inverse().to_rotation_matrix().into_inner());
    for &station in &solved.blocks.stations {
        let mut shared = Matrix6x1::<f64>::zeros();
        for &(block, component, weight) in &worst.functional {
            let between = solution.covariance_between(station, block, Scale::Prior)?;
            (0..6).for_each(|i| shared[i] += weight * between[(i, component)]);
        }
        let rotation = camera_from_rig * solution.pose(station)?.rotation.inverse().to_rotation_matrix().matrix();
        let own = solution.covariance(station, Scale::Prior)?;
        for (first, rotation) in [(0, rotation), (3, camera_from_rig)] {
            let motion = rotation * shared.fixed_rows::<3>(first);
            let spread = rotation * own.fixed_view::<3, 3>(first, first) * rotation.transpose();
            for axis in 0..3 {
                sum[first + axis] += motion[axis].abs() / (spread[(axis, axis)].sqrt() * deviation);
            }
        }
    }
    let count = solved.blocks.stations.len() as f64;
    let mean = |value: f64| if value.is_finite() { value / count } else { 0.0 };
    let [x, y, z, tilt_x, tilt_y, roll] = sum.map(mean);
    Ok(Motions { sideways: x.max(y), distance: z, tilt: tilt_x.max(tilt_y), roll })
}

/// Direction, in units of the deviations alone, whose deviation is larger than these by the largest factor, and the factor.
pub fn weakest(covariance: &DMatrix<f64>, alone: &[f64]) -> (DVector<f64>, f64) {
    let n = alone.len();
    let scaled = DMatrix::from_fn(n, n, |row, column| covariance[(row, column)] / (alone[row] * alone[column]));
    let eigen = scaled.symmetric_eigen();
    let worst = eigen.eigenvalues.imax();
    (eigen.eigenvectors.column(worst).into_owned(), eigen.eigenvalues[worst].max(0.0).sqrt())
}

/// A direction in the space of named parameters, weights relative to the largest; small ones are left out.
pub fn combination(direction: &DVector<f64>, names: &[String]) -> Combination {
    let largest = direction[direction.icamax()];
    let scaled = names.iter().zip(direction.iter()).map(|(name, weight)| (name.clone(), weight / largest));
    let mut terms: Vec<_> = scaled.filter(|(_, weight)| weight.abs() >= SMALLEST_WEIGHT).collect();
    terms.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    Combination { terms }
}
