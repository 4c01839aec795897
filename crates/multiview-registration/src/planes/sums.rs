//! Sums over the points of a station in a tile, from which all normal equations are made.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::planes::sightings::KERNEL;
use icp_registration::TUKEY;

/// Fewest degrees of freedom that tell how much noise derivatives share with distances.
const FEWEST_FREE: f64 = 5.0;
/// Ratio of the spreads of a tile's points, squared, below which they lie on a line.
const NARROW: f64 = 1e-3;

/// Sums over the points of a station in a tile. With `φ = [1, u, v, derivatives by the shared parameters]` and the
/// distance ρ of a point from its shared plane: `Σ w φ φᵀ` (lower triangle, row by row) and `Σ w φ ρ`.
#[derive(Debug, Clone)]
pub(crate) struct Sums {
    pub order: usize,
    /// The tiles that the station saw something of, and where their sums begin; ascending once all points are added.
    begins: Vec<(u32, u32)>,
    /// The same by tile, while points are added.
    open: HashMap<u32, u32>,
    values: Vec<f64>,
}

impl Sums {
    pub(crate) fn new(parameters: usize) -> Self {
        Self { order: 3 + parameters, begins: Vec::new(), open: HashMap::new(), values: Vec::new() }
    }

    /// Products, right sides, number of points.
    fn stride(order: usize) -> usize {
        order * (order + 1) / 2 + order + 1
    }

    pub fn add(&mut self, tile: usize, phi: &[f64], rho: f64, weight: f64) {
        let stride = Self::stride(self.order);
        let (begins, values) = (&mut self.begins, &mut self.values);
        let begin = *self.open.entry(tile as u32).or_insert_with(|| {
            let begin = values.len() as u32;
            begins.push((tile as u32, begin));
            values.resize(values.len() + stride, 0.0);
            begin
        });
        let begin = begin as usize;
        let own = &mut self.values[begin..begin + stride];
        let mut k = 0;
        for (row, a) in phi.iter().enumerate() {
            for b in &phi[..=row] {
                own[k] += weight * a * b;
                k += 1;
            }
        }
        for (sum, a) in own[k..].iter_mut().zip(phi) {
            *sum += weight * a * rho;
        }
        own[k + self.order] += 1.0;
    }

    /// The derivative of a point by a parameter is taken where the point was seen, and shares the noise of its distance:
    /// left so, the noise of all points would shrink the scene. Within a tile derivatives are linear in `[u, v]`; the sums
    /// become those of the lines fitted to them, less what the noise leaves in the fit, which the scatter about the lines
    /// tells.
    pub(crate) fn free_derivatives_of_noise(&mut self) {
        if self.order == 3 {
            return;
        }
        let (stride, share) = (Self::stride(self.order), share_of_fit());
        for own in self.values.chunks_exact_mut(stride) {
            if !freed_of_noise(own, self.order, share) {
                own.fill(0.0);
            }
        }
    }

    /// No more points: the tiles in their order.
    pub(crate) fn close(&mut self) {
        self.begins.sort_unstable();
        self.begins.shrink_to_fit();
        self.values.shrink_to_fit();
        self.open = HashMap::new();
    }

    /// Number of tiles that the station saw something of.
    pub(crate) fn tiles(&self) -> usize {
        self.begins.len()
    }

    /// A tile by its place among those that the station saw.
    pub(crate) fn tile(&self, slot: usize) -> usize {
        self.begins[slot].0 as usize
    }

    /// Number of points of a tile by its place.
    pub(crate) fn count(&self, slot: usize) -> usize {
        let end = self.begins[slot].1 as usize + Self::stride(self.order);
        self.values[end - 1] as usize
    }

    /// The places of these tiles among those that the station saw.
    pub(crate) fn slots(&self, tiles: &Range<usize>) -> Range<usize> {
        let place = |tile: usize| self.begins.partition_point(|begin| (begin.0 as usize) < tile);
        place(tiles.start)..place(tiles.end)
    }

    /// Products and right sides of a tile by its place; `None` where no point of it has weight.
    pub(crate) fn at(&self, slot: usize) -> Option<TileSums<'_>> {
        let stride = Self::stride(self.order);
        let begin = self.begins.get(slot)?.1 as usize;
        let own = self.values.get(begin..begin + stride)?;
        let (products, right) = own[..stride - 1].split_at(stride - self.order - 1);
        (own[0] > 0.0).then_some(TileSums { products, right })
    }
}

/// What a fitted number keeps of the noise, over what a degree of freedom leaves of it: `E[w² x²] / (E[w] E[w x²])` of
/// normal deviations x; it would be one without a robust kernel.
fn share_of_fit() -> f64 {
    let (mut all, mut weights, mut left, mut kept) = (0.0, 0.0, 0.0, 0.0);
    for step in -500..=500 {
        let x = f64::from(step) / 100.0;
        let density = (-0.5 * x * x).exp();
        let weight = if x.abs() > TUKEY { 0.0 } else { KERNEL.weight(x) };
        all += density;
        weights += density * weight;
        left += density * weight * x * x;
        kept += density * weight * weight * x * x;
    }
    kept * all / (weights * left)
}

/// [`Sums::free_derivatives_of_noise`] for one tile; `false` where too few points tell.
fn freed_of_noise(own: &mut [f64], order: usize, share: f64) -> bool {
    let at = |row: usize, column: usize| {
        let (row, column) = (row.max(column), row.min(column));
        row * (row + 1) / 2 + column
    };
    let (rights, count) = (order * (order + 1) / 2, own[own.len() - 1]);
    let square = Matrix3::from_fn(|row, column| own[at(row, column)]);
    let mean = Vector2::new(square[(0, 1)], square[(0, 2)]) / square[(0, 0)];
    let spread = square.fixed_view::<2, 2>(1, 1) - mean * mean.transpose() * square[(0, 0)];
    let eigen = spread.symmetric_eigen();
    let least = NARROW * eigen.eigenvalues.max();
    let axes: Vec<usize> = (0..2).filter(|&k| eigen.eigenvalues[k] > least).collect();
    let fitted_numbers = 1.0 + axes.len() as f64;
    let free = count - fitted_numbers;
    if free.is_nan() || free < FEWEST_FREE {
        return false;
    }
    // Offset and slopes of the line of each parameter.
    let line = |row: usize| {
        let products = Vector2::new(own[at(row, 1)], own[at(row, 2)]) - mean * own[at(row, 0)];
        let slope: Vector2<f64> = axes
            .iter()
            .map(|&k| {
                eigen.eigenvectors.column(k) * (eigen.eigenvectors.column(k).dot(&products) / eigen.eigenvalues[k])
            })
            .sum();
        Vector3::new(own[at(row, 0)] / square[(0, 0)] - slope.dot(&mean), slope.x, slope.y)
    };
    let lines: Vec<Vector3<f64>> = (3..order).map(line).collect();
    let right = Vector3::new(own[rights], own[rights + 1], own[rights + 2]);
    for row in 3..order {
        let products = square * lines[row - 3];
        for column in 0..3 {
            own[at(row, column)] = products[column];
        }
        for column in 3..=row {
            own[at(row, column)] = products.dot(&lines[column - 3]);
        }
        // A fit keeps its share of the noise, whose size the degrees of freedom left over tell.
        let (all, fitted) = (own[rights + row], lines[row - 3].dot(&right));
        own[rights + row] = fitted - share * fitted_numbers * (all - fitted) / free;
    }
    true
}

/// [`Sums`] of one tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileSums<'a> {
    products: &'a [f64],
    right: &'a [f64],
}

impl TileSums<'_> {
    pub(crate) fn product(&self, row: usize, column: usize) -> f64 {
        let (row, column) = (row.max(column), row.min(column));
        self.products[row * (row + 1) / 2 + column]
    }

    pub(crate) fn right(&self, row: usize) -> f64 {
        self.right[row]
    }

    /// Products of three by three; zero beyond the last.
    pub(crate) fn products(&self, a: usize, b: usize) -> Matrix3<f64> {
        let known = |row: usize| row < self.right.len();
        Matrix3::from_fn(|i, j| {
            let (row, column) = (3 * a + i, 3 * b + j);
            if known(row) && known(column) { self.product(row, column) } else { 0.0 }
        })
    }

    /// Three right sides; zero beyond the last.
    pub(crate) fn rights(&self, a: usize) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.right.get(3 * a + i).copied().unwrap_or(0.0))
    }

    /// Sum of the weights.
    pub(crate) fn weight(&self) -> f64 {
        self.products[0]
    }
}
