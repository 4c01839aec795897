//! Factorisation of block normal equations: eliminated blocks by small Cholesky factors, the rest densely.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::sync::Arc;

use rayon::prelude::*;

use crate::equations::block_normal::{BATCH, BlockNormal};
use crate::equations::border::Border;
use crate::equations::constraints::Constraints;
use crate::equations::normal::{NormalFactor, Singular, damping_of, unit_scale};
use crate::equations::structure::{Eliminated, Reduced, Role, Structure};
use crate::linearised::linearisation::take;
use crate::{Result, equations::reduced_constraints};
use dense_matrices::{Left, Right, add_product, with_wide_registers};

/// Columns of the reduced matrix in one piece of work.
const PANEL: usize = 96;

/// With `V = L Lᵀ` and `H = L⁻¹ Wᵀ` (both block by block) the reduced matrix is `S = U − HᵀH`.
#[derive(Debug, Clone)]
pub(crate) struct EliminatedFactor {
    pub(crate) structure: Arc<Structure>,
    /// `L⁻¹` of each eliminated block, row by row.
    pub(crate) inverse: Vec<f64>,
    /// H, laid out like the couplings.
    pub(crate) half: Vec<f64>,
    /// Factor of S, with the user's constraints and the motions that the datum takes away.
    pub(crate) reduced: NormalFactor,
    /// Of all unknowns, makes the diagonal of N one.
    pub(crate) scale: Vec<f64>,
    pub(crate) border: Option<Border>,
}

impl EliminatedFactor {
    /// `damping` are λ and the scale that the damping is measured in.
    pub(crate) fn new(
        normal: &BlockNormal,
        constraints: &Constraints,
        damping: Option<(f64, &[f64])>,
    ) -> std::result::Result<Self, Singular> {
        let structure = Arc::clone(&normal.structure);
        let scale = unit_scale(&normal.diagonal);
        let mut extra = vec![0.0; scale.len()];
        if let Some((lambda, reference)) = damping {
            let damped = scale.iter().zip(reference).map(|(own, reference)| damping_of(lambda, *own, *reference));
            extra.iter_mut().zip(damped).for_each(|(extra, damped)| *extra = damped);
        }
        let (inverse, half) = eliminate(normal, &extra).ok_or(Singular::Normal)?;
        let matrix = reduce(normal, &half, &extra);
        let reduced_scale = structure.gather(&scale, 1);
        let rows = reduced_constraints::new(normal, constraints, &reduced_scale);
        let reduced = NormalFactor::of_matrix(matrix, reduced_scale, &rows)?;
        let mut factor = Self { structure, inverse, half, reduced, scale, border: None };
        if constraints.count > 0 {
            factor.border = Some(Border::new(&factor, constraints)?);
        }
        Ok(factor)
    }

    /// The step that follows `gradient` and takes away `share` of what the constraints miss.
    pub(crate) fn solve(&self, gradient: &[f64], share: f64) -> Vec<f64> {
        let mut step = gradient.to_vec();
        match &self.border {
            None => self.solve_columns(&mut step),
            Some(border) => border.solve(self, &mut step, share),
        }
        step
    }

    /// Refuses inner constraints in directions that the observations already determine.
    pub(crate) fn check_datum(&self) -> Result<()> {
        self.reduced.check_datum()
    }

    /// Solves `N' X = B` in place, without regard to constraints; B has any number of columns over all unknowns.
    pub(crate) fn solve_columns(&self, right: &mut [f64]) {
        let (n, order) = (self.scale.len(), self.structure.order);
        if n == 0 {
            return;
        }
        let count = right.len() / n;
        let mut panel = dense_matrices::transposed(right, n);
        let mut reduced = self.structure.gather(&panel, count);
        self.forward(&mut panel, &mut reduced, count);
        let mut columns = dense_matrices::transposed(&reduced, count);
        let scale = &self.reduced.scale;
        let rescale = |values: &mut [f64]| {
            for column in values.chunks_exact_mut(order.max(1)) {
                column.iter_mut().zip(scale).for_each(|(value, s)| *value *= s);
            }
        };
        rescale(&mut columns);
        self.reduced.solve_scaled(&mut columns);
        rescale(&mut columns);
        self.backward(&mut panel, &dense_matrices::transposed(&columns, order), count);
        right.copy_from_slice(&dense_matrices::transposed(&panel, count));
    }

    /// Replaces the eliminated part of `count` vectors by `L⁻¹ b` and takes its share off the reduced part. The vectors
    /// stand side by side: an unknown's elements of all of them follow each other.
    pub(crate) fn forward(&self, right: &mut [f64], reduced: &mut [f64], count: usize) {
        with_wide_registers(|| {
            for block in &self.structure.eliminated {
                let own = &mut right[block.column * count..][..block.width * count];
                self.multiply_inverse(block, own, count);
                for slot in &self.structure.slots[block.slots()] {
                    let (out, width) = (&mut reduced[slot.start as usize * count..], slot.width());
                    let half = &self.half[slot.offset..];
                    if count == 1 {
                        let left = Left { data: half, stride: width, rows: width };
                        let right = Right { data: own, inner: 1, column: 0, columns: 1 };
                        add_product(out, width, left, right, block.width, -1.0);
                    } else {
                        let left = Left { data: own, stride: count, rows: count };
                        let right = Right { data: half, inner: width, column: 1, columns: width };
                        add_product(out, count, left, right, block.width, -1.0);
                    }
                }
            }
        });
    }

    /// From `L⁻¹ b` and the reduced solution to the whole one, for vectors side by side.
    pub(crate) fn backward(&self, right: &mut [f64], reduced: &[f64], count: usize) {
        self.structure.scatter(reduced, right, count);
        with_wide_registers(|| {
            for block in &self.structure.eliminated {
                let own = &mut right[block.column * count..][..block.width * count];
                for slot in &self.structure.slots[block.slots()] {
                    let data = &reduced[slot.start as usize * count..];
                    let left = Left { data, stride: count, rows: count };
                    let data = &self.half[slot.offset..];
                    let right = Right { data, inner: 1, column: slot.width(), columns: block.width };
                    add_product(own, count, left, right, slot.width(), -1.0);
                }
                self.multiply_inverse_transposed(block, own, count);
            }
        });
    }

    /// `x ← L⁻¹ x` for vectors side by side.
    #[inline(always)]
    fn multiply_inverse(&self, block: &Eliminated, x: &mut [f64], count: usize) {
        let inverse = &self.inverse[block.own()];
        for row in (0..block.width).rev() {
            for vector in 0..count {
                let sum = (0..=row).map(|i| inverse[row * block.width + i] * x[i * count + vector]).sum();
                x[row * count + vector] = sum;
            }
        }
    }

    /// `x ← L⁻ᵀ x` for vectors side by side.
    #[inline(always)]
    pub(crate) fn multiply_inverse_transposed(&self, block: &Eliminated, x: &mut [f64], count: usize) {
        let inverse = &self.inverse[block.own()];
        for row in 0..block.width {
            for vector in 0..count {
                let sum = (row..block.width).map(|i| inverse[i * block.width + row] * x[i * count + vector]).sum();
                x[row * count + vector] = sum;
            }
        }
    }

    /// 1-norm of the equilibrated N.
    pub(crate) fn norm(&self, normal: &BlockNormal) -> f64 {
        let (order, scale) = (self.structure.order, &self.reduced.scale);
        let mut sums = vec![0.0; order];
        for (column, values) in normal.reduced.chunks_exact(order.max(1)).enumerate() {
            for (row, value) in values.iter().enumerate().skip(column) {
                let size = (value * scale[row] * scale[column]).abs();
                sums[row] += size;
                sums[column] += if row == column { 0.0 } else { size };
            }
        }
        let mut largest = 0.0_f64;
        for block in &self.structure.eliminated {
            for index in 0..block.width {
                let unit = self.scale[block.column + index];
                let own = &normal.own[block.own + index * block.width..][..block.width];
                let mut sum: f64 =
                    own.iter().zip(&self.scale[block.columns()]).map(|(v, s)| (v * s * unit).abs()).sum();
                for slot in &self.structure.slots[block.slots()] {
                    let row = &normal.coupling[slot.offset + index * slot.width()..][..slot.width()];
                    for (place, value) in slot.reduced_columns().zip(row) {
                        let size = (value * unit * scale[place]).abs();
                        sum += size;
                        sums[place] += size;
                    }
                }
                largest = largest.max(sum);
            }
        }
        sums.into_iter().fold(largest, f64::max)
    }
}

impl Structure {
    /// The reduced unknowns of `count` vectors over all, side by side.
    pub(crate) fn gather(&self, all: &[f64], count: usize) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.order * count);
        for block in &self.reduced {
            out.extend_from_slice(&all[block.column * count..][..block.width * count]);
        }
        out
    }

    pub(crate) fn scatter(&self, reduced: &[f64], all: &mut [f64], count: usize) {
        for block in &self.reduced {
            let length = block.width * count;
            all[block.column * count..][..length].copy_from_slice(&reduced[block.start * count..][..length]);
        }
    }
}

/// `L⁻¹` and H of all eliminated blocks; `None` where one is not positive definite.
fn eliminate(normal: &BlockNormal, extra: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let structure = &normal.structure;
    let (mut inverse, mut half) = (vec![0.0; normal.own.len()], vec![0.0; normal.coupling.len()]);
    let (mut inverses, mut halves) = (inverse.as_mut_slice(), half.as_mut_slice());
    let batches: Vec<_> = structure
        .eliminated
        .chunks(BATCH)
        .map(|blocks| {
            let (own, coupling) = structure.extent(blocks);
            (blocks, take(&mut inverses, own), take(&mut halves, coupling))
        })
        .collect();
    let done = batches.into_par_iter().map(|(blocks, mut inverses, mut halves)| {
        blocks.iter().all(|block| {
            let inverse = take(&mut inverses, block.width * block.width);
            inverse.copy_from_slice(&normal.own[block.own()]);
            (0..block.width).for_each(|i| inverse[i * block.width + i] += extra[block.column + i]);
            let good = inverse_factor(inverse, block.width);
            with_wide_registers(|| {
                for slot in &structure.slots[block.slots()] {
                    let (count, width) = (block.width * slot.width(), slot.width());
                    let left =
                        Left { data: &normal.coupling[slot.offset..slot.offset + count], stride: width, rows: width };
                    let right = Right { data: inverse, inner: 1, column: block.width, columns: block.width };
                    add_product(take(&mut halves, count), width, left, right, block.width, 1.0);
                }
            });
            good
        })
    });
    let good = done.collect::<Vec<bool>>().into_iter().all(|good| good);
    good.then_some((inverse, half))
}

/// Replaces a small symmetric matrix by the inverse of its Cholesky factor, row by row, upper triangle zero. False where
/// it is not positive definite.
fn inverse_factor(matrix: &mut [f64], n: usize) -> bool {
    for column in 0..n {
        let known: f64 = (0..column).map(|i| matrix[column * n + i].powi(2)).sum();
        let pivot = matrix[column * n + column] - known;
        if pivot.is_nan() || pivot <= 0.0 || pivot == f64::INFINITY {
            return false;
        }
        let root = pivot.sqrt();
        matrix[column * n + column] = root;
        for row in column + 1..n {
            let known: f64 = (0..column).map(|i| matrix[row * n + i] * matrix[column * n + i]).sum();
            matrix[row * n + column] = (matrix[row * n + column] - known) / root;
            matrix[column * n + row] = 0.0;
        }
    }
    for row in 0..n {
        let pivot = 1.0 / matrix[row * n + row];
        for column in 0..row {
            let known: f64 = (column..row).map(|i| matrix[row * n + i] * matrix[i * n + column]).sum();
            matrix[row * n + column] = -known * pivot;
        }
        matrix[row * n + row] = pivot;
    }
    true
}

/// `S = U − HᵀH`, lower triangle: each element in the order of the eliminated blocks.
fn reduce(normal: &BlockNormal, half: &[f64], extra: &[f64]) -> Vec<f64> {
    let structure = &normal.structure;
    let order = structure.order;
    let mut out = normal.reduced.clone();
    for block in &structure.reduced {
        (0..block.width).for_each(|index| out[(block.start + index) * (order + 1)] += extra[block.column + index]);
    }
    if structure.is_crowded() {
        for blocks in structure.eliminated.chunks(BATCH) {
            let columns = structure.columns(blocks, &half[blocks[0].coupling..]);
            let panels = out.par_chunks_mut(PANEL * order).enumerate();
            panels.for_each(|(panel, out)| dense_matrices::subtract_square(out, order, panel * PANEL, &columns));
        }
        return out;
    }
    let mut rest = out.as_mut_slice();
    let columns: Vec<_> = structure.reduced.iter().map(|block| (block, take(&mut rest, block.width * order))).collect();
    columns.into_par_iter().for_each(|(block, out)| with_wide_registers(|| subtract(structure, block, half, out)));
    out
}

#[inline(always)]
fn subtract(structure: &Structure, block: &Reduced, half: &[f64], out: &mut [f64]) {
    let Role::Reduced(index) = structure.roles[block.block] else { return };
    for &at in structure.reduced_slots.list(index as usize) {
        let own = &structure.slots[at as usize];
        let eliminated = &structure.eliminated[own.eliminated as usize];
        let right = Right { data: &half[own.offset..], inner: own.width(), column: 1, columns: own.width() };
        for slot in &structure.slots[at as usize..eliminated.slots().end] {
            let left = Left { data: &half[slot.offset..], stride: slot.width(), rows: slot.width() };
            add_product(&mut out[slot.start as usize..], structure.order, left, right, eliminated.width, -1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_of_a_small_factor() {
        // L = [2 0; 1 3], V = L Lᵀ = [4 2; 2 10], L⁻¹ = [1/2 0; −1/6 1/3].
        let mut matrix = [4.0, 2.0, 2.0, 10.0];
        assert!(inverse_factor(&mut matrix, 2));
        for (found, expected) in matrix.iter().zip([0.5, 0.0, -1.0 / 6.0, 1.0 / 3.0]) {
            assert!((found - expected).abs() < 1e-16);
        }
        assert!(!inverse_factor(&mut [1.0, 1.0, 1.0, 1.0], 2));
        assert!(!inverse_factor(&mut [f64::NAN], 1));
    }
}
