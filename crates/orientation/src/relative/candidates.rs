//! Poses that five pairs allow, and how all pairs judge them.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use statistics::chi_squared_limit;

use crate::relative::epipolar::EpipolarCondition;
use crate::relative::five_points::essential_matrices;
use crate::relative::rays::Pair;

/// Pairs of a sample.
pub(crate) const SAMPLE: usize = 5;
/// Samples tried at most. Of 30 % wrong pairs 17 % of the samples are free, and none of 100 with a probability of 1e-8;
/// more cost time, fewer find a worse start where noise is large.
const SAMPLES: usize = 100;
/// Square of a standardised residual beyond which it does not count more, `[Torr2000]`: one right pair in a thousand lies there.
pub(crate) const CUT: f64 = 10.83;
/// Level of tests: a right answer fails one once in a thousand.
pub(crate) const LEVEL: f64 = 0.001;
/// Distinct candidates that are worth an adjustment: ten solutions of five pairs, and some to spare.
const MOST: usize = 12;
/// Candidates nearer to each other than this (radian; attitude, and direction of the base) belong to one minimum.
pub(crate) const SAME_ANGLE: f64 = 0.1;

/// How badly a pose fits: squares of standardised residuals, each cut where it is that of a gross error.
pub(crate) fn cost(pairs: &[Pair], first_from_second: &Isometry3<f64>) -> f64 {
    let square = |pair: &Pair| {
        if pair.parts(first_from_second) {
            return CUT;
        }
        EpipolarCondition::new(pair).standardised(first_from_second).powi(2).min(CUT)
    };
    pairs.iter().map(square).sum()
}

/// The same of pairs that are no gross errors: squares of their standardised residuals, infinite where rays part.
pub(crate) fn squares(pairs: &[Pair], first_from_second: &Isometry3<f64>) -> f64 {
    let square = |pair: &Pair| {
        let parts = pair.parts(first_from_second);
        if parts { f64::INFINITY } else { EpipolarCondition::new(pair).standardised(first_from_second).powi(2) }
    };
    pairs.iter().map(square).sum()
}

/// Whether a second minimum explains the observations as well as the best: what each costs, values that are left out taken
/// off, redundancy and variance factor of the best.
///
/// It does where its cost is hardly larger. And it does where it is one that noise alone would make, and differs from that of
/// the best by no more than two such sums do: the two poses of a flat field follow the noise in different ways, and the variance
/// of the difference of two sums of r squares is up to 4 r.
pub(crate) fn rivals([best, second]: [f64; 2], redundancy: f64, variance_factor: f64) -> bool {
    let difference = (second - best) / variance_factor;
    let by_noise = second / variance_factor <= chi_squared_limit(redundancy, LEVEL);
    difference < CUT || by_noise && difference < CUT.sqrt() * (4.0 * redundancy).sqrt()
}

/// Distinct poses from samples of five pairs, the one that fits best first.
pub(crate) fn candidates(pairs: &[Pair], seed: u64) -> Vec<Isometry3<f64>> {
    let mut found: Vec<(f64, Isometry3<f64>)> = Vec::new();
    for sample in samples::<SAMPLE>(pairs.len(), seed) {
        let rays = sample.map(|i| [pairs[i].first.direction, pairs[i].second.direction]);
        for essential in essential_matrices(&rays) {
            let Some(pose) = pose(&essential, &sample.map(|i| pairs[i])) else { continue };
            found.push((cost(pairs, &pose), pose));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut distinct: Vec<Isometry3<f64>> = Vec::new();
    for (_, pose) in found {
        if distinct.len() < MOST && distinct.iter().all(|other| !is_same(&pose, other, SAME_ANGLE)) {
            distinct.push(pose);
        }
    }
    distinct
}

/// Whether two poses differ by no more than an angle (radian), in attitude and in the direction of the base.
pub(crate) fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>, angle: f64) -> bool {
    a.rotation.angle_to(&b.rotation) <= angle && a.translation.vector.angle(&b.translation.vector) <= angle
}

/// Samples of different items: all where these are few, else by chance.
pub(crate) fn samples<const SIZE: usize>(count: usize, seed: u64) -> Vec<[usize; SIZE]> {
    let all = (0..SIZE).fold(1, |product: usize, k| product.saturating_mul(count.saturating_sub(k)) / (k + 1));
    if all <= SAMPLES {
        return combinations(count);
    }
    let mut random = Pcg64::seed_from_u64(seed);
    let mut draw = || {
        let mut chosen = BTreeSet::new();
        while chosen.len() < SIZE {
            chosen.insert(random.random_range(0..count));
        }
        let mut sample = [0; SIZE];
        sample.iter_mut().zip(chosen).for_each(|(place, index)| *place = index);
        sample
    };
    (0..SAMPLES).map(|_| draw()).collect()
}

/// All samples.
fn combinations<const SIZE: usize>(count: usize) -> Vec<[usize; SIZE]> {
    let mut out = Vec::new();
    let mut sample: [usize; SIZE] = std::array::from_fn(|k| k);
    while sample.last().is_some_and(|last| *last < count) {
        out.push(sample);
        // The last place that can still grow grows, those behind it follow closely.
        let Some(place) = (0..SIZE).rev().find(|&k| sample[k] + SIZE - k < count) else { break };
        sample[place] += 1;
        for k in place + 1..SIZE {
            sample[k] = sample[k - 1] + 1;
        }
    }
    out
}

/// Of the four poses of an essential matrix that for which most of the rays meet in front of both cameras.
fn pose(essential: &Matrix3<f64>, pairs: &[Pair]) -> Option<Isometry3<f64>> {
    let svd = essential.try_svd(true, true, f64::EPSILON, 1000)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let base: Vector3<f64> = u.column(2).into_owned();
    let in_front =
        |pose: &Isometry3<f64>| pairs.iter().filter(|pair| pair.depths(pose).iter().all(|depth| *depth > 0.0)).count();
    let rotations = [u * quarter * v_t, u * quarter.transpose() * v_t];
    let poses = rotations.into_iter().flat_map(|matrix| {
        let rotation = Rotation3::from_matrix_unchecked(matrix * matrix.determinant().signum());
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        [base, -base].map(|base| Isometry3::from_parts(Translation3::from(base), rotation))
    });
    poses.max_by_key(in_front).filter(|pose| pose.translation.vector.norm().is_finite())
}
