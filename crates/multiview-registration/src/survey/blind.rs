//! Poses of stations of which at most the order is known.
//!
//! Two clouds alone are often ambiguous: the opposite corner of a room resembles its counterpart, and a neighbour that
//! overlaps little may fit better when turned by 180 degrees. So each pair gives several poses, and stations are placed
//! one after the other with several arrangements kept, each judged by all its pairs of stations: a wrong turn puts walls
//! into space that some station looked through.

use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::adjustment::turns::{MeasuredTurn, allows};
use crate::agreement::placement::agrees_as_usual;
use crate::error::{Error, Result};
use crate::survey::registration::Start;
use global_registration::{CoarseOptions, FeatureCloud, Placed, evidence, hypotheses, refined_among, with_one_voxel};
use point_cloud::Cloud;

/// Poses of a pair that are verified, and those that are used.
const VERIFIED: usize = 24;
const HYPOTHESES: usize = 16;
/// Arrangements that are kept.
const ARRANGEMENTS: usize = 12;
/// Of the sampled points, one in this many ranks the arrangements.
const STRIDE: usize = 4;
/// Steps of a station onto those placed before it, and of all onto each other at the end.
const STEPS: usize = 4;
/// Passes over all stations in which each may go where it fits better among all others, and poses refined for each.
const REPLACEMENTS: usize = 3;
const REPLACED_FROM: usize = 6;
const MUCH_BETTER: f64 = 1.1;
/// Poses of a station nearer than this are one, voxels: one that has slid by a voxel fits no more.
const SAME_VOXELS: f64 = 0.5;
/// Poses nearer than this lead to one place, voxels: only the one that fits best is refined.
const BESIDE_VOXELS: f64 = 3.0;

/// Stations that may overlap, with the poses `target_from_source` that features allow, the best first.
struct Candidate {
    target: usize,
    source: usize,
    poses: Vec<(Isometry3<f64>, f64)>,
}

/// Poses of the stations placed so far.
#[derive(Clone)]
struct Arrangement {
    poses: Vec<Option<Isometry3<f64>>>,
    score: f64,
}

/// Poses of all stations, right to a part of a voxel but for what they slid together.
pub(crate) fn arranged(
    stations: &[Cloud],
    start: Start<'_>,
    held: usize,
    turns: &[MeasuredTurn],
) -> Result<Vec<Isometry3<f64>>> {
    let options = CoarseOptions { max_hypotheses: VERIFIED, ..CoarseOptions::default() };
    let features: std::result::Result<Vec<FeatureCloud>, global_registration::Error> =
        stations.par_iter().map(|cloud| FeatureCloud::new(cloud, &options)).collect();
    let clouds = with_one_voxel(features?, &options)?;
    let pairs = pairs(start, clouds.len());
    let candidate = |&(target, source): &(usize, usize)| {
        let mut poses = hypotheses(&clouds[source], &clouds[target], &options)?;
        poses.retain(|(pose, _)| allows(turns, [target, source], &pose.rotation));
        poses.truncate(HYPOTHESES);
        Ok(Candidate { target, source, poses })
    };
    let candidates: Result<Vec<Candidate>> = pairs.par_iter().map(candidate).collect();
    let search = Search { clouds: &clouds, candidates: &candidates? };
    let mut best = search.best();
    for _ in 0..REPLACEMENTS {
        if !search.replaced(&mut best) {
            break;
        }
    }
    let missing: Vec<usize> = (0..clouds.len()).filter(|&station| best.poses[station].is_none()).collect();
    if !missing.is_empty() {
        let poses = |&station: &usize| {
            let own = search.candidates.iter().filter(|pair| pair.target == station || pair.source == station);
            let count: usize = own.map(|pair| pair.poses.len()).sum();
            format!("of {count} poses that its features allow none fits what the others saw and looked through")
        };
        let reasons = missing.iter().map(poses).collect();
        return Err(Error::UnconnectedStations { stations: missing, to: held, reasons });
    }
    let mut poses: Vec<Isometry3<f64>> = best.poses.into_iter().flatten().collect();
    let to_held = poses[held].inverse();
    for pose in &mut poses {
        *pose = to_held * *pose;
    }
    search.swept(&mut poses, held);
    Ok(poses)
}

/// Pairs that are aligned: the next two stations of each, the first ones with the last; or all.
fn pairs(start: Start<'_>, count: usize) -> Vec<(usize, usize)> {
    let near = |target: usize, source: usize| source - target <= 2 || target + count - source <= 2;
    let wanted = |target: usize, source: usize| matches!(start, Start::Nothing) || near(target, source);
    (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).filter(|&(t, s)| wanted(t, s)).collect()
}

struct Search<'a> {
    clouds: &'a [FeatureCloud],
    candidates: &'a [Candidate],
}

impl Search<'_> {
    /// The arrangement that most speaks for and least against.
    fn best(&self) -> Arrangement {
        let count = self.clouds.len();
        let (first, order) = self.order();
        let mut poses = vec![None; count];
        poses[first] = Some(Isometry3::identity());
        let mut kept = vec![Arrangement { poses, score: 0.0 }];
        // A station that nothing leads to yet is tried again among all others.
        for _ in 0..2 {
            for &station in &order {
                if kept[0].poses[station].is_none() {
                    kept = self.extended(&kept, station);
                }
            }
        }
        kept.swap_remove(0)
    }

    /// The first station and the others, each the one with the best pair among those placed before it.
    fn order(&self) -> (usize, Vec<usize>) {
        let score = |c: &Candidate| c.poses.first().map_or(f64::NEG_INFINITY, |pose| pose.1);
        let best = |open: &dyn Fn(&Candidate) -> bool| {
            let fits = self.candidates.iter().filter(|c| open(c));
            fits.fold(
                None,
                |best: Option<&Candidate>, c| if best.is_some_and(|b| score(b) >= score(c)) { best } else { Some(c) },
            )
        };
        let first = best(&|_| true).map_or(0, |c| c.target);
        let mut placed = vec![false; self.clouds.len()];
        placed[first] = true;
        let mut order = Vec::new();
        while let Some(next) = best(&|c| placed[c.target] != placed[c.source]) {
            let station = if placed[next.target] { next.source } else { next.target };
            placed[station] = true;
            order.push(station);
        }
        (first, order)
    }

    /// The best arrangements with one station more; those as they are where it fits nowhere.
    fn extended(&self, kept: &[Arrangement], station: usize) -> Vec<Arrangement> {
        let extensions: Vec<(usize, Isometry3<f64>)> = kept
            .iter()
            .enumerate()
            .flat_map(|(k, a)| self.proposals(a, station).into_iter().map(move |p| (k, p)))
            .collect();
        let rank = |(k, pose): &(usize, Isometry3<f64>), stride| {
            kept[*k].score + self.evidence(&kept[*k], station, pose, stride)
        };
        let mut ranked: Vec<(f64, (usize, Isometry3<f64>))> =
            extensions.par_iter().map(|extension| (rank(extension, STRIDE), *extension)).collect();
        // Stable: equal ones stay in the order of the proposals.
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        let beside = |(_, (a, first)): &(_, (usize, _)), (_, (b, second)): &(_, (usize, _))| {
            a == b && self.is_near(station, BESIDE_VOXELS, first, second)
        };
        let ranked = first_of_each(ranked, 2 * ARRANGEMENTS, beside);
        let refined = |(_, (k, pose)): &(f64, (usize, Isometry3<f64>))| {
            let pose = self.refined(&kept[*k].poses, station, pose, STEPS);
            let mut next = kept[*k].clone();
            next.poses[station] = Some(pose);
            next.score = rank(&(*k, pose), 1);
            (*k, next)
        };
        let mut next: Vec<(usize, Arrangement)> = ranked.par_iter().map(refined).collect();
        next.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
        let best = next.first().map(|(_, arrangement)| arrangement.clone());
        next.retain(|(k, arrangement)| arrangement.score > kept[*k].score);
        next.truncate(ARRANGEMENTS);
        if !next.is_empty() {
            return next.into_iter().map(|(_, arrangement)| arrangement).collect();
        }
        // Weights of contradictions are those of clean surveys: where all stations have more, from gross errors and edges,
        // the best place is held against the others' places.
        let usual = best.filter(|arrangement| agrees_as_usual(self.clouds, &arrangement.poses, station));
        usual.map_or_else(|| kept.to_vec(), |arrangement| vec![arrangement])
    }

    /// Moves stations to where they fit better, now that all their neighbours are in place; whether any moved.
    fn replaced(&self, arrangement: &mut Arrangement) -> bool {
        let mut any = false;
        for station in 0..self.clouds.len() {
            let mut without = arrangement.clone();
            let present = without.poses[station].take();
            let proposals = self.proposals(&without, station);
            let mut ranked: Vec<(f64, Isometry3<f64>)> =
                proposals.into_par_iter().map(|pose| (self.evidence(&without, station, &pose, STRIDE), pose)).collect();
            ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
            let beside = |a: &(f64, _), b: &(f64, _)| self.is_near(station, BESIDE_VOXELS, &a.1, &b.1);
            let ranked = first_of_each(ranked, REPLACED_FROM, beside);
            let refined = |(_, pose): &(f64, Isometry3<f64>)| {
                let pose = self.refined(&without.poses, station, pose, STEPS);
                (self.evidence(&without, station, &pose, 1), pose)
            };
            let refined: Vec<(f64, Isometry3<f64>)> = ranked.par_iter().map(refined).collect();
            let now = present.map_or(0.0, |pose| self.evidence(&without, station, &pose, 1));
            let better = refined.iter().fold(
                None,
                |best: Option<&(f64, Isometry3<f64>)>, next| {
                    if next.0 > best.map_or(now, |b| b.0) { Some(next) } else { best }
                },
            );
            if let Some((score, pose)) = better {
                arrangement.poses[station] = Some(*pose);
                // Less is the same place, a little better refined.
                any |= *score > MUCH_BETTER * now;
            }
        }
        any
    }

    /// Poses of a station by its pairs with those that have been placed, without repetitions.
    fn proposals(&self, arrangement: &Arrangement, station: usize) -> Vec<Isometry3<f64>> {
        let mut found: Vec<Isometry3<f64>> = Vec::new();
        for candidate in self.candidates {
            let (other, inverted) = match station {
                s if s == candidate.source => (candidate.target, false),
                s if s == candidate.target => (candidate.source, true),
                _ => continue,
            };
            let Some(placed) = arrangement.poses[other] else { continue };
            for (pose, _) in &candidate.poses {
                let pose = placed * if inverted { pose.inverse() } else { *pose };
                if !found.iter().any(|other| self.is_near(station, SAME_VOXELS, other, &pose)) {
                    found.push(pose);
                }
            }
        }
        found
    }

    /// Whether two poses of a station are this near, rotations at the radius of its cloud.
    fn is_near(&self, station: usize, voxels: f64, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        let cloud = &self.clouds[station];
        let moved_m = (a.translation.vector - b.translation.vector).norm();
        moved_m + cloud.radius_m * a.rotation.angle_to(&b.rotation) < voxels * cloud.voxel_m()
    }

    fn evidence(&self, arrangement: &Arrangement, station: usize, pose: &Isometry3<f64>, stride: usize) -> f64 {
        let own = (&self.clouds[station], *pose);
        self.others(&arrangement.poses, station).iter().map(|other| evidence(other, &own, stride)).sum()
    }

    fn others(&self, poses: &[Option<Isometry3<f64>>], station: usize) -> Vec<Placed<'_>> {
        let others = poses.iter().enumerate().filter(|(other, _)| *other != station);
        others.filter_map(|(other, pose)| pose.map(|pose| (&self.clouds[other], pose))).collect()
    }

    fn refined(
        &self,
        poses: &[Option<Isometry3<f64>>],
        station: usize,
        pose: &Isometry3<f64>,
        steps: usize,
    ) -> Isometry3<f64> {
        refined_among(&(&self.clouds[station], *pose), &self.others(poses, station), steps)
    }

    /// One station after the other onto all others, so that what has added up along the way is shared out.
    fn swept(&self, poses: &mut [Isometry3<f64>], held: usize) {
        for _ in 0..STEPS {
            for station in (0..poses.len()).filter(|&station| station != held) {
                let all: Vec<Option<Isometry3<f64>>> = poses.iter().copied().map(Some).collect();
                poses[station] = self.refined(&all, station, &poses[station], 1);
            }
        }
    }
}

/// Of a list, the best first, so many that lie beside none before them.
fn first_of_each<T>(ranked: Vec<T>, most: usize, beside: impl Fn(&T, &T) -> bool) -> Vec<T> {
    let mut kept: Vec<T> = Vec::with_capacity(most);
    for next in ranked {
        if kept.len() < most && !kept.iter().any(|other| beside(other, &next)) {
            kept.push(next);
        }
    }
    kept
}
