//! Normal equations in blocks: eliminated, reduced, and what couples them.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::equations::structure::{Eliminated, Reduced, Role, Structure};
use crate::linearised::layout::{Layout, Place};
use crate::linearised::linearisation::{Linearisation, Run, take};
use dense_matrices::{Left, Right, add_product, with_wide_registers};

/// Fewest observations, and most pieces, into which the sum over observations is divided.
const PIECE: usize = 4096;
const PIECES: usize = 16;
/// Most observations that are added as one: their Jacobians stay in the nearest cache.
const TOGETHER: usize = 32;
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
    /// The blocks of W, see [`crate::equations::structure::Slot`].
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
        self.accumulate_reduced(source);
        let eliminated = self.accumulate_eliminated(source);
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

    /// U and its part of the gradient, by pieces of the observations.
    fn accumulate_reduced(&mut self, source: Source<'_>) {
        let (structure, count) = (source.structure, source.layout.observations.len());
        let length = PIECE.max(count.div_ceil(PIECES));
        let pieces: Vec<_> = (0..count).step_by(length).map(|first| first..(first + length).min(count)).collect();
        let sums: Vec<_> = pieces.into_par_iter().map(|piece| source.piece(piece)).collect();
        let mut sums = sums.into_iter();
        let Some((mut entries, mut gradient)) = sums.next() else { return };
        for (more, share) in sums {
            entries.iter_mut().zip(more).for_each(|(sum, value)| *sum += value);
            gradient.iter_mut().zip(share).for_each(|(sum, value)| *sum += value);
        }
        for pair in &structure.pairs {
            let columns = entries[pair.offset..].chunks_exact(pair.rows).take(pair.columns);
            for (column, values) in columns.enumerate() {
                let start = (pair.column + column) * structure.order + pair.row;
                self.reduced[start..start + pair.rows].copy_from_slice(values);
            }
        }
        structure.scatter(&gradient, &mut self.gradient, 1);
        for block in &structure.reduced {
            for index in 0..block.width {
                let place = block.start + index;
                self.diagonal[block.column + index] = self.reduced[place * structure.order + place];
            }
        }
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
    /// The pairs' blocks and the reduced gradient of some observations.
    fn piece(self, observations: Range<usize>) -> (Vec<f64>, Vec<f64>) {
        let mut sums = (vec![0.0; self.structure.pair_entries], vec![0.0; self.structure.order]);
        with_wide_registers(|| self.add_observations(observations, &mut sums.0, &mut sums.1));
        sums
    }

    #[inline(always)]
    fn add_observations(self, mut observations: Range<usize>, entries: &mut [f64], gradient: &mut [f64]) {
        let (mut parts, mut others) = (Vec::new(), Vec::new());
        while !observations.is_empty() {
            let first = observations.start;
            let alike = self.alike(observations.clone(), &mut parts, &mut others);
            observations.start += alike;
            let pairs = &self.structure.pair_of[self.structure.pair_starts[first] as usize..];
            for run in self.linearisation.runs(&self.layout.observations[first..first + alike]) {
                self.add_run(&run, &parts, pairs, entries, gradient);
            }
        }
    }

    /// Reduced parts of the first of some observations, and how many at the start have the same ones in the same places.
    /// They are added as one: their Jacobians follow each other in memory.
    #[inline(always)]
    fn alike(
        self,
        observations: Range<usize>,
        parts: &mut Vec<(Reduced, usize)>,
        others: &mut Vec<(Reduced, usize)>,
    ) -> usize {
        let places = &self.layout.observations[observations];
        self.structure.reduced_parts(self.layout.parts(&places[0]), parts);
        let is_alike = |place: &&Place| {
            self.structure.reduced_parts(self.layout.parts(place), others);
            place.width == places[0].width && others == parts
        };
        1 + places[1..].iter().take(TOGETHER - 1).take_while(is_alike).count()
    }

    #[inline(always)]
    fn add_run(
        self,
        run: &Run<'_>,
        parts: &[(Reduced, usize)],
        pairs: &[u32],
        entries: &mut [f64],
        gradient: &mut [f64],
    ) {
        let &Run { jacobian, whitened, weight, width } = run;
        let mut pairs = pairs.iter();
        for (at, (block, offset)) in parts.iter().enumerate() {
            let gradient = &mut gradient[block.reduced_columns()];
            for (residual, entries) in whitened.iter().zip(jacobian.chunks_exact(width)) {
                let residual = weight * residual;
                gradient.iter_mut().zip(&entries[*offset..]).for_each(|(g, a)| *g += a * residual);
            }
            let data = &jacobian[*offset..];
            let right = Right { data, inner: width, column: 1, columns: block.width };
            for ((other, offset), &pair) in parts[at..].iter().zip(&mut pairs) {
                let out = &mut entries[self.structure.pairs[pair as usize].offset..];
                let left = Left { data: &jacobian[*offset..], stride: width, rows: other.width };
                add_product(out, other.width, left, right, whitened.len(), weight);
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
            with_wide_registers(|| self.add_eliminated(block, own, coupling, first_coupling, gradient));
        }
        gradients
    }

    #[inline(always)]
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
            for Run { jacobian, whitened, weight, .. } in self.linearisation.runs(std::slice::from_ref(place)) {
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
                    let data = &jacobian[other.offset as usize..];
                    let left = Left { data, stride: place.width, rows: slot.width() };
                    add_product(
                        &mut coupling[slot.offset - first..],
                        slot.width(),
                        left,
                        right,
                        whitened.len(),
                        weight,
                    );
                }
            }
        }
    }
}
