//! Normal equations of the common errors, from the places that several frames see.
//!
//! The observation of a frame at a place is `h = [1 s t] x + d c + ε`: x is the place's plane, d the derivative of the
//! height by the common errors c. The planes are eliminated place by place; nothing smooths one place by the next.

use std::sync::LazyLock;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use point_uncertainty::{CommonErrors, PointErrors};
use rayon::prelude::*;
use statistics::Distribution;

use super::rows::{Row, by_station, rows};
use crate::Result;
use crate::input::{NO_NEIGHBOURHOOD, Observations};
use crate::patches::largest_sum;
use crate::surfels::{Estimate, FrameSums, Gathered, Spread, bends, estimate, runs};

/// Multiplications that the equations may take, a second or two of one processor. Places beyond are left out evenly: the
/// common errors are then known a little less well, and as well as stated.
const MOST_PRODUCTS: f64 = 3e9;
/// Parts that are summed up side by side; fixed, as it decides the order of the sums.
const PARTS: usize = 8;
/// Probability that a place of which all frames see the same is left out of the equations once they are solved. Larger ones waste
/// places, smaller ones let edges in.
const LEVEL: f64 = 0.01;
/// Weight of the inclination that a place has before: next to nothing, as the normal that it is counted from comes from the same
/// points. Larger: frames that see different parts of a cell seem to tell more than they do.
const TILT: f64 = 0.01;

/// Normal matrix and right side.
pub(crate) struct Equations {
    pub normal: DMatrix<f64>,
    pub right: DVector<f64>,
}

/// How many places each neighbourhood serves: what it shares counts so many times as much at each of them, so that places which
/// are taken as independent know together no more than they do.
struct Shared {
    /// In ascending order.
    places: Vec<(u64, f64)>,
}

impl Spread for Shared {
    fn factor(&self, neighbourhood: u64) -> f64 {
        self.places.binary_search_by_key(&neighbourhood, |(id, _)| *id).map_or(1.0, |at| self.places[at].1)
    }
}

impl Shared {
    fn new(gathered: &Gathered, observations: &Observations) -> Self {
        let all = &observations.all;
        let by_place: Vec<Vec<(u64, f64)>> = gathered
            .members
            .par_iter()
            .zip(&gathered.seeds)
            .with_min_len(64)
            .map(|(members, (_, seed))| {
                let keyed = runs(members, all);
                let of_neighbourhoods = keyed.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
                let shared = of_neighbourhoods.filter(|run| run[0].1 != NO_NEIGHBOURHOOD);
                let weight = |run: &[(u32, u64, u32)]| -> f64 {
                    run.iter().map(|(_, _, at)| 1.0 / seed.noise(&all[*at as usize])).sum()
                };
                shared.map(|run| (run[0].1, weight(run))).collect()
            })
            .collect();
        let mut weights: Vec<(u64, f64)> = by_place.into_iter().flatten().collect();
        weights.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let factor = |run: &[(u64, f64)]| {
            let sum: f64 = run.iter().map(|(_, weight)| weight).sum();
            sum * sum / run.iter().map(|(_, weight)| weight * weight).sum::<f64>()
        };
        Self { places: weights.chunk_by(|a, b| a.0 == b.0).map(|run| (run[0].0, factor(run))).collect() }
    }
}

/// Places that frames see together, with the derivatives of what each frame sees.
pub(crate) type Ties = Vec<(Estimate, Vec<Row>)>;

/// The flat places that frames see together: beside edges and on bent surfaces frames see different heights without error.
pub(crate) fn ties(
    gathered: &Gathered,
    observations: &Observations,
    errors: &dyn PointErrors,
    common: &CommonErrors,
) -> Result<Ties> {
    let shared = Shared::new(gathered, observations);
    let around = bends(&gathered.seeds, &gathered.estimates, observations.lattice.size_m);
    let seen: Vec<usize> = (0..gathered.members.len())
        .filter(|at| gathered.estimates[*at].frames.len() > 1 && around[*at].is_flat)
        .collect();
    // About the number of columns that a frame moves its points by.
    let columns = 16.0;
    let cost = |at: &usize| {
        let frames = gathered.estimates[*at].frames.len() as f64;
        let union = (frames * columns).min(common.errors().len() as f64);
        frames * columns * columns + 3.0 * union * union
    };
    let stride = (seen.iter().map(cost).sum::<f64>() / MOST_PRODUCTS).ceil().max(1.0) as usize;
    let used: Vec<usize> = seen.into_iter().step_by(stride).collect();
    let tie = |at: &usize| {
        let place = estimate(&gathered.seeds[*at].1, &gathered.members[*at], &observations.all, &shared)?;
        let rows = rows(&place, &around[*at].normal, &observations.all, errors, common);
        let tie = rows.map(|rows| by_station(&place, &rows).unwrap_or((place, rows)));
        Some(tie).filter(|tie| tie.as_ref().map_or(true, |(place, _)| place.frames.len() > 1))
    };
    used.par_iter().with_min_len(32).filter_map(tie).collect()
}

impl Equations {
    /// Of those places that fit together where the common errors have these values; they count by so much.
    pub fn new(ties: &Ties, size: usize, values: Option<&DVector<f64>>, trust: f64) -> Self {
        let nothing = || Self { normal: DMatrix::zeros(size, size), right: DVector::zeros(size) };
        let parts: Vec<Self> = ties
            .par_chunks(ties.len().div_ceil(PARTS).max(1))
            .map(|part| {
                let mut sum = nothing();
                let fitting = part.iter().filter(|(place, rows)| {
                    values.is_none_or(|values| residuals(place, rows, values).is_some_and(|sums| fits(place, &sums)))
                });
                fitting.for_each(|(place, rows)| sum.add(place, rows));
                sum
            })
            .collect();
        let mut all = nothing();
        for part in parts {
            all.normal += part.normal * trust;
            all.right += part.right * trust;
        }
        all
    }

    /// Adds a place, its plane eliminated.
    fn add(&mut self, place: &Estimate, rows: &[Row]) {
        let mut columns: Vec<u32> = rows.iter().flatten().map(|(column, _)| *column).collect();
        columns.sort_unstable();
        columns.dedup();
        let position = |column: u32| columns.partition_point(|other| *other < column);
        let prior = Matrix3::from_diagonal(&Vector3::new(0.0, TILT, TILT));
        let plane: Matrix3<f64> = place.frames.iter().map(|f| f.normal).sum::<Matrix3<f64>>() + prior;
        let of_plane: Vector3<f64> = place.frames.iter().map(|f| f.right).sum();
        let Some(inverse) = plane.try_inverse() else { return };
        let mut with_plane = vec![Vector3::zeros(); columns.len()];
        let local: Vec<Vec<(usize, f64)>> =
            rows.iter().map(|row| row.iter().map(|(column, by)| (position(*column), *by)).collect()).collect();
        for (frame, row) in place.frames.iter().zip(&local) {
            let first: Vector3<f64> = frame.normal.column(0).into();
            for (column, by) in row {
                with_plane[*column] += first * *by;
                self.right[columns[*column] as usize] += by * frame.right[0];
                for (other, with) in row {
                    self.normal[(columns[*other] as usize, columns[*column] as usize)] += by * with * first[0];
                }
            }
        }
        let solution = inverse * of_plane;
        for (column, first) in columns.iter().zip(&with_plane) {
            self.right[*column as usize] -= first.dot(&solution);
            let reduced = inverse * first;
            for (row, second) in columns.iter().zip(&with_plane) {
                self.normal[(*row as usize, *column as usize)] -= reduced.dot(second);
            }
        }
    }
}

/// Whether all frames see a place at one height, common errors of these values taken off. Beside edges that nothing shows,
/// frames do not, and thousands of places would make a small error of each a certain one of the poses.
pub(super) fn fits(place: &Estimate, residuals: &[f64]) -> bool {
    static DEVIATIONS: LazyLock<f64> = LazyLock::new(|| Distribution::Normal.upper_quantile(LEVEL));
    let square = |(frame, sum): (&FrameSums, &f64)| sum * sum / frame.normal[(0, 0)];
    let found: f64 = place.frames.iter().zip(residuals).map(square).sum();
    found <= largest_sum(residuals.len() as f64 - 1.0, *DEVIATIONS)
}

/// For each frame the weighted sum of its heights over the plane of all, common errors of these values taken off.
pub(super) fn residuals(place: &Estimate, rows: &[Row], values: &DVector<f64>) -> Option<Vec<f64>> {
    let rights: Vec<Vector3<f64>> = place
        .frames
        .iter()
        .zip(rows)
        .map(|(frame, row)| {
            let shift: f64 = row.iter().map(|(column, by)| by * values[*column as usize]).sum();
            frame.right - frame.normal.column(0) * shift
        })
        .collect();
    let prior = Matrix3::from_diagonal(&Vector3::new(0.0, TILT, TILT));
    let normal = place.frames.iter().map(|f| f.normal).sum::<Matrix3<f64>>() + prior;
    let plane = normal.try_inverse()? * rights.iter().sum::<Vector3<f64>>();
    let sum = |(frame, right): (&FrameSums, &Vector3<f64>)| right[0] - frame.normal.row(0).transpose().dot(&plane);
    Some(place.frames.iter().zip(&rights).map(sum).collect())
}
