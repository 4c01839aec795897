//! Network design: how well a planned network would determine the calibration, and which further station helps most.

use std::borrow::Cow;
use std::collections::BTreeSet;

use calibration_network::functional_model::{Excluded, Setup, Solved, Start};
use calibration_network::precision::{Estimate, Fit, parameters, point_sigma};
use calibration_network::start_values::start_calibration;
use calibration_network::weakness::{exact_sightings, planned_sightings};
use camera_model::pose_from_euler;
use error_models::AmplitudeHyperbola;
use nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::choice::selection::all_terms;
use crate::choice::term_words::expand;
use crate::options::{datum, ranged_stations};
use crate::{
    CalibratedParameter, CalibrationOptions, Method, Network, NetworkDatum, NetworkError, Result, SightingOptions,
    Station, TermSelection,
};

/// Ranges at which the uncertainty of points is told, metre.
const POINT_RANGES_M: [f64; 3] = [1.0, 2.0, 4.0];
/// Targets that a candidate station has to see.
const SMALLEST_VIEW: usize = 4;

/// What is planned, beside stations and targets.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanOptions {
    /// Standard deviation of an image coordinate, pixel. Default: 0.05 pixel.
    pub sigma_pixel: f64,
    /// Standard deviation of a range, metre. Default: 0.01 m.
    pub sigma_range_m: f64,
    /// Standard deviation of an image coordinate of the passive camera, pixel. Default: 0.2 pixel.
    pub sigma_passive_pixel: f64,
    /// Terms to be estimated; automatic stands for all but the wave of length U and the amplitude hyperbola. Default:
    /// [`TermSelection::Auto`].
    pub terms: TermSelection,
    /// Datum. Default: [`NetworkDatum::Given`].
    pub datum: NetworkDatum,
    /// Stations whose ranges are left out, by name. Default: empty.
    pub without_ranges: Vec<String>,
    /// Inflation from which on a calibration would refuse the network. Default: that of [`CalibrationOptions`].
    pub largest_inflation: f64,
    /// Further stations to try; an empty grid tries none. Default: an empty grid.
    pub candidates: CandidateGrid,
}

/// Further stations to try: all combinations of distance, direction and roll, looking at the middle of the targets.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateGrid {
    /// Distances from the middle of the targets, metre.
    pub distances_m: Vec<f64>,
    /// Angles off the normal of the target field, degree; to the four sides each.
    pub convergence_deg: Vec<f64>,
    /// Rolls about the viewing axis, degree.
    pub roll_deg: Vec<f64>,
}

impl Default for CandidateGrid {
    /// Distances 1, 2 and 4 m, 0 and 35 degrees off the normal, rolls of 0 and 90 degrees.
    fn default() -> Self {
        Self { distances_m: vec![1.0, 2.0, 4.0], convergence_deg: vec![0.0, 35.0], roll_deg: vec![0.0, 90.0] }
    }
}

impl Default for PlanOptions {
    /// 0.05 pixel, 10 mm, 0.2 pixel for a passive camera, automatic terms, free network.
    fn default() -> Self {
        let calibration = CalibrationOptions::default();
        Self {
            sigma_pixel: 0.05,
            sigma_range_m: 0.010,
            sigma_passive_pixel: 0.2,
            terms: TermSelection::Auto,
            datum: NetworkDatum::Given,
            without_ranges: Vec::new(),
            largest_inflation: calibration.largest_inflation,
            candidates: CandidateGrid::default(),
        }
    }
}

/// What a planned network promises.
#[derive(Debug, Clone)]
pub struct PlanOutcome {
    /// All calibration parameters with their expected (prior-scaled) standard deviations; posterior ones and
    /// significances are NaN.
    pub parameters: Vec<CalibratedParameter>,
    /// Names of the estimated parameters.
    pub estimated: Vec<String>,
    /// Their covariance matrix.
    pub covariance: DMatrix<f64>,
    /// Their correlation matrix.
    pub correlation: DMatrix<f64>,
    /// Inflation of the weakest combination; see [`CalibrationOptions::largest_inflation`].
    pub inflation: f64,
    /// What is weak and what would cure it, in sentences. The first says whether a calibration would accept the network.
    pub diagnosis: Vec<String>,
    /// Observed values.
    pub observations: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Redundancy.
    pub redundancy: i64,
    /// Targets in the image of each station, by name.
    pub sightings_per_station: Vec<(String, usize)>,
    /// Standard deviation of a point (root of the summed variances of its coordinates, mean over the image) that the
    /// uncertainty of the calibration makes at 1, 2 and 4 m: range and deviation, metre.
    pub point_sigma_m: Vec<(f64, f64)>,
    /// Further stations, the most helpful first.
    pub candidates: Vec<Candidate>,
}

/// A station that could be added.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its pose.
    pub world_from_camera: Isometry3<f64>,
    /// Where it is, in words.
    pub description: String,
    /// Targets in its image.
    pub targets: usize,
    /// Standard deviation of each estimated parameter with the station over that without it.
    pub gain: Vec<(String, f64)>,
    /// Mean of the logarithms of the gains: the smaller, the more it helps (−0.1: deviations smaller by 10 % on average).
    pub score: f64,
}

/// Expected quality of a planned network. Stations and targets need poses and coordinates; observed values are ignored
/// and, where there are no sightings, replaced by all targets that fall into each image.
///
/// A passive camera takes part where the network has one.
///
/// # Errors
/// [`NetworkError::WeakNetwork`] where the network does not determine the parameters at all; a station or target without a
/// place; options outside their domain.
pub fn plan(network: &Network, options: &PlanOptions) -> Result<PlanOutcome> {
    network.validate()?;
    let design = Design::new(network, options)?;
    let (network, terms) = design.terms(network)?;
    let (network, design) = (&*network, Design { terms, ..design });
    let (observed, setup_start) = design.observe(network)?;
    let setup = design.setup(&observed, setup_start)?;
    let solved = setup.solve().map_err(|error| setup.explain(error, options.largest_inflation))?;
    let estimate = setup.estimate_of_terms(&solved)?;
    let strength = setup.strength(&solved)?;
    let inflation = strength.as_ref().map_or(1.0, |strength| strength.inflation);
    let verdict = if inflation > options.largest_inflation {
        format!(
            "a calibration would refuse this network: inflation {inflation:.0} over {:.0}",
            options.largest_inflation
        )
    } else {
        format!("a calibration would accept this network: inflation {inflation:.0} of {:.0}", options.largest_inflation)
    };
    let fit = Fit {
        observations: solved.solution.observations(),
        unknowns: solved.solution.unknowns(),
        datum_defect: solved.datum_defect,
        redundancy: solved.solution.redundancy(),
        vtpv: f64::NAN,
    };
    let count = |station: usize| observed.sightings.iter().filter(|seen| seen.station == station).count();
    Ok(PlanOutcome {
        parameters: parameters(&setup.calibration, &estimate, &fit),
        correlation: correlation(&estimate.covariance),
        inflation,
        diagnosis: std::iter::once(verdict).chain(strength.map(|strength| strength.sentence())).collect(),
        observations: fit.observations,
        unknowns: fit.unknowns,
        redundancy: fit.redundancy,
        sightings_per_station: observed.stations.iter().enumerate().map(|(i, s)| (s.name.clone(), count(i))).collect(),
        point_sigma_m: POINT_RANGES_M
            .map(|range_m| (range_m, point_sigma(&setup.calibration, &estimate, range_m)))
            .to_vec(),
        candidates: design.candidates(network, &setup, &solved, &estimate)?,
        estimated: estimate.names,
        covariance: estimate.covariance,
    })
}

fn correlation(q: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(q.nrows(), q.ncols(), |row, column| {
        q[(row, column)] / (q[(row, row)] * q[(column, column)]).sqrt()
    })
}

struct Design<'o> {
    options: &'o PlanOptions,
    calibration_options: CalibrationOptions,
    sightings: SightingOptions,
    terms: BTreeSet<String>,
}

impl<'o> Design<'o> {
    fn new(network: &Network, options: &'o PlanOptions) -> Result<Self> {
        let calibration_options = CalibrationOptions {
            terms: options.terms.clone(),
            datum: options.datum,
            without_ranges: options.without_ranges.clone(),
            largest_inflation: options.largest_inflation,
            ..CalibrationOptions::default()
        };
        calibration_options.check(network)?;
        let sightings = SightingOptions {
            sigma_pixel: options.sigma_pixel,
            sigma_range_m: options.sigma_range_m,
            sigma_passive_pixel: options.sigma_passive_pixel,
            ..SightingOptions::default()
        };
        let grid = &options.candidates;
        let numbers = grid.distances_m.iter().chain(&grid.convergence_deg).chain(&grid.roll_deg);
        if let Some(&value) = numbers.into_iter().find(|value| !value.is_finite()) {
            let expected = "distances and angles are finite";
            return Err(NetworkError::OutOfDomain { name: "candidates", value, expected }.into());
        }
        Ok(Self { options, calibration_options, sightings, terms: BTreeSet::new() })
    }

    /// The network with the range terms that are asked for, and their names.
    fn terms<'n>(&self, network: &'n Network) -> Result<(Cow<'n, Network>, BTreeSet<String>)> {
        let TermSelection::List(names) = &self.options.terms else {
            // Whether a hyperbola is needed, only residuals tell.
            let mut names = all_terms(network, Method::OneStep);
            names.retain(|name| !AmplitudeHyperbola::NAMES.contains(&name.as_str()));
            return Ok((Cow::Borrowed(network), names));
        };
        // A polynomial lies over the ranges that will be observed.
        let (observed, _) = self.observe(network)?;
        let (observed, terms) = expand(&observed, names, &self.calibration_options)?;
        let mut network = network.clone();
        network.range_model = observed.range_model.clone();
        Ok((Cow::Owned(network), terms))
    }

    /// Exact observations of a network, and its truth as start.
    fn observe(&self, network: &Network) -> Result<(Network, Start)> {
        let observed = exact_sightings(network, &self.sightings)?;
        let missing = |name: &String| NetworkError::NotReachable {
            kind: "station",
            name: name.clone(),
            reason: "a planned station needs a pose".to_owned(),
        };
        let stations = network.stations.iter().map(|s| s.world_from_camera.ok_or_else(|| missing(&s.name)));
        let seen: BTreeSet<usize> = observed.sightings.iter().map(|seen| seen.target).collect();
        let passive = observed.passive.iter().flat_map(|passive| passive.image_points.iter().map(|seen| seen.target));
        let seen: BTreeSet<usize> = seen.into_iter().chain(passive).collect();
        let targets = network.targets.iter().enumerate().map(|(i, target)| target.point.filter(|_| seen.contains(&i)));
        let start = Start {
            stations: stations.collect::<Result<_, _>>()?,
            targets: targets.collect(),
            relative: network.passive.as_ref().and_then(|passive| passive.range_camera_from_passive),
            mounting: None,
        };
        Ok((observed, start))
    }

    fn setup<'n>(&self, observed: &'n Network, start: Start) -> Result<Setup<'n>> {
        let ranged = ranged_stations(observed, &self.calibration_options);
        let passive = observed.passive.is_some();
        observed.check_coverage(&ranged, passive)?;
        Ok(Setup {
            network: observed,
            start,
            unused: None,
            calibration: start_calibration(observed),
            estimated: self.terms.clone(),
            ranged,
            passive,
            datum: datum(observed, &self.calibration_options)?,
            geometry_held: false,
            camera_prior: None,
            term_sigmas: self.options.terms.sigmas(observed),
            excluded: Excluded::default(),
        })
    }

    /// Adds each candidate in turn and compares the deviations.
    fn candidates(
        &self,
        network: &Network,
        setup: &Setup<'_>,
        solved: &Solved,
        estimate: &Estimate,
    ) -> Result<Vec<Candidate>> {
        let geometry = solved.geometry()?;
        let field = Field::new(geometry.targets.iter().flatten(), &geometry.stations);
        let mut out = Vec::new();
        for (world_from_camera, description) in field.candidates(&self.options.candidates) {
            let mut extended = network.clone();
            extended.sightings = planned_sightings(setup.network)?;
            let (station, integration_time_s) = (extended.stations.len(), network.stations[0].integration_time_s);
            let name = "candidate station".to_owned();
            extended.stations.push(Station {
                name,
                world_from_camera: Some(world_from_camera),
                covariance: None,
                integration_time_s,
                drift_m: 0.0,
            });
            let mut alone = extended.clone();
            alone.sightings.clear();
            let seen: Vec<_> = planned_sightings(&alone)?.into_iter().filter(|seen| seen.station == station).collect();
            let targets = seen.len();
            if targets < SMALLEST_VIEW {
                continue;
            }
            extended.sightings.extend(seen);
            let (observed, start) = self.observe(&extended)?;
            let setup = self.setup(&observed, start)?;
            let after = setup.estimate_of_terms(&setup.solve()?)?;
            let ratio = |i: usize| (after.covariance[(i, i)] / estimate.covariance[(i, i)]).sqrt();
            let gain: Vec<_> = estimate.names.iter().enumerate().map(|(i, name)| (name.clone(), ratio(i))).collect();
            let score = gain.iter().map(|(_, ratio)| ratio.ln()).sum::<f64>() / gain.len().max(1) as f64;
            out.push(Candidate { world_from_camera, description, targets, gain, score });
        }
        out.sort_by(|a, b| a.score.total_cmp(&b.score));
        Ok(out)
    }
}

/// Middle and axes of the target field: the third axis is its normal, towards the stations.
struct Field {
    middle: Vector3<f64>,
    world_from_field: UnitQuaternion<f64>,
}

impl Field {
    fn new<'p>(targets: impl Iterator<Item = &'p Point3<f64>>, stations: &[Isometry3<f64>]) -> Self {
        let points: Vec<Vector3<f64>> = targets.map(|point| point.coords).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let scatter: Matrix3<f64> = points.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
        let eigen = scatter.symmetric_eigen();
        let mut normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let camera =
            stations.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>() / stations.len().max(1) as f64;
        if normal.dot(&(camera - middle)) < 0.0 {
            normal = -normal;
        }
        // Upright as the first station is, so that a roll of zero is what the user calls so.
        let right = stations.first().map_or_else(Vector3::x, |pose| pose * Vector3::x());
        let up = normal.cross(&right);
        let basis = if up.norm() > 1e-6 { Some(up.normalize()) } else { None };
        let up = basis.unwrap_or_else(|| eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned());
        let rotation = Rotation3::from_basis_unchecked(&[up.cross(&normal), up, normal]);
        Self { middle, world_from_field: UnitQuaternion::from_rotation_matrix(&rotation) }
    }

    fn candidates(&self, grid: &CandidateGrid) -> Vec<(Isometry3<f64>, String)> {
        let mut out = Vec::new();
        for &distance in &grid.distances_m {
            for &angle in &grid.convergence_deg {
                let sides: &[(&str, f64, f64)] = if angle == 0.0 {
                    &[("in front", 0.0, 0.0)]
                } else {
                    &[("right", 0.0, 1.0), ("left", 0.0, -1.0), ("above", -1.0, 0.0), ("below", 1.0, 0.0)]
                };
                for &(side, omega, phi) in sides {
                    for &roll in &grid.roll_deg {
                        let direction =
                            if angle == 0.0 { side.to_owned() } else { format!("{angle:.0} degrees {side}") };
                        let description = format!("{distance:.1} m, {direction}, rolled by {roll:.0} degrees");
                        out.push((self.pose(distance, [omega * angle, phi * angle, roll]), description));
                    }
                }
            }
        }
        out
    }

    /// A camera that looks at the middle from the direction of two angles off the normal, degrees.
    fn pose(&self, distance: f64, [omega, phi, roll]: [f64; 3]) -> Isometry3<f64> {
        let turn = pose_from_euler(Vector3::zeros(), [omega.to_radians(), phi.to_radians(), 0.0]).rotation;
        let rolled = pose_from_euler(Vector3::zeros(), [0.0, 0.0, roll.to_radians()]).rotation;
        let rotation = self.world_from_field * turn * rolled;
        Isometry3::from_parts((self.middle + rotation * Vector3::new(0.0, 0.0, distance)).into(), rotation)
    }
}
