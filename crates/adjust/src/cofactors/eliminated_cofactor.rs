//! Cofactors in the eliminated form: computed block by block from the reduced inverse, when they are asked for.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::sync::OnceLock;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::equations::block_normal::BATCH;
use crate::equations::elimination::EliminatedFactor;
use crate::equations::structure::{Eliminated, Role, Slot};
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::take;
use dense_matrices::{Left, Right, add_product, with_wide_registers};

/// With `V = L Lᵀ`, `H = L⁻¹ Wᵀ` and the reduced inverse `Q_cc`:
///
/// ```text
/// Q_oo = L⁻ᵀ (I + H Q_cc Hᵀ) L⁻¹,   Q_oc = −L⁻ᵀ H Q_cc
/// ```
#[derive(Debug, Clone)]
pub(crate) struct EliminatedCofactor {
    pub(crate) factor: EliminatedFactor,
    reduced: OnceLock<Vec<f64>>,
    products: OnceLock<Vec<f64>>,
    datum: OnceLock<Option<Transformation>>,
}

/// S-transformation `T Q Tᵀ`, `T = I − M Gᵀ`, from the datum of the reduced unknowns to that of the points:
/// `T Q Tᵀ = Q − M Fᵀ − F Mᵀ` with `F = Q G − ½ M (GᵀQ G)`.
#[derive(Debug, Clone)]
struct Transformation {
    /// M: motions of the network with `GᵀM = I`, one after another.
    motions: Vec<f64>,
    /// F, likewise.
    shares: Vec<f64>,
}

impl EliminatedCofactor {
    pub(crate) fn new(factor: EliminatedFactor) -> Self {
        Self { factor, reduced: OnceLock::new(), products: OnceLock::new(), datum: OnceLock::new() }
    }

    pub(crate) fn scale(&self) -> &[f64] {
        &self.factor.scale
    }

    /// `Q_cc` in the datum of the reduced unknowns, full; residuals do not depend on the datum.
    pub(crate) fn reduced(&self) -> &[f64] {
        self.reduced.get_or_init(|| {
            let (mut matrix, _) = self.factor.reduced.cofactor();
            let scale = &self.factor.reduced.scale;
            for (column, own) in matrix.chunks_exact_mut(scale.len().max(1)).zip(scale) {
                column.iter_mut().zip(scale).for_each(|(q, other)| *q *= own * other);
            }
            matrix
        })
    }

    /// `H Q_cc` for the neighbours of each eliminated block, laid out like H.
    pub(crate) fn products(&self) -> &[f64] {
        // Made before the threads divide the work.
        self.reduced();
        self.products.get_or_init(|| {
            let structure = &self.factor.structure;
            let mut out = vec![0.0; self.factor.half.len()];
            let mut rest = out.as_mut_slice();
            let batches: Vec<_> =
                structure.eliminated.chunks(BATCH).map(|b| (b, take(&mut rest, structure.extent(b).1))).collect();
            let crowded = structure.is_crowded();
            batches.into_par_iter().for_each(|(blocks, mut out)| {
                if crowded {
                    return self.all_products(blocks, out);
                }
                for block in blocks {
                    let count = structure.extent(std::slice::from_ref(block)).1;
                    with_wide_registers(|| self.own_products(block, take(&mut out, count)));
                }
            });
            out
        })
    }

    /// Between the free parameters of two blocks.
    pub(crate) fn block(&self, layout: &Layout, first: usize, second: usize) -> DMatrix<f64> {
        let mut out = self.in_reduced_datum(first, second, layout);
        if let Some(datum) = self.datum() {
            let n = self.factor.scale.len();
            let (rows, columns) = (layout.free(first), layout.free(second));
            for (motion, share) in datum.motions.chunks_exact(n).zip(datum.shares.chunks_exact(n)) {
                for (j, column) in columns.clone().enumerate() {
                    for (i, row) in rows.clone().enumerate() {
                        out[(i, j)] -= motion[row] * share[column] + share[row] * motion[column];
                    }
                }
            }
        }
        out
    }

    fn in_reduced_datum(&self, first: usize, second: usize, layout: &Layout) -> DMatrix<f64> {
        let structure = &self.factor.structure;
        let order = structure.order;
        match (structure.roles[first], structure.roles[second]) {
            (Role::Reduced(row), Role::Reduced(column)) => {
                let (row, column) = (structure.reduced[row as usize], structure.reduced[column as usize]);
                let q = self.reduced();
                DMatrix::from_fn(row.width, column.width, |i, j| q[(column.start + j) * order + row.start + i])
            }
            (Role::Eliminated(row), Role::Reduced(column)) => {
                let (row, column) = (&structure.eliminated[row as usize], structure.reduced[column as usize]);
                let mut out = self.image(row, column.start, column.width);
                self.finish(row, &mut out);
                -out
            }
            (Role::Reduced(_), Role::Eliminated(_)) => self.in_reduced_datum(second, first, layout).transpose(),
            (Role::Eliminated(row), Role::Eliminated(column)) => {
                let (row, column) = (&structure.eliminated[row as usize], &structure.eliminated[column as usize]);
                let mut out = DMatrix::zeros(row.width, column.width);
                let mut products = Vec::new();
                for slot in &structure.slots[row.slots()] {
                    if first == second {
                        let count = row.width * slot.width();
                        self.add_half(slot, &self.products()[slot.offset..slot.offset + count], &mut out);
                    } else {
                        self.product(column, slot, &mut products);
                        self.add_half(slot, &products, &mut out);
                    }
                }
                if first == second {
                    (0..out.nrows()).for_each(|i| out[(i, i)] += 1.0);
                }
                self.finish(row, &mut out);
                let mut out = out.transpose();
                self.finish(column, &mut out);
                out.transpose()
            }
            _ => DMatrix::zeros(layout.free(first).len(), layout.free(second).len()),
        }
    }

    /// `H Q_cc` for some reduced columns.
    fn image(&self, row: &Eliminated, start: usize, width: usize) -> DMatrix<f64> {
        let (structure, q) = (&self.factor.structure, self.reduced());
        let mut out = DMatrix::zeros(row.width, width);
        for slot in &structure.slots[row.slots()] {
            for (k, half) in self.factor.half[slot.offset..].chunks_exact(slot.width()).take(row.width).enumerate() {
                for j in 0..width {
                    let column = &q[(start + j) * structure.order..][slot.reduced_columns()];
                    out[(k, j)] += half.iter().zip(column).map(|(h, q)| h * q).sum::<f64>();
                }
            }
        }
        out
    }

    /// `H Q_cc` of an eliminated block for its own neighbours. The columns of Q are read one after another, from top to
    /// bottom.
    #[inline(always)]
    fn own_products(&self, block: &Eliminated, out: &mut [f64]) {
        let (structure, q) = (&self.factor.structure, self.reduced());
        let slots = &structure.slots[block.slots()];
        for other in slots {
            let data = &self.factor.half[other.offset..];
            let right = Right { data, inner: 1, column: other.width(), columns: block.width };
            for slot in slots {
                let data = &q[other.start as usize * structure.order + slot.start as usize..];
                let left = Left { data, stride: structure.order, rows: slot.width() };
                add_product(&mut out[slot.offset - block.coupling..], slot.width(), left, right, other.width(), 1.0);
            }
        }
    }

    /// The same of several blocks, whole rows at once.
    fn all_products(&self, blocks: &[Eliminated], out: &mut [f64]) {
        let (structure, q) = (&self.factor.structure, self.reduced());
        let columns = structure.columns(blocks, &self.factor.half[blocks[0].coupling..]);
        let products = dense_matrices::product(q, structure.order, &columns);
        let mut products = products.chunks_exact(structure.order);
        for block in blocks {
            for (row, product) in products.by_ref().take(block.width).enumerate() {
                for slot in &structure.slots[block.slots()] {
                    let start = slot.offset - blocks[0].coupling + row * slot.width();
                    out[start..start + slot.width()].copy_from_slice(&product[slot.reduced_columns()]);
                }
            }
        }
    }

    /// `H Q_cc` of an eliminated block for the columns of a slot, which may be another block's: row by row.
    fn product(&self, block: &Eliminated, slot: &Slot, out: &mut Vec<f64>) {
        let (structure, q) = (&self.factor.structure, self.reduced());
        out.clear();
        out.resize(block.width * slot.width(), 0.0);
        with_wide_registers(|| {
            for other in &structure.slots[block.slots()] {
                let data = &q[other.start as usize * structure.order + slot.start as usize..];
                let left = Left { data, stride: structure.order, rows: slot.width() };
                let data = &self.factor.half[other.offset..];
                let right = Right { data, inner: 1, column: other.width(), columns: block.width };
                add_product(out, slot.width(), left, right, other.width(), 1.0);
            }
        });
    }

    /// Adds `H · productsᵀ` of one slot.
    pub(crate) fn add_half(&self, slot: &Slot, products: &[f64], out: &mut DMatrix<f64>) {
        for i in 0..out.nrows() {
            let half = &self.factor.half[slot.offset + i * slot.width()..][..slot.width()];
            for (j, product) in products.chunks_exact(slot.width()).enumerate() {
                out[(i, j)] += half.iter().zip(product).map(|(h, p)| h * p).sum::<f64>();
            }
        }
    }

    /// `L⁻ᵀ` times a matrix.
    fn finish(&self, block: &Eliminated, matrix: &mut DMatrix<f64>) {
        for mut column in matrix.column_iter_mut() {
            self.factor.multiply_inverse_transposed(block, column.as_mut_slice(), 1);
        }
    }

    /// `Q x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut out = self.multiply_in_reduced_datum(x);
        if let Some(datum) = self.datum() {
            let n = x.len();
            for (motion, share) in datum.motions.chunks_exact(n).zip(datum.shares.chunks_exact(n)) {
                let (along, across) = (dot(share, x), dot(motion, x));
                for ((out, m), f) in out.iter_mut().zip(motion).zip(share) {
                    *out -= m * along + f * across;
                }
            }
        }
        out
    }

    /// `Q X` for any number of vectors, one after another.
    fn multiply_in_reduced_datum(&self, x: &[f64]) -> Vec<f64> {
        let (n, order, q) = (self.factor.scale.len(), self.factor.structure.order, self.reduced());
        let count = x.len() / n.max(1);
        let mut panel = dense_matrices::transposed(x, n);
        let mut reduced = self.factor.structure.gather(&panel, count);
        self.factor.forward(&mut panel, &mut reduced, count);
        let mut product = vec![0.0; order * count];
        with_wide_registers(|| {
            let left = Left { data: &reduced, stride: count, rows: count };
            let right = Right { data: q, inner: 1, column: order, columns: order };
            add_product(&mut product, count, left, right, order, 1.0);
        });
        self.factor.backward(&mut panel, &product, count);
        dense_matrices::transposed(&panel, count)
    }

    fn datum(&self) -> Option<&Transformation> {
        self.datum.get_or_init(|| self.transformation()).as_ref()
    }

    fn transformation(&self) -> Option<Transformation> {
        let n = self.factor.scale.len();
        let border = self.factor.border.as_ref()?;
        let (datum, motions) = (border.datum(n), border.motions(n));
        let count = datum.len() / n;
        let row = |list: &[f64], index: usize| list[index * n..(index + 1) * n].to_vec();
        let gauge = DMatrix::from_fn(count, count, |i, j| dot(&row(datum, i), &row(&motions, j)));
        let inverse = gauge.try_inverse()?;
        let motions = DMatrix::from_vec(n, count, motions) * inverse;
        let images = DMatrix::from_vec(n, count, self.multiply_in_reduced_datum(datum));
        let inner = DMatrix::from_column_slice(n, count, datum).transpose() * &images;
        let shares = images - &motions * inner * 0.5;
        (count > 0).then(|| Transformation { motions: motions.data.into(), shares: shares.data.into() })
    }

    /// What the datum adds to the trace of the regularised, scaled inverse.
    pub(crate) fn datum_trace(&self) -> f64 {
        let motions = self.datum().map_or(&[][..], |datum| &datum.motions);
        motions.iter().zip(self.factor.scale.iter().cycle()).map(|(m, s)| (m / s).powi(2)).sum()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
