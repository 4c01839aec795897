//! Whether stations lie where what they see agrees with what the others see.
//!
//! A station in the wrong place may fit the walls that it meets, and no residual of the adjustment tells: what meets
//! nothing takes no part in it. But it sees furniture where others looked through, and misses what they saw. Some of that
//! is in every survey, from edges, gross errors, and what moved; so a station is compared with the others of its survey.

use nalgebra::Isometry3;
use rayon::prelude::*;
use statistics::upper_median;

use crate::error::{Error, Result};
use crate::surfaces::patches::faces_origin;
use global_registration::{
    CoarseOptions, FeatureCloud, Placed, SurfaceDescriptors, Viewpoint, agreement, with_one_voxel,
};
use point_cloud::Cloud;
use rigid_pose::is_finite;

/// How often what is usual in the survey a station must be contradicted to be doubted.
const DOUBTED: f64 = 4.0;
/// Fewest sampled points seen in common by which a station is judged.
const FEWEST_POINTS: usize = 100;
/// Contradicting for each agreeing point that are usual even where the others have fewer: voxels beside edges.
const USUAL: f64 = 0.02;
/// Fewest stations of which one can be told from the others: of four, one in the wrong place spoils half of the pairs.
const FEWEST_STATIONS: usize = 5;

/// The verdict on the place of a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placement {
    /// Contradicted no more than the other stations are.
    Placed,
    /// Contradicted far more than the other stations are: probably in the wrong place.
    Doubtful,
    /// Fewer than five stations, or too little seen in common.
    Unjudged,
}

/// What speaks for and against the place of a station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StationPlacement {
    /// Sampled points, its own seen from the others and theirs seen from it, that lie on a surface of the other. Doubtful
    /// stations are not among the others.
    pub agreeing: usize,
    /// Sampled points that contradict: in space that the other looked through, or where the other saw a surface that they
    /// do not lie on.
    pub contradicting: usize,
    /// Contradicting for each agreeing point, as a multiple of the median of the other stations; `None` where that is not
    /// known.
    pub times_usual: Option<f64>,
    /// The verdict.
    pub verdict: Placement,
}

impl StationPlacement {
    /// Part of what was compared that contradicts, between 0 and 1.
    pub fn share(&self) -> f64 {
        self.contradicting as f64 / (self.agreeing + self.contradicting).max(1) as f64
    }
}

/// How two stations that see something in common agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairAgreement {
    /// Index of the target station, smaller than `source`.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// Sampled points of both that lie on a surface of the other.
    pub agreeing: usize,
    /// Sampled points of both that contradict.
    pub contradicting: usize,
}

/// Verdicts on the places of all stations.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Placements {
    /// One a station, in their order.
    pub stations: Vec<StationPlacement>,
    /// The pairs that see something in common.
    pub pairs: Vec<PairAgreement>,
}

impl Placements {
    /// The verdicts that the agreements of all pairs give.
    pub(crate) fn of(count: usize, pairs: Vec<PairAgreement>) -> Self {
        Self { stations: judged(count, &pairs), pairs }
    }

    /// Indices of the stations that are probably in the wrong place.
    pub fn doubtful(&self) -> impl Iterator<Item = usize> + '_ {
        let doubtful = |station: &&StationPlacement| station.verdict == Placement::Doubtful;
        self.stations.iter().enumerate().filter(move |(_, station)| doubtful(station)).map(|(index, _)| index)
    }
}

/// Judges poses `world_from_station`, wherever they come from, by what the stations see of each other's surfaces and look
/// through: each is compared with the others. Where two halves of a survey are each right by
/// themselves, one of them is called doubtful: which is not known.
///
/// Clouds are in the frames of their cameras or scanners; those whose normals do not point to the origin say nothing of
/// the space they looked through.
///
/// # Errors
/// [`Error::Empty`], [`Error::LengthMismatch`], [`Error::NonFinite`], [`Error::NotPositive`] for the input.
pub fn judge_placements(stations: &[Cloud], world_from_station: &[Isometry3<f64>]) -> Result<Placements> {
    stations.iter().try_for_each(|cloud| cloud.validate("the cloud of a station"))?;
    crate::relative_pose::require_poses(stations.len(), world_from_station)?;
    if let Some(index) = world_from_station.iter().position(|pose| !is_finite(pose)) {
        return Err(Error::NonFinite { what: "poses of the stations", index });
    }
    let clouds = prepared(stations);
    let pairs =
        pairs(stations.len(), |station| clouds[station].as_ref().map(|cloud| (cloud, world_from_station[station])));
    Ok(Placements::of(stations.len(), pairs))
}

/// The clouds in voxels; `None` for one that fills too few.
fn prepared(stations: &[Cloud]) -> Vec<Option<FeatureCloud>> {
    let options = |viewpoint| CoarseOptions {
        descriptors: SurfaceDescriptors::None,
        // Neighbours are needed for normals only.
        descriptor_radius_voxels: 2.5,
        viewpoint,
        ..CoarseOptions::default()
    };
    let prepare = |cloud: &Cloud| match &cloud.normals {
        Some(normals) if !faces_origin(cloud.points.iter().zip(normals)) => {
            FeatureCloud::new(&Cloud { normals: None, ..cloud.clone() }, &options(Viewpoint::Unknown))
        }
        _ => FeatureCloud::new(cloud, &options(Viewpoint::Origin)),
    };
    let found: Vec<Option<FeatureCloud>> = stations.par_iter().map(|cloud| prepare(cloud).ok()).collect();
    let filled: Vec<bool> = found.iter().map(Option::is_some).collect();
    let clouds = with_one_voxel(found.into_iter().flatten().collect(), &options(Viewpoint::Origin));
    let mut clouds = clouds.unwrap_or_default().into_iter();
    filled.into_iter().map(|is_filled| if is_filled { clouds.next() } else { None }).collect()
}

/// Whether the stations placed so far contradict one of them no more often than they do each other; not known, and false,
/// of fewer than five and where too little is seen in common.
pub(crate) fn agrees_as_usual(clouds: &[FeatureCloud], poses: &[Option<Isometry3<f64>>], station: usize) -> bool {
    let pairs = pairs(clouds.len(), |other| poses[other].map(|pose| (&clouds[other], pose)));
    let placed: Vec<bool> = poses.iter().map(Option::is_some).collect();
    times_usual(station, &placed, &pairs).is_some_and(|times| times < DOUBTED)
}

/// `placed` gives the cloud and the pose of a station, if both are there.
fn pairs<'a>(count: usize, placed: impl Fn(usize) -> Option<Placed<'a>> + Sync) -> Vec<PairAgreement> {
    let all: Vec<(usize, usize)> = (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).collect();
    let pair = |&(target, source): &(usize, usize)| {
        let (agreeing, contradicting) = agreement(&placed(target)?, &placed(source)?);
        (agreeing + contradicting > 0).then_some(PairAgreement { target, source, agreeing, contradicting })
    };
    all.par_iter().filter_map(pair).collect()
}

/// The worst station is taken out again and again, down to half of them: several in the wrong place, or a half of the
/// survey, hide each other as long as they are in. The last one that stood out then and all before it are held against the
/// rest.
fn judged(count: usize, pairs: &[PairAgreement]) -> Vec<StationPlacement> {
    let (mut left, mut taken, mut suspects) = (vec![true; count], Vec::new(), 0);
    while count - taken.len() >= FEWEST_STATIONS.max(count.div_ceil(2) + 1) {
        let ratio = |station: usize| Some((station, times_usual(station, &left, pairs)?));
        let stations = (0..count).filter(|&station| left[station]).filter_map(ratio);
        let Some((worst, times)) = stations.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        left[worst] = false;
        taken.push(worst);
        if times >= DOUBTED {
            suspects = taken.len();
        }
    }
    let mut sound = vec![true; count];
    for &station in &taken[..suspects] {
        sound[station] = false;
    }
    let doubted = |station: usize| times_usual(station, &sound, pairs).is_some_and(|times| times >= DOUBTED);
    let sound: Vec<bool> = (0..count).map(|station| sound[station] || !doubted(station)).collect();
    let verdict = |station: usize| {
        let (agreeing, contradicting) = sums(station, &sound, None, pairs);
        let times_usual = times_usual(station, &sound, pairs);
        let verdict = match (sound[station], times_usual) {
            (false, _) => Placement::Doubtful,
            (true, Some(_)) => Placement::Placed,
            (true, None) => Placement::Unjudged,
        };
        StationPlacement { agreeing, contradicting, times_usual, verdict }
    };
    (0..count).map(verdict).collect()
}

/// Agreeing and contradicting points of a station's pairs with those that are `sound`, but for one.
fn sums(station: usize, sound: &[bool], without: Option<usize>, pairs: &[PairAgreement]) -> (usize, usize) {
    let mut sums = (0, 0);
    for pair in pairs.iter().filter(|pair| pair.target == station || pair.source == station) {
        let other = if pair.target == station { pair.source } else { pair.target };
        if sound[other] && Some(other) != without {
            sums = (sums.0 + pair.agreeing, sums.1 + pair.contradicting);
        }
    }
    sums
}

/// Contradictions of a station over what the other sound ones have among themselves, in the median.
fn times_usual(station: usize, sound: &[bool], pairs: &[PairAgreement]) -> Option<f64> {
    let enough = |(agreeing, contradicting): &(usize, usize)| agreeing + contradicting >= FEWEST_POINTS;
    let others = (0..sound.len()).filter(|&other| other != station && sound[other]);
    let among = others.map(|other| sums(other, sound, Some(station), pairs)).filter(enough);
    let mut odds: Vec<f64> = among.map(|(agreeing, contradicting)| odds_of(agreeing, contradicting)).collect();
    let (agreeing, contradicting) = Some(sums(station, sound, None, pairs)).filter(enough)?;
    let is_judged = odds.len() + 1 >= FEWEST_STATIONS;
    is_judged.then(|| odds_of(agreeing, contradicting) / upper_median(&mut odds).max(USUAL))
}

/// Contradicting for each agreeing point: of what is wrong there may be many times more than of what is right.
fn odds_of(agreeing: usize, contradicting: usize) -> f64 {
    contradicting as f64 / agreeing.max(1) as f64
}
