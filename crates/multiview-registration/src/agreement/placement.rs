//! Whether stations lie where what they see agrees with what the others see.
//!
//! A station in the wrong place may fit the walls that it meets, and no residual of the adjustment tells: what meets
//! nothing takes no part in it. But it sees furniture where others looked through, and misses what they saw. Some of that
//! is in every survey, from edges, gross errors, and what moved; so a station is compared with the others of its survey.

use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::agreement::judges::Judges;
use crate::error::Result;
use crate::relative_pose::check_poses;
use crate::surfaces::extents::Extent;
use crate::surfaces::patches::faces_origin;
use global_registration::{
    CoarseOptions, FeatureCloud, Placed, SurfaceDescriptors, Viewpoint, agreement, agreement_of_rooms, in_voxels,
};
use point_cloud::Cloud;
use rigid_pose::InputError;
use statistics::Distribution;

/// How often what is usual in the survey a station must be contradicted to be doubted.
const DOUBTED: f64 = 4.0;
/// Fewest stations of which one can be told from the others: of four, one in the wrong place spoils half of the pairs. Asking
/// for ten leaves the eight of a room unjudged.
pub(crate) const FEWEST_STATIONS: usize = 5;

/// Probability at which any of many stations in their places is doubted, were their odds normal about their median. Measured upwards in
/// buildings (80, 95, 99.7 %) they are, within a tenth.
const LEVEL: f64 = 0.01;
/// Stations beyond which they are taken to stand in several rooms: each sees some of the others.
pub(crate) const ONE_ROOM: usize = 40;
/// Voxels beyond what a cloud saw at which a point may still lie on that or before it.
const BEYOND_VOXELS: f64 = 5.0;

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

    /// Stations of which something else tells that they are in the wrong place.
    pub(crate) fn doubt(&mut self, stations: impl Iterator<Item = usize>) {
        stations.for_each(|station| self.stations[station].verdict = Placement::Doubtful);
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
/// [`InputError::Empty`], [`InputError::LengthMismatch`], [`InputError::NonFinite`], [`InputError::NotPositive`] for the input.
pub fn judge_placements(stations: &[Cloud], world_from_station: &[Isometry3<f64>]) -> Result<Placements> {
    stations.iter().try_for_each(|cloud| cloud.validate("the cloud of a station"))?;
    if stations.is_empty() {
        return Err(InputError::Empty { what: "the list of stations" }.into());
    }
    check_poses("poses of the stations", stations.len(), world_from_station)?;
    let clouds = prepared(stations);
    let placed = |station: usize| Some((clouds[station].as_ref()?, world_from_station[station]));
    let candidates = may_judge(stations.len(), placed);
    Ok(Placements::of(stations.len(), pairs(&candidates, placed, judged_as(stations.len()))))
}

/// The pairs of stations of which one may say something of the other: what each saw, and looked through, lies in a box.
fn may_judge<'a>(count: usize, placed: impl Fn(usize) -> Option<Placed<'a>>) -> Vec<(usize, usize)> {
    let seen = |station: usize| {
        let Some((cloud, pose)) = placed(station) else { return Extent::of(std::iter::empty()) };
        let seen = cloud.points();
        Extent::placed(seen.iter().chain([&Point3::origin()]), &pose)
    };
    let extents: Vec<Extent> = (0..count).map(seen).collect();
    let voxel_m = (0..count).filter_map(|station| Some(placed(station)?.0.voxel_m())).fold(0.0, f64::max);
    Extent::pairs(&extents, BEYOND_VOXELS * voxel_m)
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
    // Twice, since many clouds in their own small voxels would take more memory than all else.
    let voxels: Vec<f64> =
        stations.par_iter().map(|cloud| prepare(cloud).map_or(0.0, |cloud| cloud.voxel_m())).collect();
    let voxel_m = voxels.into_iter().fold(0.0, f64::max);
    let coarse = |cloud: &Cloud| {
        let cloud = in_voxels(prepare(cloud).ok()?, voxel_m, &options(Viewpoint::Origin));
        cloud.ok().map(FeatureCloud::for_judging)
    };
    stations.par_iter().map(coarse).collect()
}

/// Whether the stations placed so far contradict one of them no more often than they do each other; not known, and false,
/// of fewer than five and where too little is seen in common.
pub(crate) fn agrees_as_usual(clouds: &[FeatureCloud], poses: &[Option<Isometry3<f64>>], station: usize) -> bool {
    let count = clouds.len();
    let all: Vec<(usize, usize)> = (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).collect();
    let pairs = pairs(&all, |other| poses[other].map(|pose| (&clouds[other], pose)), agreement);
    let placed: Vec<bool> = poses.iter().map(Option::is_some).collect();
    Judges::new(placed, &pairs).times_usual(station).is_some_and(|times| times < DOUBTED)
}

/// How two clouds are held against each other.
type Agreement = fn(&Placed<'_>, &Placed<'_>) -> (usize, usize);

fn judged_as(stations: usize) -> Agreement {
    if stations > ONE_ROOM { agreement_of_rooms } else { agreement }
}

/// `placed` gives the cloud and the pose of a station, if both are there.
fn pairs<'a>(
    all: &[(usize, usize)],
    placed: impl Fn(usize) -> Option<Placed<'a>> + Sync,
    agreement: Agreement,
) -> Vec<PairAgreement> {
    let pair = |&(target, source): &(usize, usize)| {
        let (agreeing, contradicting) = agreement(&placed(target)?, &placed(source)?);
        (agreeing + contradicting > 0).then_some(PairAgreement { target, source, agreeing, contradicting })
    };
    all.par_iter().filter_map(pair).collect()
}

/// How often what is usual a station must be contradicted to be doubted. In rooms and on the ways between them, usual is not the same
/// for all: of many stations it is told how much their odds scatter.
fn doubtful_from(judges: &Judges, count: usize) -> f64 {
    if count <= ONE_ROOM {
        return DOUBTED;
    }
    let beyond = Distribution::Normal.upper_quantile(LEVEL / count as f64);
    DOUBTED.max(1.0 + beyond * judges.scatter())
}

/// The worst station is taken out again and again, down to half of them: several in the wrong place, or a half of the
/// survey, hide each other as long as they are in. The last one that stood out then and all before it are held against the
/// rest.
fn judged(count: usize, pairs: &[PairAgreement]) -> Vec<StationPlacement> {
    let mut left = Judges::new(vec![true; count], pairs);
    let doubtful_from = doubtful_from(&left, count);
    let (mut taken, mut suspects) = (Vec::new(), 0);
    while count - taken.len() >= FEWEST_STATIONS.max(count.div_ceil(2) + 1) {
        let Some((worst, times)) = left.worst() else { break };
        left.remove(worst);
        taken.push(worst);
        if times >= doubtful_from {
            suspects = taken.len();
        }
    }
    let mut sound = vec![true; count];
    for &station in &taken[..suspects] {
        sound[station] = false;
    }
    let judges = Judges::new(sound.clone(), pairs);
    let doubted = |station: usize| judges.times_usual(station).is_some_and(|times| times >= doubtful_from);
    let sound: Vec<bool> = (0..count).map(|station| sound[station] || !doubted(station)).collect();
    let judges = Judges::new(sound.clone(), pairs);
    let verdict = |station: usize| {
        let (agreeing, contradicting) = judges.sums(station);
        let times_usual = judges.times_usual(station);
        let verdict = match (sound[station], times_usual) {
            (false, _) => Placement::Doubtful,
            (true, Some(_)) => Placement::Placed,
            (true, None) => Placement::Unjudged,
        };
        StationPlacement { agreeing, contradicting, times_usual, verdict }
    };
    (0..count).map(verdict).collect()
}

#[cfg(test)]
#[path = "../../tests/inside/placements.rs"]
mod tests;
