//! Whether a calibration contradicts itself: too much rejected, or residuals that are not what was stated.

use std::collections::{BTreeMap, BTreeSet};

use calibration_network::start_values::fits_as_given;
use nalgebra::{Isometry3, Point3};
use rigid_pose::absolute_orientation;
use statistics::upper_median;

use crate::contradictions::catalogue::{of_sightings, of_tables};
use crate::findings::contradiction::{Cause, CauseKind};
use crate::{CalibrationOutcome, Component, Network, Verdict};

/// Share of sightings with a gross error in surveys made with care: 0.2 to 2 %. Where the other stations of a survey have
/// more, theirs is what is ordinary.
const ORDINARY: f64 = 0.02;
/// Probability that a sound station is suspected.
const LEVEL: f64 = 1e-4;
/// Share of all sightings beyond which a rejection is no longer of single errors.
const TOO_MANY: f64 = 0.25;
/// Standard deviations as people state them are seldom right within a factor of two: beyond it the model is in doubt.
const DOUBTFUL_SCALE: f64 = 2.0;
/// A cause explains observations that scatter up to so many times as much as stated after it: deviations stated twice too
/// small, and terms of the range error left out that make as much again. Chosen, not varied.
pub(crate) const EXPLAINED_SCALE: f64 = 2.0 * DOUBTFUL_SCALE;
/// Where they are too large by more than this, they are in doubt as well.
const TOO_SMALL_SCALE: f64 = 0.1;
/// Redundancy from which on the scale of a group is believed: its own relative deviation is then 0.13.
const ENOUGH: f64 = 30.0;
/// Factor around a thousand within which a scale is that of a wrong unit.
const AROUND: f64 = 4.0;
/// Factor between nominal and found principal distance beyond which one of them is of another camera, or in another unit.
const LARGEST_PRINCIPAL_CHANGE: f64 = 2.0;
/// Share of the ambiguity interval beyond which an offset is no property of a camera.
const LARGEST_OFFSET: f64 = 0.5;

/// What speaks against a calibration.
#[derive(Debug, Clone, Default)]
pub(crate) struct Suspicion {
    /// Stations of which more was rejected than single errors explain: name, sightings rejected, sightings.
    pub(crate) stations: Vec<(String, usize, usize)>,
    /// Share of all sightings with something rejected.
    pub(crate) share: f64,
    /// Groups that scatter otherwise than stated, with their scale.
    pub(crate) groups: Vec<(String, f64)>,
    /// An offset of the ranges, metre, that comes near a whole interval.
    pub(crate) offset_m: Option<f64>,
    /// Whether poses and coordinates came out as the mirror image of those given.
    pub(crate) is_mirrored: bool,
    /// Principal distances, nominal and found, that differ as no lens does, mm.
    pub(crate) principal_distances_mm: Option<[f64; 2]>,
}

impl CalibrationOutcome {
    /// A sentence for each station of which more was rejected than single gross errors explain, which is one sound station
    /// in ten thousand, and for parameters that no camera has; and whether so much was rejected, or parameters are such,
    /// that the result is worth nothing.
    pub fn doubts_of_rejection(&self, network: &Network) -> (Vec<String>, bool) {
        let suspicion = Suspicion::new(self, network);
        let causes = suspicion.causes(network).into_iter().map(|cause| cause.to_string());
        (causes.chain(suspicion.sentences()).collect(), suspicion.is_hopeless())
    }
}

impl Suspicion {
    pub(crate) fn new(outcome: &CalibrationOutcome, network: &Network) -> Self {
        let mut seen: BTreeMap<&str, (BTreeSet<&str>, usize)> = BTreeMap::new();
        for sighting in &network.sightings {
            seen.entry(network.stations[sighting.station].name.as_str()).or_default().1 += 1;
        }
        let own = [Component::Col, Component::Row, Component::Range];
        for quality in &outcome.residuals {
            if quality.verdict == Verdict::Rejected
                && own.contains(&quality.component)
                && let Some((rejected, _)) = seen.get_mut(quality.station.as_str())
            {
                rejected.insert(&quality.target);
            }
        }
        let rejected: usize = seen.values().map(|(rejected, _)| rejected.len()).sum();
        let count = network.sightings.len().max(1);
        let suspected = |wrong: usize, of: usize| {
            let ordinary = (rejected - wrong) as f64 / (count - of).max(1) as f64;
            is_too_many(wrong, of, ordinary)
        };
        let stations = seen.iter().filter(|(_, (rejected, count))| suspected(rejected.len(), *count));
        let stations = stations.map(|(name, (rejected, count))| ((*name).to_owned(), rejected.len(), *count)).collect();
        let told = outcome.groups.iter().filter(|group| group.redundancy >= ENOUGH);
        let scales = told.filter_map(|group| Some((group.name.clone(), group.sigma0?)));
        let groups = scales.filter(|(_, scale)| !(TOO_SMALL_SCALE..=DOUBTFUL_SCALE).contains(scale)).collect();
        let limit = LARGEST_OFFSET * network.range_model.ambiguity_interval_m;
        let offset_m = outcome.parameter("d0").map(|d0| d0.value).filter(|d0| d0.abs() > limit);
        let nominal = network.camera.interior.principal_distance_mm;
        let found = outcome.camera.interior.principal_distance_mm;
        let other = (found / nominal).ln().abs() > LARGEST_PRINCIPAL_CHANGE.ln();
        let principal_distances_mm = other.then_some([nominal, found]);
        let (share, is_mirrored) = (rejected as f64 / count as f64, is_mirror_image(outcome, network));
        Self { stations, share, groups, offset_m, is_mirrored, principal_distances_mm }
    }

    /// Whether nothing speaks against it.
    pub(crate) fn is_none(&self) -> bool {
        self.stations.is_empty() && self.groups.is_empty() && self.share <= TOO_MANY && !self.is_impossible()
    }

    /// Whether less speaks against it than against another.
    pub(crate) fn is_lighter_than(&self, other: &Self) -> bool {
        let worst = |suspicion: &Self| suspicion.groups.iter().map(|(_, scale)| scale.ln().abs()).fold(0.0, f64::max);
        let count = |suspicion: &Self| (suspicion.is_impossible(), suspicion.stations.len());
        let weight = |suspicion: &Self| worst(suspicion) + suspicion.share;
        count(self) < count(other) || count(self) == count(other) && weight(self) < weight(other)
    }

    /// Whether there is no telling what the result is worth.
    pub(crate) fn is_hopeless(&self) -> bool {
        self.share > TOO_MANY || self.is_impossible()
    }

    /// Whether a parameter has a value that no camera has.
    fn is_impossible(&self) -> bool {
        self.offset_m.is_some() || self.principal_distances_mm.is_some() || self.is_mirrored
    }

    /// Whether the observations agree with the result, be its parameters what they may.
    fn is_consistent(&self) -> bool {
        self.share <= TOO_MANY && self.groups.iter().all(|(_, scale)| *scale <= EXPLAINED_SCALE)
    }

    /// Causes that the values of the parameters show, where most observations agree with these.
    pub(crate) fn causes(&self, network: &Network) -> Vec<Cause> {
        if !self.is_consistent() {
            return Vec::new();
        }
        let interval = network.range_model.ambiguity_interval_m;
        let offset = self.offset_m.map(|offset| Cause {
            kind: CauseKind::WholeIntervals,
            station: None, names: Vec::new(),
            words: format!(
                "all ranges fit with an offset d0 of {offset:.3} m only, which no camera has; the ambiguity interval is \
                 {interval:.3} m"
            ),
            remedy: "take the whole intervals off the column `range` of observations.csv",
            log_odds: f64::INFINITY,
        });
        let lens = self.principal_distances_mm.map(|[nominal, found]| Cause {
            kind: CauseKind::PrincipalDistanceUnit,
            station: None, names: Vec::new(),
            words: format!(
                "the image points fit with a principal distance of {found:.4} mm only, where {nominal} mm are given: it and \
                 the pixel pitch are not in one unit, or belong to another camera"
            ),
            remedy: "mend `principal_distance_mm` or `pixel_pitch_mm` of the camera in survey.ron, or of calibration.ron",
            log_odds: f64::INFINITY,
        });
        let mirrored = self.is_mirrored.then(|| mirrored(network));
        offset.into_iter().chain(lens).chain(mirrored).collect()
    }

    /// Sentences about stations, for a result that is given all the same.
    pub(crate) fn sentences(&self) -> Vec<String> {
        let station = |(name, rejected, seen): &(String, usize, usize)| {
            format!(
                "station `{name}`: {rejected} of {seen} sightings were rejected, more than single gross errors explain; \
                 look at its rows, or leave it out"
            )
        };
        self.stations.iter().map(station).collect()
    }
}

/// The factor between stated and true standard deviations, where it is that of millimetres for metres.
pub(crate) fn unit_factor(scale: f64) -> Option<f64> {
    [1e3, 1e-3].into_iter().find(|factor| (1.0 / AROUND..=AROUND).contains(&(scale / factor)))
}

/// Whether more of a station's sightings are wrong than single errors explain: their number is binomial.
/// `ordinary` is the share that the others have.
pub(crate) fn is_too_many(wrong: usize, of: usize, ordinary: f64) -> bool {
    let share = ordinary.max(ORDINARY);
    if wrong < 3 || share >= 1.0 {
        return false;
    }
    // Terms of the upper tail, from log-binomials.
    let (n, ln_p, ln_q) = (of as f64, share.ln(), (1.0 - share).ln());
    let mut term = n * ln_q;
    let mut below = 0.0;
    for k in 0..wrong {
        below += term.exp();
        term += ((n - k as f64) / (k as f64 + 1.0)).ln() + ln_p - ln_q;
    }
    1.0 - below < LEVEL
}

/// Points nearer to the mirror image of those given than by this share of their distance to the given ones are mirrored.
const MIRRORED: f64 = 0.5;

/// Whether adjusted stations and targets agree with those given only after a reflection.
fn is_mirror_image(outcome: &CalibrationOutcome, network: &Network) -> bool {
    let given: BTreeMap<&str, Point3<f64>> =
        network.targets.iter().filter_map(|target| Some((target.name.as_str(), target.point?))).collect();
    let targets = outcome.targets.iter().filter_map(|found| Some((*given.get(found.name.as_str())?, found.point)));
    let stations = network.stations.iter().filter_map(|station| {
        let found = outcome.stations.iter().find(|found| found.name == station.name)?;
        let place = |pose: &Isometry3<f64>| Point3::from(pose.translation.vector);
        Some((place(station.world_from_camera.as_ref()?), place(&found.world_from_camera)))
    });
    let (from, to): (Vec<Point3<f64>>, Vec<Point3<f64>>) = targets.chain(stations).unzip();
    let mirror: Vec<Point3<f64>> = from.iter().map(|point| Point3::new(point.x, point.y, -point.z)).collect();
    match (typical_distance(&from, &to), typical_distance(&mirror, &to)) {
        (Some(as_given), Some(mirrored)) => mirrored < MIRRORED * as_given,
        _ => false,
    }
}

/// Median distance after the best rotation and shift, of points brought to one size.
fn typical_distance(from: &[Point3<f64>], to: &[Point3<f64>]) -> Option<f64> {
    let sized = |points: &[Point3<f64>]| {
        let centre = points.iter().map(|point| point.coords).sum::<nalgebra::Vector3<f64>>() / points.len() as f64;
        let size = upper_median(&mut points.iter().map(|point| (point.coords - centre).norm()).collect::<Vec<f64>>());
        points.iter().map(|point| Point3::from((point.coords - centre) / size)).collect::<Vec<_>>()
    };
    let (from, to) = (sized(from), sized(to));
    let moved = absolute_orientation(&from, &to, None).ok()?.target_from_source;
    Some(upper_median(&mut from.iter().zip(&to).map(|(from, to)| (moved * from - to).norm()).collect::<Vec<f64>>()))
}

/// The cause of a mirrored network: what makes the given poses and coordinates fit, or one of all that may.
fn mirrored(network: &Network) -> Cause {
    let all = of_sightings(network, None).into_iter().chain(of_tables(network));
    let found = all.into_iter().find(|alternative| fits_as_given(&alternative.network));
    let (kind, words, remedy) = match found {
        Some(found) => (found.kind, found.words, found.remedy),
        None => (
            CauseKind::Mirrored,
            "the observations fit the mirror image of the given poses and coordinates".to_owned(),
            "mend the order or the sense of `col` and `row` in observations.csv, or of the axes in targets.csv and \
             stations.csv",
        ),
    };
    Cause { kind, station: None, names: Vec::new(), words, remedy, log_odds: f64::INFINITY }
}
