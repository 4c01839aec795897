//! Graph of the correspondences that agree with each other, and poses from its cliques.
//!
//! True correspondences all agree with each other; false ones agree by chance. Each clique found by greedy growth from a
//! seed stands for a pose `[Yang2021]`; many cliques, not the largest one alone, are kept `[Zhang2023]`, for in rooms the
//! largest is often that of a wall slid along itself. Seeds and growth are ranked by the number of
//! common neighbours of two correspondences.
// Only what is inlined is compiled for wide registers.
// Lanes lie side by side.
#![allow(clippy::inline_always, clippy::needless_range_loop)]

use rayon::prelude::*;

use crate::description::feature_cloud::Place;
use crate::hypotheses::correspondences::{Correspondences, agree};

/// Fewest members of a clique.
const LEAST_MEMBERS: usize = 3;

/// Rows of bits: bit j of row i is set where i and j agree.
pub(crate) struct ConsistencyGraph {
    words: usize,
    rows: Vec<u64>,
}

impl ConsistencyGraph {
    pub(crate) fn new(correspondences: &Correspondences, tolerance: f32) -> Self {
        let count = correspondences.len();
        let words = count.div_ceil(64).max(1);
        let mut rows = vec![0; count * words];
        let blocks = blocks(correspondences);
        rows.par_chunks_mut(words).with_min_len(64).enumerate().for_each(|(i, row)| {
            pulp::Arch::new().dispatch(Row { own: &correspondences.rows[i], blocks: &blocks, tolerance, bits: row });
        });
        Self { words, rows }
    }

    fn len(&self) -> usize {
        self.rows.len() / self.words
    }

    fn row(&self, i: usize) -> &[u64] {
        &self.rows[i * self.words..(i + 1) * self.words]
    }

    fn common(&self, i: usize, j: usize) -> u32 {
        self.row(i).iter().zip(self.row(j)).map(|(a, b)| (a & b).count_ones()).sum()
    }

    /// Maximal cliques from at most `count` seeds, those with most support first. `explained` tells which correspondences
    /// a clique accounts for: they seed no other, and a clique of which it tells none is not counted.
    pub(crate) fn cliques(&self, count: usize, mut explained: impl FnMut(&[u32]) -> Vec<u32>) {
        let mut seeds: Vec<(u64, u32)> = (0..self.len())
            .into_par_iter()
            .with_min_len(32)
            .map(|i| (members(self.row(i)).map(|j| u64::from(self.common(i, j))).sum(), i as u32))
            .collect();
        seeds.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut covered = vec![false; self.len()];
        let mut found = 0;
        for (_, seed) in seeds.into_iter().take_while(|seed| seed.0 > 0) {
            if covered[seed as usize] {
                continue;
            }
            let clique = self.grow(seed as usize);
            for &member in &clique {
                covered[member as usize] = true;
            }
            let others = if clique.len() >= LEAST_MEMBERS { explained(&clique) } else { Vec::new() };
            found += usize::from(!others.is_empty());
            for member in others {
                covered[member as usize] = true;
            }
            if found == count {
                break;
            }
        }
    }

    fn grow(&self, seed: usize) -> Vec<u32> {
        let mut ranked: Vec<(u32, u32)> = members(self.row(seed)).map(|j| (self.common(seed, j), j as u32)).collect();
        ranked.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut allowed = self.row(seed).to_vec();
        let mut clique = vec![seed as u32];
        for (_, j) in ranked {
            let j = j as usize;
            if allowed[j / 64] >> (j % 64) & 1 == 1 {
                clique.push(j as u32);
                for (left, row) in allowed.iter_mut().zip(self.row(j)) {
                    *left &= row;
                }
            }
        }
        clique
    }
}

/// Correspondences of one word of bits, coordinate by coordinate: source points and normals, target points and normals.
type Block = [[f32; 64]; 12];

fn blocks(correspondences: &Correspondences) -> Vec<Block> {
    // What pads the last block agrees with nothing.
    let mut blocks = vec![[[f32::NAN; 64]; 12]; correspondences.len().div_ceil(64)];
    for (i, row) in correspondences.rows.iter().enumerate() {
        for (column, value) in row.as_flattened().as_flattened().iter().enumerate() {
            blocks[i / 64][column][i % 64] = *value;
        }
    }
    blocks
}

/// The bits of one correspondence against all others, 64 at a time. A closure would not be compiled for wide registers.
struct Row<'a> {
    own: &'a [Place; 2],
    blocks: &'a [Block],
    tolerance: f32,
    bits: &'a mut [u64],
}

impl pulp::NullaryFnOnce for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (bits, block) in self.bits.iter_mut().zip(self.blocks) {
            let mut flags = [0_u32; 64];
            for lane in 0..64 {
                let vector = |k: usize| [block[k][lane], block[k + 1][lane], block[k + 2][lane]];
                let other = [[vector(0), vector(3)], [vector(6), vector(9)]];
                flags[lane] = u32::from(agree(self.own, &other, self.tolerance));
            }
            *bits = flags.iter().enumerate().fold(0, |bits, (lane, flag)| bits | u64::from(*flag) << lane);
        }
    }
}

fn members(row: &[u64]) -> impl Iterator<Item = usize> + '_ {
    row.iter().enumerate().flat_map(|(word, &bits)| {
        std::iter::successors((bits != 0).then_some(bits), |b| Some(b & (b - 1)).filter(|b| *b != 0))
            .map(move |b| 64 * word + b.trailing_zeros() as usize)
    })
}
