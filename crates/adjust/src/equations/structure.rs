//! Which blocks are eliminated, and who is whose neighbour.

use std::collections::HashMap;
use std::ops::Range;

use crate::Adjustment;
use crate::equations::graph::Graph;
use crate::equations::orthogonal::OrthogonalFactor;
use crate::linearised::layout::{Layout, Part};

/// Share of all products of an eliminated block's couplings that are not zero from which on it is faster to multiply the
/// zeros as well: a large product takes a twelfth of the time for each of its terms (measured at 1,200 and 1,800 unknowns).
const CROWDED: f64 = 1.0 / 12.0;

/// Division of the unknowns: eliminated blocks, no two of which share an observation or a constraint, and the rest, the
/// reduced unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Structure {
    /// In the order of reduced columns: blocks with few neighbours first, so that shared ones form a border at the end.
    pub(crate) reduced: Vec<Reduced>,
    pub(crate) eliminated: Vec<Eliminated>,
    /// Neighbours of all eliminated blocks, those of each in the order of reduced columns.
    pub(crate) slots: Vec<Slot>,
    /// Number of reduced unknowns.
    pub(crate) order: usize,
    /// What each block is.
    pub(crate) roles: Vec<Role>,
    /// Slot of each part of each observation that stands beside an eliminated block.
    pub(crate) slot_of_part: Vec<u32>,
    /// Blocks of U that observations touch.
    pub(crate) pairs: Vec<Pair>,
    /// Memory of all pairs.
    pub(crate) pair_entries: usize,
    /// Where the pairs of each observation begin in `pair_of`, and at the end their number.
    pub(crate) pair_starts: Vec<u32>,
    /// Pairs of each observation: its reduced parts in the order of their columns, each with itself and all after it.
    pub(crate) pair_of: Vec<u32>,
    /// Observations of each eliminated block.
    pub(crate) eliminated_observations: Lists,
    /// Slots of each reduced block.
    pub(crate) reduced_slots: Lists,
}

/// A block that stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reduced {
    pub(crate) block: usize,
    /// First column among all unknowns.
    pub(crate) column: usize,
    /// First reduced column.
    pub(crate) start: usize,
    pub(crate) width: usize,
}

/// A block that is eliminated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eliminated {
    pub(crate) block: usize,
    /// First column among all unknowns.
    pub(crate) column: usize,
    pub(crate) width: usize,
    /// Start of its own matrix, `width × width`, in the memory of all of them.
    pub(crate) own: usize,
    /// Start of its couplings in the memory of all of them.
    pub(crate) coupling: usize,
    slots: (usize, usize),
}

/// An eliminated block and a neighbour: their coupling is stored row by row, `eliminated width × reduced width`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slot {
    pub(crate) eliminated: u32,
    pub(crate) reduced: u32,
    /// First reduced column of the neighbour.
    pub(crate) start: u32,
    pub(crate) width: u32,
    /// Where the coupling begins.
    pub(crate) offset: usize,
}

/// Two reduced blocks that share observations, perhaps a block and itself: a block of U, column-major.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    /// First reduced row; the rows' block comes after the columns' or is the same.
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    /// Where it begins.
    pub(crate) offset: usize,
}

/// What becomes of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Nothing of it is free.
    Held,
    Reduced(u32),
    Eliminated(u32),
}

/// Lists of numbers, one after another.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lists {
    starts: Vec<usize>,
    items: Vec<u32>,
}

impl Lists {
    pub(crate) fn list(&self, index: usize) -> &[u32] {
        &self.items[self.starts[index]..self.starts[index + 1]]
    }

    /// From pairs of list and item, each list in the order of the pairs.
    pub(crate) fn new(count: usize, pairs: impl Iterator<Item = (usize, u32)> + Clone) -> Self {
        let mut starts = vec![0; count + 1];
        for (list, _) in pairs.clone() {
            starts[list + 1] += 1;
        }
        for index in 0..count {
            starts[index + 1] += starts[index];
        }
        let (mut next, mut items) = (starts.clone(), vec![0; starts[count]]);
        for (list, item) in pairs {
            items[next[list]] = item;
            next[list] += 1;
        }
        Self { starts, items }
    }
}

impl Eliminated {
    pub(crate) fn slots(&self) -> Range<usize> {
        self.slots.0..self.slots.1
    }

    pub(crate) fn columns(&self) -> Range<usize> {
        self.column..self.column + self.width
    }

    pub(crate) fn own(&self) -> Range<usize> {
        self.own..self.own + self.width * self.width
    }
}

impl Reduced {
    pub(crate) fn reduced_columns(&self) -> Range<usize> {
        self.start..self.start + self.width
    }
}

impl Slot {
    pub(crate) fn reduced_columns(&self) -> Range<usize> {
        self.start as usize..(self.start + self.width) as usize
    }

    pub(crate) fn width(&self) -> usize {
        self.width as usize
    }
}

impl Structure {
    /// The division, or `None` where it does not pay: small problems are factorised orthogonally, and where less than a
    /// third of the unknowns can be eliminated the dense factorisation is as fast.
    pub(crate) fn choose(adjustment: &Adjustment<'_>, layout: &Layout) -> Option<Self> {
        if OrthogonalFactor::is_cheap(layout) {
            return None;
        }
        let graph = Graph::new(adjustment, layout);
        let chosen = graph.independent(layout);
        let eliminated: usize = (0..layout.blocks()).filter(|&b| chosen[b]).map(|b| layout.free(b).len()).sum();
        (3 * eliminated >= layout.unknowns).then(|| Self::new(layout, &graph, &chosen))
    }

    fn new(layout: &Layout, graph: &Graph, chosen: &[bool]) -> Self {
        let mut this = Self {
            reduced: Vec::new(),
            eliminated: Vec::new(),
            slots: Vec::new(),
            order: 0,
            roles: vec![Role::Held; layout.blocks()],
            slot_of_part: vec![u32::MAX; layout.all_parts().len()],
            pairs: Vec::new(),
            pair_entries: 0,
            pair_starts: vec![0],
            pair_of: Vec::new(),
            eliminated_observations: Lists::default(),
            reduced_slots: Lists::default(),
        };
        this.place_reduced(layout, graph, chosen);
        this.place_eliminated(layout, graph, chosen);
        this.list(layout);
        this.list_pairs(layout);
        this
    }

    /// Whether eliminated blocks have so many neighbours that whole rows are multiplied, zeros among them.
    pub(crate) fn is_crowded(&self) -> bool {
        let products = |block: &Eliminated| {
            let extent: usize = self.slots[block.slots()].iter().map(Slot::width).sum();
            (block.width as f64) * (extent as f64).powi(2)
        };
        let rows: usize = self.eliminated.iter().map(|block| block.width).sum();
        let all = rows as f64 * (self.order as f64).powi(2);
        self.eliminated.iter().map(products).sum::<f64>() > CROWDED * all
    }

    /// The couplings of consecutive eliminated blocks as whole columns over the reduced unknowns, from memory that begins
    /// with theirs.
    pub(crate) fn columns(&self, blocks: &[Eliminated], couplings: &[f64]) -> Vec<f64> {
        let count: usize = blocks.iter().map(|block| block.width).sum();
        let mut out = vec![0.0; count * self.order];
        let first = blocks.first().map_or(0, |block| block.coupling);
        let mut columns = out.chunks_exact_mut(self.order.max(1));
        for block in blocks {
            for (row, column) in columns.by_ref().take(block.width).enumerate() {
                for slot in &self.slots[block.slots()] {
                    let start = slot.offset - first + row * slot.width();
                    column[slot.reduced_columns()].copy_from_slice(&couplings[start..start + slot.width()]);
                }
            }
        }
        out
    }

    /// The reduced parts of an observation, in the order of reduced columns: block and where it lies in a row.
    pub(crate) fn reduced_parts(&self, parts: &[Part], out: &mut Vec<(Reduced, usize)>) {
        out.clear();
        for part in parts {
            if let Role::Reduced(index) = self.roles[part.block as usize] {
                out.push((self.reduced[index as usize], part.offset as usize));
            }
        }
        out.sort_unstable_by_key(|(block, _)| block.start);
    }

    fn list_pairs(&mut self, layout: &Layout) {
        let mut numbers = HashMap::new();
        let mut parts = Vec::new();
        let mut last = ((usize::MAX, usize::MAX), 0);
        for place in &layout.observations {
            self.reduced_parts(layout.parts(place), &mut parts);
            for (index, (column, _)) in parts.iter().enumerate() {
                for (row, _) in &parts[index..] {
                    let key = (row.start, column.start);
                    if last.0 != key {
                        let next = self.pairs.len() as u32;
                        last = (key, *numbers.entry(key).or_insert(next));
                    }
                    if last.1 as usize == self.pairs.len() {
                        let (rows, columns) = (row.width, column.width);
                        let offset = self.pair_entries;
                        self.pairs.push(Pair { row: row.start, column: column.start, rows, columns, offset });
                        self.pair_entries += rows * columns;
                    }
                    self.pair_of.push(last.1);
                }
            }
            self.pair_starts.push(self.pair_of.len() as u32);
        }
    }

    fn place_reduced(&mut self, layout: &Layout, graph: &Graph, chosen: &[bool]) {
        let free = |block: &usize| !chosen[*block] && !layout.free(*block).is_empty();
        let mut blocks: Vec<usize> = (0..layout.blocks()).filter(free).collect();
        blocks.sort_by_key(|&block| (graph.degree[block], block));
        for block in blocks {
            let (column, width) = (layout.free(block).start, layout.free(block).len());
            self.roles[block] = Role::Reduced(self.reduced.len() as u32);
            self.reduced.push(Reduced { block, column, start: self.order, width });
            self.order += width;
        }
    }

    fn place_eliminated(&mut self, layout: &Layout, graph: &Graph, chosen: &[bool]) {
        let (mut own, mut coupling) = (0, 0);
        let mut neighbours = Vec::new();
        for block in (0..layout.blocks()).filter(|&block| chosen[block]) {
            let (column, width) = (layout.free(block).start, layout.free(block).len());
            neighbours.clear();
            for &observation in graph.observations.list(block) {
                for part in layout.parts(&layout.observations[observation as usize]) {
                    if let Role::Reduced(index) = self.roles[part.block as usize] {
                        neighbours.push(index);
                    }
                }
            }
            neighbours.sort_unstable();
            neighbours.dedup();
            let first = self.slots.len();
            let start = coupling;
            for &index in &neighbours {
                let reduced = self.reduced[index as usize];
                self.slots.push(Slot {
                    eliminated: self.eliminated.len() as u32,
                    reduced: index,
                    start: reduced.start as u32,
                    width: reduced.width as u32,
                    offset: coupling,
                });
                coupling += width * reduced.width;
            }
            self.roles[block] = Role::Eliminated(self.eliminated.len() as u32);
            let slots = (first, self.slots.len());
            self.eliminated.push(Eliminated { block, column, width, own, coupling: start, slots });
            own += width * width;
        }
    }

    /// The eliminated block among the parts of an observation.
    pub(crate) fn eliminated_part(&self, parts: &[Part]) -> Option<(usize, Part)> {
        parts.iter().find_map(|part| match self.roles[part.block as usize] {
            Role::Eliminated(index) => Some((index as usize, *part)),
            _ => None,
        })
    }

    fn list(&mut self, layout: &Layout) {
        let mut eliminated = Vec::new();
        for (index, place) in layout.observations.iter().enumerate() {
            let own = self.eliminated_part(layout.parts(place)).map(|(own, _)| own);
            for (part, at) in layout.parts(place).iter().zip(place.part_range()) {
                match self.roles[part.block as usize] {
                    Role::Reduced(block) => {
                        if let Some(own) = own {
                            let slots = self.eliminated[own].slots();
                            let found = self.slots[slots.clone()].binary_search_by_key(&block, |slot| slot.reduced);
                            self.slot_of_part[at] = found.map_or(u32::MAX, |found| (slots.start + found) as u32);
                        }
                    }
                    Role::Eliminated(block) => eliminated.push((block as usize, index as u32)),
                    Role::Held => {}
                }
            }
        }
        self.eliminated_observations = Lists::new(self.eliminated.len(), eliminated.into_iter());
        let slots = self.slots.iter().enumerate().map(|(index, slot)| (slot.reduced as usize, index as u32));
        self.reduced_slots = Lists::new(self.reduced.len(), slots);
    }
}
