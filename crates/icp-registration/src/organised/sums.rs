//! Sums over pairs: in single precision within a chunk, in double precision over chunks in a fixed order.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::pairs::{Locate, Moved, Pairs, Rules, WithLocate, with_locate};

/// Pairs taken at a time.
const BLOCK: usize = 8;
/// Points of a chunk: sums in single precision stay short.
const CHUNK: usize = 256;
/// Chunks that one thread takes at least.
const CHUNKS_PER_TASK: usize = 16;
/// 21 products of the derivatives, 6 with the residual, and the sums of weight, weighted squares and pairs.
pub(super) const SUMS: usize = 30;

/// Normal equations of motions `[dt, rho w]` about the centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normal {
    pub matrix: Matrix6<f64>,
    pub gradient: Vector6<f64>,
    /// Sum of the weights, 1/m².
    pub weight: f64,
    /// Weighted sum of the squared residuals.
    pub square: f64,
    pub pairs: usize,
}

/// Sums of the first `count` points of the source.
pub(super) fn normal_equations(
    moved: &Moved<'_>,
    rules: &Rules,
    count: usize,
    chunks: &mut Vec<[f64; SUMS]>,
) -> Normal {
    chunks.resize(count.div_ceil(CHUNK), [0.0; SUMS]);
    with_locate(moved.target, AllChunks { moved, rules, count, chunks });
    let mut total = [0.0; SUMS];
    for chunk in chunks.iter() {
        for (t, c) in total.iter_mut().zip(chunk) {
            *t += c;
        }
    }
    let mut matrix = Matrix6::zeros();
    let mut k = 0;
    for r in 0..6 {
        for c in r..6 {
            matrix[(r, c)] = total[k];
            matrix[(c, r)] = total[k];
            k += 1;
        }
    }
    let gradient = Vector6::from_fn(|i, _| total[21 + i]);
    Normal { matrix, gradient, weight: total[27], square: total[28], pairs: total[29] as usize }
}

struct AllChunks<'a, 'b> {
    moved: &'a Moved<'b>,
    rules: &'a Rules,
    count: usize,
    chunks: &'a mut [[f64; SUMS]],
}

impl WithLocate for AllChunks<'_, '_> {
    type Output = ();

    fn run<L: Locate>(self, locate: L) {
        let (moved, rules, count) = (self.moved, self.rules, self.count);
        let work = |(k, sums): (usize, &mut [f64; SUMS])| {
            let (first, end) = (k * CHUNK, ((k + 1) * CHUNK).min(count));
            pulp::Arch::new().dispatch(Chunk { moved, rules, locate, first, end, sums });
        };
        if self.chunks.len() < 2 * CHUNKS_PER_TASK {
            self.chunks.iter_mut().enumerate().for_each(work);
        } else {
            self.chunks.par_iter_mut().enumerate().with_min_len(CHUNKS_PER_TASK).for_each(work);
        }
    }
}

struct Chunk<'a, 'b, L> {
    moved: &'a Moved<'b>,
    rules: &'a Rules,
    locate: L,
    first: usize,
    end: usize,
    sums: &'a mut [f64; SUMS],
}

impl<L: Locate> pulp::WithSimd for Chunk<'_, '_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let mut lanes = [[0.0_f32; BLOCK]; SUMS];
        let whole = (self.end - self.first) / BLOCK * BLOCK + self.first;
        for start in (self.first..whole).step_by(BLOCK) {
            add(&mut lanes, &self.moved.pairs::<L, BLOCK>(self.locate, self.rules, start));
        }
        let mut rest = [[0.0_f32; 1]; SUMS];
        for start in whole..self.end {
            add(&mut rest, &self.moved.pairs::<L, 1>(self.locate, self.rules, start));
        }
        for (k, sum) in self.sums.iter_mut().enumerate() {
            *sum = f64::from(lanes[k].iter().sum::<f32>()) + f64::from(rest[k][0]);
        }
    }
}

#[inline(always)]
fn add<const N: usize>(sums: &mut [[f32; N]; SUMS], pairs: &Pairs<N>) {
    let row = derivatives(&pairs.lever, &pairs.normal);
    let mut k = 0;
    for r in 0..6 {
        let mut weighted = [0.0; N];
        for l in 0..N {
            weighted[l] = row[r][l] * pairs.weight[l];
        }
        for other in &row[r..] {
            for l in 0..N {
                sums[k][l] += weighted[l] * other[l];
            }
            k += 1;
        }
        for l in 0..N {
            sums[21 + r][l] += weighted[l] * pairs.residual[l];
        }
    }
    for l in 0..N {
        sums[27][l] += pairs.weight[l];
        sums[28][l] += pairs.weight[l] * pairs.residual[l] * pairs.residual[l];
        sums[29][l] += if pairs.weight[l] > 0.0 { 1.0 } else { 0.0 };
    }
}

/// Derivatives of the distance along `normal` by `[dt, rho w]`: the normal and lever x normal; zero where NaN.
#[inline(always)]
pub(super) fn derivatives<const N: usize>(lever: &[[f32; N]; 3], normal: &[[f32; N]; 3]) -> [[f32; N]; 6] {
    let mut rows = [[0.0; N]; 6];
    for l in 0..N {
        let known = normal[0][l] == normal[0][l];
        let n = [0, 1, 2].map(|i| if known { normal[i][l] } else { 0.0 });
        let q = [0, 1, 2].map(|i| if known { lever[i][l] } else { 0.0 });
        rows[0][l] = n[0];
        rows[1][l] = n[1];
        rows[2][l] = n[2];
        rows[3][l] = q[1] * n[2] - q[2] * n[1];
        rows[4][l] = q[2] * n[0] - q[0] * n[2];
        rows[5][l] = q[0] * n[1] - q[1] * n[0];
    }
    rows
}

/// Absolute residuals over their standard deviation of about `most` of the first `count` points, into `out`.
pub(super) fn residuals(moved: &Moved<'_>, rules: &Rules, count: usize, most: usize, out: &mut Vec<f64>) {
    out.clear();
    with_locate(moved.target, Residuals { moved, rules, count, most, out });
}

struct Residuals<'a, 'b> {
    moved: &'a Moved<'b>,
    rules: &'a Rules,
    count: usize,
    most: usize,
    out: &'a mut Vec<f64>,
}

impl WithLocate for Residuals<'_, '_> {
    type Output = ();

    fn run<L: Locate>(self, locate: L) {
        // Blocks spread evenly over the points.
        let step = (self.count.div_ceil(self.most.max(1)) * BLOCK).max(BLOCK);
        for start in (0..(self.count + 1).saturating_sub(BLOCK)).step_by(step) {
            let pairs = self.moved.pairs::<L, BLOCK>(locate, self.rules, start);
            for k in 0..BLOCK {
                if pairs.weight[k] > 0.0 {
                    self.out.push(f64::from((pairs.residual[k] * pairs.residual[k] / pairs.variance[k]).sqrt()));
                }
            }
        }
    }
}
