//! Blocks as neighbours of each other, and a choice of blocks of which no two are.

use crate::Adjustment;
use crate::equations::structure::Lists;
use crate::linearised::layout::Layout;

/// Unknowns of the largest block that is eliminated.
const LARGEST_BLOCK: usize = 6;

/// Blocks and the observations that tie them.
pub(crate) struct Graph {
    pub(crate) observations: Lists,
    /// Number of neighbouring blocks, and of their unknowns.
    pub(crate) degree: Vec<u32>,
    burden: Vec<u32>,
    /// Touched by a constraint.
    constrained: Vec<bool>,
}

impl Graph {
    pub(crate) fn new(adjustment: &Adjustment<'_>, layout: &Layout) -> Self {
        let places = layout.observations.iter().enumerate();
        let pairs = places
            .flat_map(|(index, place)| layout.parts(place).iter().map(move |part| (part.block as usize, index as u32)));
        let observations = Lists::new(layout.blocks(), pairs);
        let mut constrained = vec![false; layout.blocks()];
        for block in adjustment.constraints.iter().flat_map(|constraint| constraint.blocks()) {
            constrained[block.index()] = true;
        }
        let none = vec![0; layout.blocks()];
        let mut graph = Self { observations, degree: none.clone(), burden: none, constrained };
        let mut seen = vec![usize::MAX; layout.blocks()];
        for block in 0..layout.blocks() {
            let unknowns = |other: usize| layout.free(other).len() as u32;
            let neighbours = graph.neighbours(layout, block, &mut seen).map(unknowns);
            (graph.degree[block], graph.burden[block]) = neighbours.fold((0, 0), |(n, sum), more| (n + 1, sum + more));
        }
        graph
    }

    /// Each neighbour once; `seen` remembers for whom.
    fn neighbours<'g>(
        &'g self,
        layout: &'g Layout,
        block: usize,
        seen: &'g mut [usize],
    ) -> impl Iterator<Item = usize> + 'g {
        let observations = self.observations.list(block).iter();
        let parts = observations.flat_map(|&index| layout.parts(&layout.observations[index as usize]));
        let others = parts.map(|part| part.block as usize).filter(move |&other| other != block);
        others.filter(move |&other| std::mem::replace(&mut seen[other], block) != block)
    }

    /// Small blocks of which no two are neighbours: of three greedy choices the one with the most unknowns. First come
    /// those whose neighbours, which stay, have the fewest unknowns for each of their own \[Sakai2003\]; in a network of
    /// many stations and targets, where a target at the border with few stations would bar these, all of one kind.
    pub(crate) fn independent(&self, layout: &Layout) -> Vec<bool> {
        let width = |block: usize| layout.free(block).len();
        let small = |block: &usize| (1..=LARGEST_BLOCK).contains(&width(*block));
        let candidates: Vec<usize> =
            (0..layout.blocks()).filter(small).filter(|&block| !self.constrained[block]).collect();
        let cost = |block: usize, other: usize| u64::from(self.burden[block]) * width(other) as u64;
        let mut orders = [candidates.clone(), candidates.clone(), candidates];
        orders[0].sort_by(|&a, &b| cost(a, b).cmp(&cost(b, a)).then(a.cmp(&b)));
        orders[1].sort_by_key(|&block| width(block));
        orders[2].sort_by_key(|&block| std::cmp::Reverse(width(block)));
        let mut best = (0, vec![false; layout.blocks()]);
        for order in orders {
            let chosen = self.in_order(layout, order);
            let unknowns = (0..layout.blocks()).filter(|&block| chosen[block]).map(width).sum();
            if unknowns > best.0 {
                best = (unknowns, chosen);
            }
        }
        best.1
    }

    /// Each block that has no chosen neighbour yet.
    fn in_order(&self, layout: &Layout, candidates: Vec<usize>) -> Vec<bool> {
        let (mut chosen, mut barred) = (vec![false; layout.blocks()], vec![false; layout.blocks()]);
        let mut seen = vec![usize::MAX; layout.blocks()];
        for block in candidates {
            if barred[block] || self.observations.list(block).is_empty() {
                continue;
            }
            chosen[block] = true;
            for neighbour in self.neighbours(layout, block, &mut seen) {
                barred[neighbour] = true;
            }
        }
        chosen
    }
}
