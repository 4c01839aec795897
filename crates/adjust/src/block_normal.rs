//! Normal equations in blocks: eliminated, reduced, and what couples them.

use std::sync::Arc;

use rayon::prelude::*;

use crate::layout::Layout;
use crate::linearisation::{Linearisation, Run, take};
use crate::product::{Left, Right, add_product};
use crate::structure::{Eliminated, Reduced, Role, Structure};

/// Observations of one reduced block that are summed in one piece.
const PIECE: usize = 4096;
/// Eliminated blocks in one piece of work.
pub(crate) const BATCH: usize = 64;

/// `N = [V Wᵀ; W U]` with V the eliminated blocks: no two of them are coupled.
#[derive(Debug, Clone)]
pub(crate) struct BlockNormal {
    pub(crate) structure: Arc<Structure>,
    /// U, lower triangle, column-major, in the order of reduced columns.
    pub(crate) reduced: Vec<f64>,
    /// The blocks of V, full.
    pub(crate) own: Vec<f64>,
    /// The blocks of W, see [`crate::structure::Slot`].
    pub(crate) coupling: Vec<f64>,
    /// `AᵀPv` in columns.
    pub(crate) gradient: Vec<f64>,
    /// Of N, in columns.
    pub(crate) diagonal: Vec<f64>,
}

/// What is summed over.
#[derive(Clone, Copy)]
struct Source<'s> {
    structure: &'s Structure,
    layout: &'s Layout,
    linearisation: &'s Linearisation,
}

impl BlockNormal {
    pub(crate) fn new(layout: &Layout, structure: Structure) -> Self {
        let own = structure.eliminated.iter().map(|e| e.width * e.width).sum();
        let coupling = structure
            .slots
            .last()
            .map_or(0, |last| last.offset + last.width() * structure.eliminated[last.eliminated as usize].width);
        Self {
            reduced: vec![0.0; structure.order * structure.order],
            own: vec![0.0; own],
            coupling: vec![0.0; coupling],
            gradient: vec![0.0; layout.unknowns],
            diagonal: vec![0.0; layout.unknowns],
            structure: Arc::new(structure),
        }
    }

    /// Sums over all observations: each element in the order of the observations, whoever does it.
    pub(crate) fn accumulate(&mut self, layout: &Layout, linearisation: &Linearisation) {
        let structure = Arc::clone(&self.structure);
        let source = Source { structure: &structure, layout, linearisation };
        let reduced = self.accumulate_reduced(source);
        let eliminated = self.accumulate_eliminated(source);
        for (block, gradient) in structure.reduced.iter().zip(reduced) {
            self.gradient[block.columns()].copy_from_slice(&gradient);
            for index in 0..block.width {
                let place = block.start + index;
                self.diagonal[block.column + index] = self.reduced[place * structure.order + place];
            }
        }
        for (blocks, gradient) in structure.eliminated.chunks(BATCH).zip(eliminated) {
            let mut rest = gradient.as_slice();
            for block in blocks {
                let (own, after) = rest.split_at(block.width);
                rest = after;
                self.gradient[block.columns()].copy_from_slice(own);
                for index in 0..block.width {
                    self.diagonal[block.column + index] = self.own[block.own + index * block.width + index];
                }
            }
        }
    }

    /// U, by columns of blocks; the gradient of each block is the answer.
    fn accumulate_reduced(&mut self, source: Source<'_>) -> Vec<Vec<f64>> {
        let order = source.structure.order;
        let mut rest = self.reduced.as_mut_slice();
        let columns: Vec<_> =
            source.structure.reduced.iter().map(|block| (block, take(&mut rest, block.width * order))).collect();
        columns.into_par_iter().map(|(block, out)| source.reduced_columns(block, out)).collect()
    }

    /// V and W; the gradients of each batch are the answer.
    fn accumulate_eliminated(&mut self, source: Source<'_>) -> Vec<Vec<f64>> {
        let (mut own, mut coupling) = (self.own.as_mut_slice(), self.coupling.as_mut_slice());
        let batches: Vec<_> = source
            .structure
            .eliminated
            .chunks(BATCH)
            .map(|blocks| {
                let (owns, couplings) = source.structure.extent(blocks);
                (blocks, take(&mut own, owns), take(&mut coupling, couplings))
            })
            .collect();
        batches.into_par_iter().map(|(blocks, own, coupling)| source.batch(blocks, own, coupling)).collect()
    }
}

impl Structure {
    /// Memory of consecutive eliminated blocks: their own matrices, and their couplings.
    pub(crate) fn extent(&self, blocks: &[Eliminated]) -> (usize, usize) {
        let own = blocks.iter().map(|block| block.width * block.width).sum();
        let coupling =
            |block: &Eliminated| self.slots[block.slots()].iter().map(|slot| slot.width() * block.width).sum::<usize>();
        (own, blocks.iter().map(coupling).sum())
    }
}

impl Source<'_> {
    fn reduced_columns(self, block: &Reduced, out: &mut [f64]) -> Vec<f64> {
        out.fill(0.0);
        let Role::Reduced(index) = self.structure.roles[block.block] else { return Vec::new() };
        let list = self.structure.reduced_observations.list(index as usize);
        let mut gradient = vec![0.0; block.width];
        if list.len() <= PIECE {
            self.add_observations(block, list, out, &mut gradient);
            return gradient;
        }
        let pieces: Vec<_> = list
            .par_chunks(PIECE)
            .map(|piece| {
                let (mut part, mut gradient) = (vec![0.0; out.len()], vec![0.0; block.width]);
                self.add_observations(block, piece, &mut part, &mut gradient);
                (part, gradient)
            })
            .collect();
        for (part, share) in pieces {
            out.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
            gradient.iter_mut().zip(share).for_each(|(sum, value)| *sum += value);
        }
        gradient
    }

    fn add_observations(self, block: &Reduced, list: &[u32], out: &mut [f64], gradient: &mut [f64]) {
        let order = self.structure.order;
        for &observation in list {
            let place = &self.layout.observations[observation as usize];
            let parts = self.layout.parts(place);
            let Some(own) = parts.iter().find(|part| part.block as usize == block.block) else { continue };
            for Run { jacobian, whitened, weight } in self.linearisation.runs(place) {
                let data = &jacobian[own.offset as usize..];
                for (residual, entries) in whitened.iter().zip(jacobian.chunks_exact(place.width)) {
                    let residual = weight * residual;
                    gradient.iter_mut().zip(&entries[own.entries()]).for_each(|(g, a)| *g += a * residual);
                }
                let right = Right { data, inner: place.width, column: 1, columns: block.width };
                for part in parts {
                    let Role::Reduced(other) = self.structure.roles[part.block as usize] else { continue };
                    let start = self.structure.reduced[other as usize].start;
                    if start >= block.start {
                        let data = &jacobian[part.offset as usize..];
                        let left = Left { data, stride: place.width, rows: part.width as usize };
                        add_product(&mut out[start..], order, left, right, whitened.len(), weight);
                    }
                }
            }
        }
    }

    fn batch(self, blocks: &[Eliminated], own: &mut [f64], coupling: &mut [f64]) -> Vec<f64> {
        own.fill(0.0);
        coupling.fill(0.0);
        let Some((first_own, first_coupling)) = blocks.first().map(|block| (block.own, block.coupling)) else {
            return Vec::new();
        };
        let mut gradients = vec![0.0; blocks.iter().map(|block| block.width).sum()];
        let mut rest = gradients.as_mut_slice();
        for block in blocks {
            let gradient = take(&mut rest, block.width);
            let own = &mut own[block.own - first_own..block.own - first_own + block.width * block.width];
            self.add_eliminated(block, own, coupling, first_coupling, gradient);
        }
        gradients
    }

    fn add_eliminated(
        self,
        block: &Eliminated,
        own: &mut [f64],
        coupling: &mut [f64],
        first: usize,
        gradient: &mut [f64],
    ) {
        let Role::Eliminated(index) = self.structure.roles[block.block] else { return };
        for &observation in self.structure.eliminated_observations.list(index as usize) {
            let place = &self.layout.observations[observation as usize];
            let Some((_, part)) = self.structure.eliminated_part(self.layout.parts(place)) else { continue };
            for Run { jacobian, whitened, weight } in self.linearisation.runs(place) {
                for (residual, entries) in whitened.iter().zip(jacobian.chunks_exact(place.width)) {
                    let residual = weight * residual;
                    gradient.iter_mut().zip(&entries[part.entries()]).for_each(|(g, a)| *g += a * residual);
                }
                let data = &jacobian[part.offset as usize..];
                let right = Right { data, inner: place.width, column: 1, columns: block.width };
                let left = Left { data, stride: place.width, rows: block.width };
                add_product(own, block.width, left, right, whitened.len(), weight);
                for (other, at) in self.layout.parts(place).iter().zip(place.part_range()) {
                    let slot = self.structure.slots.get(self.structure.slot_of_part[at] as usize);
                    let Some(slot) = slot else { continue };
                    let left =
                        Left { data: &jacobian[other.offset as usize..], stride: place.width, rows: slot.width() };
                    let target = &mut coupling[slot.offset - first..];
                    add_product(target, slot.width(), left, right, whitened.len(), weight);
                }
            }
        }
    }
}
