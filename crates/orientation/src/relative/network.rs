//! Several stations at once, from tie points alone.

use std::collections::BTreeSet;

use adjust::{Adjustment, Kernel, ObservationId, SnoopingOptions, SnoopingTest, Solution, SolveOptions};
use camera_model::{Camera, step_pose};
use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::relative::bundle::{Bundle, ObjectPoint, TieObservation};
use crate::relative::candidates::{CUT, SAME_ANGLE, is_same, rivals};
use crate::relative::epipolar::EpipolarCondition;
use crate::relative::minima::hold_base;
use crate::relative::network_start::{Start, starts};
use crate::relative::rays::{Pair, Ray};
use crate::{Error, Result};

/// Width of Cauchy's kernel: 95 % efficient for normal errors `[Huber1981]`.
const CAUCHY: f64 = 2.385;
/// Share of the objective below which a step ends the robust descent: what is left moves no value over a limit.
const SMALL_DECREASE: f64 = 1e-3;
/// Robust standard deviations beyond which a value is a gross error at the start: one in 16,000 normal ones; what is left out
/// wrongly is taken back when it fits.
const CONTRADICTS: f64 = 4.0;
/// Share of the values that may be left out at most.
const MOST_GROSS_ERRORS: f64 = 0.3;

/// Step of differences of a misfit by a pose, unit of the base and radian: a thousandth of what bends it.
const STEP: f64 = 1e-6;

/// How to orient a network.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NetworkOptions {
    /// Seed of the choice of samples of two views. Default 0.
    pub seed: u64,
    /// Options of the adjustment. Default: that of [`SolveOptions`].
    pub solve: SolveOptions,
}

/// What the length of the network comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetworkScale {
    /// Ranges: all lengths are metres.
    Ranges,
    /// There are no ranges: the distance of the first station from this one is the unit.
    BaseTo(usize),
}

/// The pose of a station in the frame of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedStation {
    /// The pose; its translation is the perspective centre.
    pub first_from_station: Isometry3<f64>,
    /// Covariance of the tangent step `[dt (axes of the first), dtheta (axes of the station, radian)]`, prior-scaled; zero for
    /// the first station, which is held.
    pub covariance: Matrix6<f64>,
}

/// Which part of an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ObservedPart {
    /// Column of the image point.
    Column,
    /// Row of the image point.
    Row,
    /// The range.
    Range,
}

/// Stations and points that fit together.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientedNetwork {
    /// All stations by number. The datum is the first one: its pose is held.
    pub stations: Vec<OrientedStation>,
    /// All targets by number, in the frame of the first station; `None` where too little tells where one is: a single image
    /// point, or rays that meet at less than a degree. What sees them took no part.
    pub points: Vec<Option<ObjectPoint>>,
    /// Where the length of the network comes from.
    pub scale: NetworkScale,
    /// Values that contradict the others and took no part: number of the observation, and its part.
    pub gross_errors: Vec<(usize, ObservedPart)>,
    /// Observations minus unknowns.
    pub redundancy: i64,
    /// Posterior standard deviation of unit weight; `None` without redundancy.
    pub sigma0: Option<f64>,
}

/// Orients stations of one camera by targets that several of them see, of which nothing is known: by their image points, by
/// ranges where there are any, or by both. Stations and targets are numbered from 0.
///
/// Start values come from station to station: with three ranges at a station or more, by absolute orientation of the points that
/// image points and ranges make; else from the two views with the best determined base, and then by resection on the points found
/// so far. All stations and points are then adjusted together with the pose of the first station held, and, without ranges, one base
/// of length one ([`OrientedNetwork::scale`]). Gross errors are kept off by a robust descent and left out by data snooping.
///
/// # Errors
/// [`Error::TooFewTargets`] without observations, [`Error::InvalidNumber`], [`Error::InvalidTarget`], [`Error::Camera`];
/// [`Error::NotConnected`] for a station that shares too few targets with the others; those of
/// [`orient_two_views`](crate::orient_two_views) where that is the way, [`Error::Ambiguous`] with poses of the station at the end of the
/// base among them; [`Error::Adjustment`].
pub fn orient_network(
    camera: &Camera,
    observations: &[TieObservation],
    options: &NetworkOptions,
) -> Result<OrientedNetwork> {
    let found = minima(camera, observations, options)?;
    let best = &found[0];
    let unit = best.solution.sigma0().unwrap_or(1.0).max(1.0).powi(2);
    let left_out = best.cost - best.solution.vtpv();
    let costs = |other: &Adjusted<'_>| [best.cost - left_out, other.cost - left_out];
    let redundancy = best.solution.redundancy().max(0) as f64;
    let rival = |other: &&Adjusted<'_>| rivals(costs(other), redundancy, unit) && best.differs(other);
    if let Some(second) = found.iter().find(rival) {
        let poses = [best, second].map(|found| found.bundle.pose(&found.solution, best.end).map(|(pose, _)| pose));
        let poses = poses.into_iter().collect::<Result<_>>()?;
        return Err(Error::Ambiguous { poses, difference: second.cost - best.cost });
    }
    best.result(observations)
}

/// The network at all minima that its starts lead to, the lowest first; one at least.
pub(crate) fn minima<'a>(
    camera: &'a Camera,
    observations: &[TieObservation],
    options: &NetworkOptions,
) -> Result<Vec<Adjusted<'a>>> {
    camera.validate()?;
    check(camera, observations)?;
    let mut found: Vec<Adjusted<'_>> = Vec::new();
    let mut failure = None;
    for start in starts(camera, observations, options)? {
        match adjusted(camera, observations, start, &options.solve) {
            Ok(adjusted) => found.push(adjusted),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    if found.is_empty() {
        return Err(failure.unwrap_or(Error::NoApproximation { targets: observations.len() }));
    }
    Ok(found)
}

/// Refuses numbers that cannot be.
fn check(camera: &Camera, observations: &[TieObservation]) -> Result<()> {
    if observations.is_empty() {
        return Err(Error::TooFewTargets { found: 0, needed: crate::target::NEEDED });
    }
    for (index, seen) in observations.iter().enumerate() {
        Ray::new(camera, &seen.image, index)?;
        // Each number has an observation: a larger one is a mistake, and would be a list of that length.
        for (what, number) in [("station", seen.station), ("target", seen.target)] {
            if number >= observations.len() {
                return Err(Error::InvalidNumber { what, number, observations: observations.len() });
            }
        }
        let range = seen.range.map_or([1.0; 2], |range| [range.range_m, range.sigma_m]);
        for (name, value) in [("range", range[0]), ("sigma_range", range[1])] {
            if !(value > 0.0 && value.is_finite()) {
                let expected = "a range or a standard deviation is positive and finite";
                return Err(Error::InvalidTarget { target: index, name, value, expected });
            }
        }
    }
    Ok(())
}

/// A network at its minimum.
pub(crate) struct Adjusted<'a> {
    bundle: Bundle<'a>,
    solution: Solution,
    scale: NetworkScale,
    /// The station farthest from the first.
    end: usize,
    /// `vᵀPv`, and what every value that took no part costs.
    cost: f64,
}

/// Brings a start to its minimum.
fn adjusted<'a>(
    camera: &'a Camera,
    observations: &[TieObservation],
    mut start: Start,
    options: &SolveOptions,
) -> Result<Adjusted<'a>> {
    let cameras = vec![camera; start.stations.len()];
    let far = |station: &usize| start.stations[*station].translation.vector.norm();
    let end = (1..start.stations.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
    let ranged = observations.iter().any(|seen| seen.range.is_some() && start.points[seen.target].is_some());
    if !ranged {
        start.scale_by(1.0 / start.stations[end].translation.vector.norm());
    }
    let scale = if ranged { NetworkScale::Ranges } else { NetworkScale::BaseTo(end) };
    let bundle = |start: &Start| {
        let mut bundle = Bundle::new(&cameras, &start.stations, &start.points, observations)?;
        if !ranged && end > 0 {
            hold_base(&mut bundle.adjustment, bundle.stations[end])?;
        }
        Ok::<_, Error>(bundle)
    };
    let mut robust = bundle(&start)?;
    robust.adjustment.set_kernel(robust.group, Kernel::Cauchy(CAUCHY))?;
    let descent = robust.adjustment.descend(options, SMALL_DECREASE)?;
    robust.take(&descent, &mut start)?;
    let mut bundle = bundle(&start)?;
    bundle.exclude_contradicting(&start, observations, CONTRADICTS)?;
    let values: usize = bundle.observations.iter().map(|(index, _)| observations[*index].parts().len()).sum();
    let most = (MOST_GROSS_ERRORS * values as f64) as usize;
    let snooping = SnoopingOptions { max_rejections: Some(most), ..SnoopingOptions::default() };
    let solution = bundle.adjustment.solve_snooping(options, &snooping)?.solution;
    let solution = readmitted(&mut bundle.adjustment, &bundle.observations, solution, options, &snooping)?;
    // What has no place costs as much as what is left out, or the start with the fewest points would win.
    let all: usize = observations.iter().map(|seen| seen.parts().len()).sum();
    let used = (0..solution.observations()).filter(|&row| !solution.is_excluded(row)).count();
    let cost = solution.vtpv() + CUT * all.saturating_sub(used) as f64;
    Ok(Adjusted { bundle, solution, scale, end, cost })
}

/// Takes values back that were left out at the start and fit the solution, and solves again where there are any.
fn readmitted(
    adjustment: &mut Adjustment<'_>,
    observations: &[(usize, ObservationId)],
    solution: Solution,
    options: &SolveOptions,
    snooping: &SnoopingOptions,
) -> Result<Solution> {
    let test = solution.snoop(snooping.test, snooping.level)?;
    let mut any = false;
    for &(_, id) in observations {
        for row in solution.rows(id)? {
            let component = row - solution.rows(id)?.start;
            if solution.is_excluded(row) && test.statistics[row].abs() <= test.critical {
                adjustment.readmit(id, component)?;
                any = true;
            }
        }
    }
    if any { Ok(adjustment.solve_snooping(options, snooping)?.solution) } else { Ok(solution) }
}

impl Adjusted<'_> {
    /// Whether the stations stand otherwise.
    fn differs(&self, other: &Self) -> bool {
        let pose = |network: &Self, station| network.bundle.pose(&network.solution, station).map(|(pose, _)| pose);
        let apart = |station: usize| match (pose(self, station), pose(other, station)) {
            (Ok(a), Ok(b)) => !is_same(&a, &b, SAME_ANGLE),
            _ => true,
        };
        (1..self.bundle.stations.len()).any(apart)
    }

    /// By how many standard deviations column and row of each observation differ from what all others say (Baarda's w, of what took
    /// no part that of its prediction), NaN for one of them that nothing checks. A target without a place, as no two of its rays
    /// meet, has the misfit of the pair of rays that miss each other least. `None` where nothing checks an observation.
    pub(crate) fn misfits(&self, observations: &[TieObservation]) -> Result<Vec<Option<[f64; 2]>>> {
        // Of the statistics alone: the level decides on nothing here.
        let test = self.solution.snoop(SnoopingTest::Baarda, SnoopingOptions::default().level)?;
        let mut misfits: Vec<Option<[f64; 2]>> =
            (0..observations.len()).map(|k| self.least_miss(observations, k)).collect();
        for &(index, id) in &self.bundle.observations {
            let first = self.solution.rows(id)?.start;
            let both = [0, 1].map(|component| test.statistics[first + component]);
            misfits[index] = Some(both).filter(|both| both.iter().any(|w| w.is_finite()));
        }
        Ok(misfits)
    }

    /// By how many standard deviations the ray of an observation misses the nearest of the others of its target.
    fn least_miss(&self, observations: &[TieObservation], index: usize) -> Option<[f64; 2]> {
        let own = &observations[index];
        let others = observations.iter().filter(|seen| seen.target == own.target && seen.station != own.station);
        let least = others.filter_map(|other| self.miss(own, other)).min_by(f64::total_cmp);
        least.map(|least| [least, f64::NAN])
    }

    /// The misfit of the rays of two observations over its deviation, that of the poses included.
    fn miss(&self, first: &TieObservation, second: &TieObservation) -> Option<f64> {
        let camera = |seen: &TieObservation| self.bundle.camera(seen.station);
        let rays = [first, second].map(|seen| Ray::new(camera(seen), &seen.image, seen.target).ok());
        let [Some(a), Some(b)] = rays else { return None };
        let condition = EpipolarCondition::new(&Pair { first: a, second: b });
        let poses = [first, second].map(|seen| self.bundle.pose(&self.solution, seen.station).ok());
        let [Some((of_first, covariance)), Some((of_second, other))] = poses else { return None };
        let stepped = |pose: &Isometry3<f64>, step: &Vector6<f64>| step_pose(pose, &(*step).into());
        let at = |steps: [&Vector6<f64>; 2]| {
            condition.standardised(&(stepped(&of_first, steps[0]).inverse() * stepped(&of_second, steps[1])))
        };
        let zero = Vector6::zeros();
        let mut variance = 1.0;
        for (which, covariance) in [covariance, other].iter().enumerate() {
            let slope = Vector6::from_fn(|component, _| {
                let moved = |sign: f64| {
                    let mut step = zero;
                    step[component] = sign * STEP;
                    if which == 0 { at([&step, &zero]) } else { at([&zero, &step]) }
                };
                (moved(1.0) - moved(-1.0)) / (2.0 * STEP)
            });
            variance += slope.dot(&(covariance * slope));
        }
        Some(at([&zero, &zero]).abs() / variance.sqrt()).filter(|miss| miss.is_finite())
    }

    fn result(&self, observations: &[TieObservation]) -> Result<OrientedNetwork> {
        let (bundle, solution) = (&self.bundle, &self.solution);
        let station = |index: usize| {
            let (first_from_station, covariance) = bundle.pose(solution, index)?;
            Ok(OrientedStation { first_from_station, covariance })
        };
        let mut gross_errors = BTreeSet::new();
        for &(index, id) in &bundle.observations {
            let rows = solution.rows(id)?;
            let parts = observations[index].parts();
            let wrong = rows.zip(parts).filter(|(row, _)| solution.is_excluded(*row)).map(|(_, part)| (index, *part));
            gross_errors.extend(wrong);
        }
        Ok(OrientedNetwork {
            stations: (0..bundle.stations.len()).map(station).collect::<Result<_>>()?,
            points: bundle.object_points(solution)?,
            scale: self.scale,
            gross_errors: gross_errors.into_iter().collect(),
            redundancy: solution.redundancy(),
            sigma0: solution.sigma0(),
        })
    }
}
