//! Pairs of source and target voxels at a pose.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use statistics::mad_scale;

use super::level::Level;
use super::numerics::lattice::Lattice;
use crate::kernel::RobustKernel;
use crate::quality::Cells;
use crate::system::CHUNK;
use rigid_pose::{Centred, MotionEquations};

/// Partners farther apart than this many voxels belong to different things.
const REACH: f64 = 1.5;
/// Share of the offset along the plane by which disagreeing normals make the distance across it unsure.
const LEVER_SHARE: f64 = 0.1;

/// A source voxel and its partner.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub target: u32,
    /// Mean of the source voxel in the target frame.
    pub moved: Vector3<f64>,
    /// Unit vector halfway between the two normals: along it even means at different places of a bent surface have no
    /// distance.
    pub normal: Vector3<f64>,
    pub source_normal: Vector3<f64>,
    pub residual: f64,
    /// Variance of the residual, square metre; infinite where there is no partner.
    pub variance: f64,
    pub count: f64,
}

const ALONE: Pair = Pair {
    target: u32::MAX,
    moved: Vector3::new(0.0, 0.0, 0.0),
    normal: Vector3::new(0.0, 0.0, 0.0),
    source_normal: Vector3::new(0.0, 0.0, 0.0),
    residual: 0.0,
    variance: f64::INFINITY,
    count: 0.0,
};

/// Two levels that are paired.
#[derive(Clone, Copy)]
pub(crate) struct Matcher<'a> {
    pub source: &'a Level,
    pub target: &'a Level,
    pub target_lattice: &'a Lattice,
}

/// Whether partners are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Partners {
    Anew,
    Kept,
}

impl Matcher<'_> {
    /// Largest distance of partners, metre.
    pub fn limit_m(&self) -> f64 {
        REACH * self.target.size_m.max(self.source.size_m)
    }

    /// Fills `pairs`, one for each source voxel.
    pub fn fill(&self, pose: &Isometry3<f64>, partners: Partners, pairs: &mut Vec<Pair>) {
        pairs.resize(self.source.voxels.len(), ALONE);
        pairs.par_chunks_mut(CHUNK).zip(self.source.voxels.par_chunks(CHUNK)).for_each(|(pairs, voxels)| {
            for (pair, voxel) in pairs.iter_mut().zip(voxels) {
                if voxel.variance < f64::INFINITY {
                    let moved = pose * voxel.mean;
                    let normal = pose.rotation * voxel.normal;
                    let target = match partners {
                        Partners::Kept => Some(pair.target as usize),
                        Partners::Anew => self.target.partner(self.target_lattice, &moved, &normal),
                    };
                    *pair = target
                        .and_then(|t| self.pair(t, moved.coords, normal, voxel.variance, voxel.count))
                        .unwrap_or(ALONE);
                } else {
                    *pair = ALONE;
                }
            }
        });
    }

    #[inline]
    fn pair(&self, index: usize, moved: Vector3<f64>, normal: Vector3<f64>, variance: f64, count: f64) -> Option<Pair> {
        let target = self.target.voxels.get(index)?;
        let source_normal = if normal.dot(&target.normal) < 0.0 { -normal } else { normal };
        let both = source_normal + target.normal;
        let bisector = both / both.norm();
        let offset = moved - target.mean.coords;
        let square = offset.norm_squared();
        let limit = self.limit_m();
        if square.is_nan() || square > limit * limit {
            return None;
        }
        let lever = LEVER_SHARE * (source_normal - target.normal).norm_squared() * square;
        let variance = variance + target.variance + lever;
        let residual = bisector.dot(&offset);
        Some(Pair { target: index as u32, moved, normal: bisector, source_normal, residual, variance, count })
    }
}

/// Pairs with a kernel, ready to be summed.
pub(crate) struct System<'a> {
    pub pairs: &'a [Pair],
    pub frame: Centred,
    pub count: usize,
    kernel: RobustKernel,
    /// Standard deviation of a whitened residual.
    scale: f64,
}

impl<'a> System<'a> {
    pub fn new(pairs: &'a [Pair], kernel: RobustKernel, scratch: &mut Vec<f64>) -> Self {
        scratch.clear();
        scratch.extend(matched(pairs).map(|pair| pair.residual.abs() / pair.variance.sqrt()));
        let frame = Centred::about(matched(pairs).map(|pair| pair.moved), f64::MIN_POSITIVE.sqrt());
        Self { pairs, frame, count: scratch.len(), kernel, scale: mad_scale(scratch).max(0.0) }
    }

    /// Weight of a pair and the slope of its influence, both over its variance.
    #[inline]
    fn weights(&self, pair: &Pair) -> (f64, f64) {
        let precision = 1.0 / pair.variance;
        // Without any scatter every residual is exact.
        if self.scale <= 1e-12 {
            return (precision, precision);
        }
        let u = pair.residual / (pair.variance.sqrt() * self.scale);
        (self.kernel.weight(u) * precision, self.kernel.influence_slope(u) * precision)
    }

    /// Normal equations, summed in fixed chunks.
    pub fn normal_equations(&self) -> MotionEquations {
        let unit = self.frame.radius_m.powi(2);
        let of_chunk = |chunk: &[Pair]| {
            let mut equations = MotionEquations::default();
            for pair in matched(chunk) {
                let derivative = self.frame.derivative(&pair.moved, &pair.normal);
                equations.add(&derivative, self.weights(pair).0 * unit, pair.residual);
            }
            equations
        };
        self.pairs.par_chunks(CHUNK).map(of_chunk).collect::<Vec<_>>().into_iter().sum()
    }

    /// What the pairs say about the pose, those in a cube of `cell_m` as one observation.
    pub fn cells(&self, target: &Level, cell_m: f64) -> Cells {
        let unit = self.frame.radius_m.powi(2);
        let mut cells = Cells::new(self.frame, cell_m);
        for pair in matched(self.pairs) {
            let (weight, slope) = self.weights(pair);
            let a = self.frame.derivative(&pair.moved, &target.voxels[pair.target as usize].normal);
            let b = self.frame.derivative(&pair.moved, &pair.source_normal);
            let score = self.frame.derivative(&pair.moved, &pair.normal) * (weight * unit * pair.residual);
            *cells.add(&pair.moved, &score) += (a * b.transpose() + b * a.transpose()) * (0.5 * slope * unit);
        }
        cells
    }

    /// Root mean square residual, weighted by the kernel, metre.
    pub fn rms_m(&self) -> f64 {
        let (mut squares, mut total) = (0.0, 0.0);
        for pair in matched(self.pairs) {
            let weight = self.weights(pair).0 * pair.variance;
            squares += weight * pair.residual.powi(2);
            total += weight;
        }
        if total > 0.0 { (squares / total).sqrt() } else { f64::NAN }
    }
}

pub(crate) fn matched(pairs: &[Pair]) -> impl Iterator<Item = &Pair> + Clone {
    pairs.iter().filter(|p| p.variance < f64::INFINITY)
}
