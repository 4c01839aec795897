//! Start values: weights of Gaussians of given widths are a linear problem, which is solved for all combinations of
//! widths.

use nalgebra::{DMatrix, DVector};

use crate::estimate::search::fit::{Problem, StartTerm, Unknown};
use crate::estimate::search::response::Term;
use crate::estimate::search::scene::{BlockMean, Row, Scene};
use crate::estimate::views::planes::Planes;

/// Widths of the dictionary.
const WIDTHS: usize = 9;
/// Narrowest width, in pixels or blocks, whichever is more.
const NARROWEST_PX: f64 = 2.0;
const NARROWEST_BLOCKS: f64 = 0.7;
/// Widest width as a share of the longer side of the image. Only a start.
const WIDEST: f64 = 0.6;

/// Normal equations of all dictionary widths, the nuisances of each scene reduced.
pub(in crate::estimate) struct Dictionary {
    widths: Vec<f64>,
    normal: DMatrix<f64>,
    right: DVector<f64>,
    /// For each scene what each width scatters; nothing where there is no light.
    pub(in crate::estimate) lights: Vec<Vec<Planes>>,
    /// See [`Dictionary::scale`].
    scale: f64,
}

impl Dictionary {
    pub(in crate::estimate) fn new(problem: &Problem<'_>) -> Self {
        let widths = widths(problem);
        let count = widths.len();
        let (normal, right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let of_scene = |scene: &&Scene| -> Vec<Planes> {
            let source = scene.source.as_ref().ok();
            source
                .map_or_else(Vec::new, |source| widths.iter().filter_map(|&width| source.first_order(width)).collect())
        };
        let lights: Vec<Vec<Planes>> = problem.scenes.iter().map(of_scene).collect();
        let lit = problem.scenes.iter().zip(&lights).filter(|(_, lights)| lights.len() == count);
        let design_of = |(scene, lights): (&&Scene, &Vec<Planes>)| design(problem, scene, lights, None);
        let parts: Vec<_> = lit.map(|part| without_nuisances(design_of(part), count)).collect();
        let mut out = Self { normal, right, widths, lights, scale: 1.0 };
        for (matrix, observed) in &parts {
            out.normal += matrix.tr_mul(matrix);
            out.right += matrix.tr_mul(observed);
        }
        out.scale = out.residual_scale(&parts);
        out
    }

    /// How many times larger than noise says the residuals of the best sum of all Gaussians are, whatever the signs of
    /// their weights; at least one. From the median: outliers do not count.
    pub(in crate::estimate) fn scale(&self) -> f64 {
        self.scale
    }

    fn residual_scale(&self, parts: &[(DMatrix<f64>, DVector<f64>)]) -> f64 {
        /// Neighbouring widths differ little; without a ridge their sum would not be determined.
        const RIDGE: f64 = 1.0 + 1e-9;
        let mut matrix = self.normal.clone();
        (0..matrix.nrows()).for_each(|index| matrix[(index, index)] *= RIDGE);
        let Some(weights) = matrix.cholesky().map(|factor| factor.solve(&self.right)) else { return 1.0 };
        let mut sizes = Vec::new();
        for (matrix, observed) in parts {
            sizes.extend((observed - matrix * &weights).iter().map(|residual| residual.abs()));
        }
        let scale = statistics::mad_scale(&mut sizes);
        if scale > 1.0 && scale.is_finite() { scale } else { 1.0 }
    }

    /// The best combination of `count` widths whose weights are all positive.
    pub(in crate::estimate) fn start(&self, count: usize) -> Option<Vec<StartTerm>> {
        let mut best: Option<(f64, Vec<StartTerm>)> = None;
        for chosen in combinations(self.widths.len(), count) {
            let Some((weights, gain)) = self.solve(&chosen) else { continue };
            let better = best.as_ref().is_none_or(|(known, _)| gain > *known);
            if better && weights.iter().all(|weight| *weight > 0.0) {
                let start = |(&index, &weight): (&usize, &f64)| {
                    let term = Term { weight: weight.min(0.3), sigma_px: [self.widths[index]; 2] };
                    StartTerm { term, unknown: Unknown::WeightAndWidth }
                };
                best = Some((gain, chosen.iter().zip(weights.iter()).map(start).collect()));
            }
        }
        best.map(|(_, start)| start)
    }

    /// Largest standard deviation that the weight of a single Gaussian would have, over all widths of the dictionary from
    /// `narrowest` on; infinite where there is none.
    pub(in crate::estimate) fn weight_sigma(&self, narrowest: f64) -> f64 {
        let wide = (0..self.widths.len()).filter(|&index| self.widths[index] >= narrowest);
        let variances = wide.map(|index| 1.0 / self.normal[(index, index)]);
        let larger = |largest: f64, value: f64| if value <= largest { largest } else { value };
        variances.reduce(larger).map_or(f64::INFINITY, f64::sqrt)
    }

    /// Weights, and by how much they reduce the sum of squares.
    fn solve(&self, chosen: &[usize]) -> Option<(DVector<f64>, f64)> {
        let n = chosen.len();
        let scale: Vec<f64> = chosen.iter().map(|&i| self.normal[(i, i)].sqrt()).collect();
        if scale.iter().any(|scale| !(scale.is_finite() && *scale > 0.0)) {
            return None;
        }
        let matrix = DMatrix::from_fn(n, n, |i, j| self.normal[(chosen[i], chosen[j])] / (scale[i] * scale[j]));
        let right = DVector::from_fn(n, |i, _| self.right[chosen[i]] / scale[i]);
        let scaled = matrix.cholesky()?.solve(&right);
        let gain = scaled.dot(&right);
        Some((DVector::from_fn(n, |i, _| scaled[i] / scale[i]), gain))
    }
}

/// Geometric sequence from the narrowest that blocks resolve to the widest that the image shows.
fn widths(problem: &Problem<'_>) -> Vec<f64> {
    let edge = problem.scenes.iter().filter_map(|scene| scene.source.as_ref().ok()).map(|s| s.blocks.edge as f64);
    let narrowest = NARROWEST_PX.max(NARROWEST_BLOCKS * edge.fold(1.0, f64::max));
    let widest = (WIDEST * problem.longer_side).max(1.5 * narrowest);
    let ratio = (widest / narrowest).powf(1.0 / (WIDTHS - 1) as f64);
    (0..WIDTHS).map(|index| narrowest * ratio.powi(index as i32)).collect()
}

/// What is known already of a scene: scattered light, and the weight of each block mean.
pub(in crate::estimate) struct Known<'k> {
    pub(in crate::estimate) scattered: &'k Planes,
    pub(in crate::estimate) weights: &'k [f64],
}

/// Whitened columns: scattered lights, nuisances, and what is observed beyond that which is known.
pub(in crate::estimate) fn design(
    problem: &Problem<'_>,
    scene: &Scene,
    lights: &[Planes],
    known: Option<&Known<'_>>,
) -> Vec<DVector<f64>> {
    let weights = known.map_or(&[][..], |known| known.weights).iter().copied().chain(std::iter::repeat(1.0));
    let means = scene.means.iter().zip(weights);
    let rows: Vec<(&BlockMean, &Row, f64)> =
        means.flat_map(|(mean, w)| mean.rows.iter().map(move |row| (mean, row, w.sqrt() / mean.sigma))).collect();
    let seen = |mean: &BlockMean, row: &Row, light: &Planes| {
        let at = (mean.block[0], mean.block[1]);
        row.light[0] * light.real[at] + row.light[1] * light.imaginary[at]
    };
    let column = |value: &dyn Fn(&BlockMean, &Row) -> f64| {
        DVector::from_iterator(rows.len(), rows.iter().map(|(mean, row, factor)| value(mean, row) * factor))
    };
    let mut columns: Vec<_> = lights.iter().map(|light| column(&|mean, row| seen(mean, row, light))).collect();
    for of in problem.nuisance_rows() {
        for part in 0..2 {
            columns.push(column(&|_, row| of(row)[part]));
        }
    }
    let explained = |mean: &BlockMean, row: &Row| known.map_or(0.0, |known| seen(mean, row, known.scattered));
    columns.push(column(&|mean, row| row.observed - explained(mean, row)));
    columns
}

/// Takes the nuisances off the columns of the widths and the observed values, one after the other.
pub(in crate::estimate) fn without_nuisances(
    mut columns: Vec<DVector<f64>>,
    widths: usize,
) -> (DMatrix<f64>, DVector<f64>) {
    let observed = columns.pop().unwrap_or_else(|| DVector::zeros(0));
    let mut nuisances = columns.split_off(widths.min(columns.len()));
    let mut kept = columns;
    kept.push(observed);
    while let Some(nuisance) = nuisances.pop() {
        let square = nuisance.norm_squared();
        if square <= 0.0 {
            continue;
        }
        for column in kept.iter_mut().chain(&mut nuisances) {
            let share = nuisance.dot(column) / square;
            column.axpy(-share, &nuisance, 1.0);
        }
    }
    let observed = kept.pop().unwrap_or_else(|| DVector::zeros(0));
    let matrix = if kept.is_empty() { DMatrix::zeros(observed.len(), 0) } else { DMatrix::from_columns(&kept) };
    (matrix, observed)
}

/// All choices of `count` of the numbers below `n`, in order.
fn combinations(n: usize, count: usize) -> Vec<Vec<usize>> {
    let mut out: Vec<Vec<usize>> = vec![Vec::new()];
    for _ in 0..count {
        let longer = |chosen: &Vec<usize>| {
            let next = chosen.last().map_or(0, |last| last + 1);
            let chosen = chosen.clone();
            (next..n).map(move |index| chosen.iter().copied().chain([index]).collect())
        };
        out = out.iter().flat_map(longer).collect();
    }
    out
}
