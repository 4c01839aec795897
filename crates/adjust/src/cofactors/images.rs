//! `J Q Jᵀ` of single observations, from which redundancy numbers and the deviations of residuals follow.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::cofactors::cofactor::Cofactor;
use crate::cofactors::eliminated_cofactor::EliminatedCofactor;
use crate::equations::block_normal::BATCH;
use crate::equations::structure::{Eliminated, Role};
use crate::linearised::layout::{Layout, Place};
use crate::linearised::linearisation::Linearisation;
use dense_matrices::{Left, Right, add_product, with_wide_registers};

/// Observations in one piece of work.
const PIECE: usize = 256;

/// The matrices `J Q Jᵀ`, J the whitened Jacobian without robust weights; row-major, one after another.
#[derive(Debug, Clone)]
pub(crate) struct Images {
    starts: Vec<usize>,
    values: Vec<f64>,
}

/// A block of an observation, and where its rows and columns lie in a full cofactor matrix.
#[derive(Clone, Copy)]
struct Columns {
    start: usize,
    width: usize,
    /// In a row of the Jacobian.
    offset: usize,
}

/// What images are made from.
#[derive(Clone, Copy)]
struct Source<'s> {
    layout: &'s Layout,
    linearisation: &'s Linearisation,
}

/// Reusable memory.
#[derive(Default)]
struct Memory {
    columns: Vec<Columns>,
    row: Vec<f64>,
}

type Image = (usize, Vec<f64>);

impl Images {
    pub(crate) fn new(layout: &Layout, linearisation: &Linearisation, cofactor: &Cofactor) -> Self {
        let source = Source { layout, linearisation };
        let mut starts = vec![0];
        for place in &layout.observations {
            starts.push(starts[starts.len() - 1] + place.dimension * place.dimension);
        }
        let mut values = vec![0.0; starts[layout.observations.len()]];
        let images = match cofactor {
            Cofactor::Dense { matrix, scale, .. } => source.dense(matrix, scale.len()),
            Cofactor::Eliminated(cofactor) => source.eliminated(cofactor),
        };
        for (index, image) in images.into_iter().flatten() {
            values[starts[index]..starts[index + 1]].copy_from_slice(&image);
        }
        Self { starts, values }
    }

    pub(crate) fn image(&self, observation: usize) -> &[f64] {
        &self.values[self.starts[observation]..self.starts[observation + 1]]
    }
}

impl Source<'_> {
    fn dense(self, matrix: &[f64], order: usize) -> Vec<Vec<Image>> {
        let pieces = self.layout.observations.par_chunks(PIECE).enumerate();
        let piece = |(piece, places): (usize, &[Place])| {
            let mut memory = Memory::default();
            let image = |(index, place): (usize, &Place)| {
                memory.columns.clear();
                memory.columns.extend(self.layout.parts(place).iter().map(|part| Columns {
                    start: part.column as usize,
                    width: part.width as usize,
                    offset: part.offset as usize,
                }));
                let mut image = vec![0.0; place.dimension * place.dimension];
                self.add_square(place, matrix, order, &mut memory, &mut image);
                (piece * PIECE + index, image)
            };
            places.iter().enumerate().map(image).collect()
        };
        pieces.map(piece).collect()
    }

    fn eliminated(self, cofactor: &EliminatedCofactor) -> Vec<Vec<Image>> {
        let structure = &cofactor.factor.structure;
        // Made here, once, and not by whichever thread comes first.
        cofactor.products();
        let batches = structure.eliminated.par_chunks(BATCH);
        let mut images: Vec<Vec<Image>> = batches
            .map(|blocks| {
                let mut memory = Memory::default();
                blocks.iter().flat_map(|block| self.around(block, cofactor, &mut memory)).collect()
            })
            .collect();
        let alone = |place: &Place| structure.eliminated_part(self.layout.parts(place)).is_none();
        let mut memory = Memory::default();
        let rest = self.layout.observations.iter().enumerate().filter(|(_, place)| alone(place));
        let rest = rest.map(|(index, place)| (index, self.reduced_part(place, cofactor, &mut memory))).collect();
        images.push(rest);
        images
    }

    /// Images of the observations of an eliminated block.
    fn around(self, block: &Eliminated, cofactor: &EliminatedCofactor, memory: &mut Memory) -> Vec<Image> {
        let structure = &cofactor.factor.structure;
        let Role::Eliminated(index) = structure.roles[block.block] else { return Vec::new() };
        // K = I + H Q_cc Hᵀ.
        let mut inner = DMatrix::identity(block.width, block.width);
        let products = cofactor.products();
        for slot in &structure.slots[block.slots()] {
            let count = block.width * slot.width();
            cofactor.add_half(slot, &products[slot.offset..slot.offset + count], &mut inner);
        }
        let observations = structure.eliminated_observations.list(index as usize);
        let image = |&observation: &u32| {
            let place = &self.layout.observations[observation as usize];
            let mut image = self.reduced_part(place, cofactor, memory);
            self.add_eliminated_part(place, block, cofactor, &inner, &mut image);
            (observation as usize, image)
        };
        observations.iter().map(image).collect()
    }

    fn reduced_part(self, place: &Place, cofactor: &EliminatedCofactor, memory: &mut Memory) -> Vec<f64> {
        let structure = &cofactor.factor.structure;
        memory.columns.clear();
        for part in self.layout.parts(place) {
            if let Role::Reduced(index) = structure.roles[part.block as usize] {
                let start = structure.reduced[index as usize].start;
                memory.columns.push(Columns { start, width: part.width as usize, offset: part.offset as usize });
            }
        }
        let mut image = vec![0.0; place.dimension * place.dimension];
        let q = cofactor.reduced();
        with_wide_registers(|| self.add_square(place, q, structure.order, memory, &mut image));
        image
    }

    /// Adds `J Q Jᵀ` over the columns in memory.
    #[inline(always)]
    fn add_square(self, place: &Place, q: &[f64], order: usize, memory: &mut Memory, image: &mut [f64]) {
        let jacobian = &self.linearisation.jacobian[place.jacobian_range()];
        let d = place.dimension;
        for own in &memory.columns {
            memory.row.clear();
            memory.row.resize(d * own.width, 0.0);
            for other in &memory.columns {
                let left = Left { data: &q[other.start * order + own.start..], stride: order, rows: own.width };
                let data = &jacobian[other.offset..];
                let right = Right { data, inner: 1, column: place.width, columns: d };
                add_product(&mut memory.row, own.width, left, right, other.width, 1.0);
            }
            add_outer(&memory.row, own.width, jacobian, place.width, own.offset, image, d, 1.0);
        }
    }

    /// Adds what the eliminated block contributes: with `J' = J_o L⁻ᵀ` and
    /// `B = J' (H Q_cc) J_cᵀ` it is `J' K J'ᵀ − B − Bᵀ`.
    fn add_eliminated_part(
        self,
        place: &Place,
        block: &Eliminated,
        cofactor: &EliminatedCofactor,
        inner: &DMatrix<f64>,
        image: &mut [f64],
    ) {
        let (structure, d) = (&cofactor.factor.structure, place.dimension);
        let jacobian = &self.linearisation.jacobian[place.jacobian_range()];
        let Some((_, part)) = structure.eliminated_part(self.layout.parts(place)) else { return };
        let inverse = &cofactor.factor.inverse[block.own()];
        let turned = DMatrix::from_fn(d, block.width, |row, column| {
            let entries = &jacobian[row * place.width..][part.entries()];
            (0..=column).map(|k| entries[k] * inverse[column * block.width + k]).sum::<f64>()
        });
        // M = (H Q_cc) J_cᵀ, block width × d.
        let mut crossed = DMatrix::zeros(block.width, d);
        for (other, at) in self.layout.parts(place).iter().zip(place.part_range()) {
            let Some(slot) = structure.slots.get(structure.slot_of_part[at] as usize) else { continue };
            let products = cofactor.products()[slot.offset..].chunks_exact(slot.width()).take(block.width);
            for (k, product) in products.enumerate() {
                for row in 0..d {
                    let entries = &jacobian[row * place.width..][other.entries()];
                    crossed[(k, row)] += product.iter().zip(entries).map(|(p, a)| p * a).sum::<f64>();
                }
            }
        }
        let crossed = &turned * crossed;
        let own = &turned * inner * turned.transpose();
        for row in 0..d {
            for column in 0..d {
                image[row * d + column] += own[(row, column)] - crossed[(row, column)] - crossed[(column, row)];
            }
        }
    }
}

/// Adds `rows · J_partᵀ` to a small square matrix.
#[allow(clippy::too_many_arguments)] // two matrices and where they begin
fn add_outer(
    rows: &[f64],
    width: usize,
    jacobian: &[f64],
    stride: usize,
    offset: usize,
    image: &mut [f64],
    d: usize,
    factor: f64,
) {
    for (first, row) in rows.chunks_exact(width).enumerate() {
        for second in 0..d {
            let entries = &jacobian[second * stride + offset..][..width];
            image[first * d + second] += factor * row.iter().zip(entries).map(|(a, b)| a * b).sum::<f64>();
        }
    }
}
