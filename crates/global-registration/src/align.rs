//! From correspondences to hypotheses to the pose that the clouds agree with.

use std::borrow::Cow;

use nalgebra::{Isometry3, Matrix6};
use rayon::prelude::*;
use statistics::Distribution;

use super::description::feature_cloud::{FeatureCloud, FeatureSet, Place};
use super::hypotheses::correspondences::Correspondences;
use super::hypotheses::graph::ConsistencyGraph;
use super::hypotheses::matching::matches;
use super::options::{CoarseOptions, SharedError};
use super::verification::distinct::Common;
use super::verification::judge::Verdict;
use super::verification::refine::refine;
use crate::error::{Error, Result};

/// Correspondences that enter the graph, those with the most alike descriptors.
const MOST_CORRESPONDENCES: usize = 2500;
/// Cliques that poses are computed from.
const MOST_CANDIDATES: usize = 120;
/// Where nothing passes at first: this many times as many candidates and hypotheses.
const SECOND_LOOK: usize = 4;
/// Of the sampled points, one in this many ranks the candidates.
const RANKING_STRIDE: usize = 4;
/// Poses closer than this are one, voxels.
const SAME_POSE_VOXELS: f64 = 4.0;

/// An alignment without a guess that passed the verification.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseAlignment {
    /// Pose: `target = target_from_source * source`, good to a fraction of a voxel: a start for `icp_registration::align`.
    pub target_from_source: Isometry3<f64>,
    /// Covariance of the pose, tangent `[dt, dθ]` (see `rigid_pose::step_pose`): random and shared errors, and the width of
    /// what edges hold where planes leave a motion open. Small against the true errors where a sensor's errors are so smooth that
    /// the pose takes them up.
    pub covariance: Matrix6<f64>,
    /// The error of distances between the surfaces that neighbouring points share, as given or as the residuals tell it; 0 where
    /// none stands out.
    pub shared_error: SharedError,
    /// Correspondences that agree with the pose.
    pub inliers: usize,
    /// Correspondences that were found.
    pub correspondences: usize,
    /// Fraction of the cloud that overlaps more which has a partner in the other.
    pub overlap: f64,
    /// Fraction of the points that the other camera should have seen which lie on its surface.
    pub agreement: f64,
    /// Probability that as many points contradict at a right pose, on the other's surface without a partner or (counted twice)
    /// in space that it looked through: as many as miss within the clouds themselves, the more scattered the more points err
    /// together.
    pub consistency: f64,
    /// Fraction of the sampled points that have a partner and lie inside what encloses the scene, both of them: the cloud
    /// goes on behind their tangent plane. Near 0, walls and corners alone fit.
    pub inside: f64,
    /// Probability that the best pose that differs fits no worse: the scene is ambiguous.
    pub rival: f64,
    /// Root mean square distance of partners across the surface, metre.
    pub rms_m: f64,
    /// Probability that the pose is known to 4 voxels, the width of one answer, along the motion that is determined least.
    pub determined: f64,
    /// Edge of the voxels in use, metre.
    pub voxel_m: f64,
}

/// Aligns two clouds about which nothing is known.
///
/// Features that are each other's most alike give correspondences; sets of them that agree give poses, the best of which
/// are refined on the averaged points and judged by partners on the surface and by points that lie in space which the
/// other camera looked through; where none passes, more poses are looked at once. Clouds with different voxels are brought
/// to the coarser one.
///
/// # Errors
/// [`Error::NoAlignment`] where no pose passes: no overlap, too little structure, or two poses that fit equally well.
/// [`InputError::InvalidOption`](rigid_pose::InputError::InvalidOption).
pub fn align_without_guess(
    source: &FeatureCloud,
    target: &FeatureCloud,
    options: &CoarseOptions,
) -> Result<CoarseAlignment> {
    options.validate()?;
    let (source, target) = with_common_voxels(source, target, options)?;
    let correspondences = correspondences(&source, &target);
    let look = |effort| looked_for(&source, &target, &correspondences, options, effort);
    look(1).or_else(|_| look(SECOND_LOOK))
}

/// The pose that passes, of `effort` times as many candidates and hypotheses as are usual.
fn looked_for(
    source: &FeatureCloud,
    target: &FeatureCloud,
    correspondences: &Correspondences,
    options: &CoarseOptions,
    effort: usize,
) -> Result<CoarseAlignment> {
    let (voxel_m, tolerance) = (target.voxel_m(), tolerance(target, options));
    let verified = verified(source, target, correspondences, options, effort);
    let (winner, rival) = best_two(&verified, voxel_m, source).ok_or(Error::NoAlignment {
        what: "consistent correspondences",
        found: 0.0,
        needed: 1.0,
        correspondences: correspondences.len(),
    })?;
    let common = Common::new(source, target, &winner.pose, options);
    let settled = common.settled(source, target, &winner.pose);
    let (pose, verdict) = (settled.pose, settled.verdict);
    let partners = (winner.verdict.hits + rival.map_or(0, |rival| rival.verdict.hits)) as f64;
    let alignment = CoarseAlignment {
        target_from_source: target.between_frames(source, &pose),
        covariance: settled.covariance,
        shared_error: common.errors.map_or_else(SharedError::default, |errors| errors.shared),
        inliers: correspondences.inliers(&pose, tolerance).len(),
        correspondences: correspondences.len(),
        overlap: verdict.overlap,
        agreement: verdict.agreement(),
        consistency: verdict.consistency(&common.misses),
        inside: common.inside,
        rival: rival.map_or(0.0, |rival| common.misses.draw(winner.evidence - rival.evidence, partners)),
        rms_m: winner.rms_m,
        determined: 1.0 - Distribution::Normal.p_value(SAME_POSE_VOXELS * voxel_m / settled.sigma_m),
        voxel_m,
    };
    alignment.checked(options)
}

/// Poses `target_from_source` that the clouds allow, each different from the others, the best first, with their scores:
/// for those who know more than two clouds and can choose. Nothing is refused here.
pub fn hypotheses(
    source: &FeatureCloud,
    target: &FeatureCloud,
    options: &CoarseOptions,
) -> Result<Vec<(Isometry3<f64>, f64)>> {
    let (source, target) = with_common_voxels(source, target, options)?;
    let (source, target) = (source.as_ref(), target.as_ref());
    let verified = verified(source, target, &correspondences(source, target), options, 1);
    let poses = verified.iter().map(|hypothesis| hypothesis.pose).collect();
    let ranked = ranked(source, target, poses, usize::MAX, |pose| {
        Verdict::with(source, target, pose, 1, super::description::view::Jumps::Missed).rough_score()
    });
    Ok(ranked.iter().map(|(pose, score)| (target.between_frames(source, pose), *score)).collect())
}

/// Distance up to which a correspondence agrees with a pose, metre.
fn tolerance(target: &FeatureCloud, options: &CoarseOptions) -> f32 {
    (options.tolerance_voxels * target.voxel_m()) as f32
}

/// The best poses of the correspondences, refined and judged; `effort` as for [`looked_for`].
fn verified(
    source: &FeatureCloud,
    target: &FeatureCloud,
    correspondences: &Correspondences,
    options: &CoarseOptions,
    effort: usize,
) -> Vec<Hypothesis> {
    let tolerance = tolerance(target, options);
    let candidates = candidates(correspondences, tolerance, effort * MOST_CANDIDATES);
    let ranked = ranked(source, target, candidates, effort * options.max_hypotheses, |pose| {
        // The share of added features that agree counts as much as that of the points: along walls only they can tell.
        let verdict = Verdict::new(source, target, pose, RANKING_STRIDE);
        verdict.rough_score() + correspondences.added_share(pose, tolerance)
    });
    let verify = |(pose, _): &(Isometry3<f64>, f64)| {
        let refined = refine(source, target, pose);
        let verdict = Verdict::new(source, target, &refined.pose, 1);
        let added = verdict.points as f64 * correspondences.added_share(&refined.pose, tolerance);
        Hypothesis { pose: refined.pose, verdict, evidence: verdict.evidence() + added, rms_m: refined.rms_m }
    };
    ranked.par_iter().map(verify).collect()
}

/// A refined pose between the clouds' middles.
struct Hypothesis {
    pose: Isometry3<f64>,
    verdict: Verdict,
    /// Points that speak for it less those that contradict, and what added features say.
    evidence: f64,
    rms_m: f64,
}

fn with_common_voxels<'a>(
    source: &'a FeatureCloud,
    target: &'a FeatureCloud,
    options: &CoarseOptions,
) -> Result<(Cow<'a, FeatureCloud>, Cow<'a, FeatureCloud>)> {
    let (a, b) = (source.voxel_m(), target.voxel_m());
    if a < 0.999 * b {
        Ok((Cow::Owned(source.coarsened(b, options)?), Cow::Borrowed(target)))
    } else if b < 0.999 * a {
        Ok((Cow::Borrowed(source), Cow::Owned(target.coarsened(a, options)?)))
    } else {
        Ok((Cow::Borrowed(source), Cow::Borrowed(target)))
    }
}

/// Matches of all kinds of descriptors, the most alike first of each kind.
fn correspondences(source: &FeatureCloud, target: &FeatureCloud) -> Correspondences {
    let kinds = source.surface_features.len() + source.added.len();
    let share = MOST_CORRESPONDENCES / kinds.max(1);
    let of = |(s, t): (&FeatureSet, &FeatureSet)| {
        let mut found = matches(&s.descriptors, &t.descriptors);
        found.sort_by(|a, b| b.likeness.total_cmp(&a.likeness));
        found.truncate(share);
        found.into_iter().map(|m| [s.places[m.source as usize], t.places[m.target as usize]]).collect::<Vec<_>>()
    };
    let mut rows: Vec<[Place; 2]> = source.surface_features.iter().zip(&target.surface_features).flat_map(of).collect();
    let of_surface = rows.len();
    rows.extend(source.added.iter().zip(&target.added).flat_map(of));
    Correspondences { rows, of_surface }
}

/// Poses of sets of correspondences that agree, each fitted again to all that agree with it.
fn candidates(correspondences: &Correspondences, tolerance: f32, most: usize) -> Vec<Isometry3<f64>> {
    let arm = 2.0 * tolerance;
    let solve = |set: &[u32]| {
        let first = correspondences.solve(set, arm)?;
        let inliers = correspondences.inliers(&first, tolerance);
        let again = if inliers.len() < 3 { None } else { correspondences.solve(&inliers, arm) };
        Some((again.unwrap_or(first), inliers))
    };
    let mut poses = Vec::new();
    ConsistencyGraph::new(correspondences, tolerance).cliques(most, |clique| {
        let Some((pose, inliers)) = solve(clique) else { return Vec::new() };
        poses.push(pose);
        inliers
    });
    poses
}

/// The poses with the best scores, each different from those before, with their scores.
fn ranked(
    source: &FeatureCloud,
    target: &FeatureCloud,
    candidates: Vec<Isometry3<f64>>,
    count: usize,
    score: impl Fn(&Isometry3<f64>) -> f64 + Sync,
) -> Vec<(Isometry3<f64>, f64)> {
    let mut scored: Vec<(Isometry3<f64>, f64)> = candidates.into_par_iter().map(|pose| (pose, score(&pose))).collect();
    scored.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut kept: Vec<(Isometry3<f64>, f64)> = Vec::new();
    for (pose, score) in scored {
        if !kept.iter().any(|(other, _)| is_same(other, &pose, target.voxel_m(), source)) {
            kept.push((pose, score));
        }
        if kept.len() == count {
            break;
        }
    }
    kept
}

/// Whether two poses move no part of the source by more than a few voxels against each other.
fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>, voxel_m: f64, source: &FeatureCloud) -> bool {
    let apart = (a.translation.vector - b.translation.vector).norm();
    let turned = a.rotation.angle_to(&b.rotation) * source.radius_m;
    apart + turned <= SAME_POSE_VOXELS * voxel_m
}

/// The hypothesis with the best score, and the best among those that differ from it.
fn best_two<'a>(
    verified: &'a [Hypothesis],
    voxel_m: f64,
    source: &FeatureCloud,
) -> Option<(&'a Hypothesis, Option<&'a Hypothesis>)> {
    let mut order: Vec<&Hypothesis> = verified.iter().collect();
    order.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let winner = *order.first()?;
    // Refined poses of one basin may end a little apart.
    let rival = order.iter().find(|h| !is_same(&h.pose, &winner.pose, 2.0 * voxel_m, source));
    Some((winner, rival.copied()))
}

impl CoarseAlignment {
    /// The alignment where it passes the thresholds of `options`, for those that were aligned with looser ones.
    ///
    /// # Errors
    /// [`Error::NoAlignment`] with the first threshold that it does not pass.
    pub fn checked(self, options: &CoarseOptions) -> Result<Self> {
        let least = [
            ("overlap", self.overlap, options.min_overlap),
            ("probability of as much contradiction at a right pose", self.consistency, options.level),
            ("structure inside its enclosing planes", self.inside, options.min_inside),
            ("probability that the pose is known", self.determined, options.min_determined),
            // One that must stay small, seen from the other side.
            ("probability that no other pose fits as well", 1.0 - self.rival, 1.0 - options.level),
        ];
        match least.into_iter().find(|(_, value, needed)| value < needed) {
            Some((what, found, needed)) => {
                Err(Error::NoAlignment { what, found, needed, correspondences: self.correspondences })
            }
            None => Ok(self),
        }
    }
}
