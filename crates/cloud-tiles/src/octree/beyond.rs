//! A node of more points than memory may hold: they go through the nodes of the next levels to those that can be built in memory.

use std::collections::BTreeMap;

use super::key::{Cells, Key};
use super::spill::Chain;
use super::{Octree, Source};
use crate::record::place;
use crate::{Error, Result};

/// Levels that are counted at once: 128 cells along each axis, 17 MB.
const COUNTED: u32 = 7;

/// A node between the one that is too large and those that are not.
enum Between {
    /// Keeps the first point in each of its cells.
    Keeps(Cells, Chain),
    /// Takes all that comes, to be built later.
    Takes(Chain),
}

impl Octree<'_> {
    pub(super) fn beyond(&mut self, key: Key, source: &Source<'_>) -> Result<()> {
        let mut nodes = self.between(key, source)?;
        let bits = self.bits;
        self.each(source, &mut |spill, record| {
            let place = place(record);
            let mut at = key;
            loop {
                match nodes.get_mut(&at) {
                    Some(Between::Keeps(cells, chain)) => {
                        if cells.take(at.cell(place, bits)) {
                            return spill.push(chain, record);
                        }
                        at = at.child(at.octant(place, bits) as u32);
                    }
                    Some(Between::Takes(chain)) => return spill.push(chain, record),
                    // All were counted before.
                    None => return Err(Error::Changed),
                }
            }
        })?;
        self.hand_on_between(key, &mut nodes)
    }

    /// Each node before its children.
    fn hand_on_between(&mut self, key: Key, nodes: &mut BTreeMap<Key, Between>) -> Result<()> {
        match nodes.remove(&key) {
            None => Ok(()),
            Some(Between::Takes(chain)) if chain.records() == 0 => Ok(()),
            Some(Between::Takes(chain)) => self.build(key, &Source::Chain(chain)),
            Some(Between::Keeps(cells, chain)) => {
                drop(cells);
                let own = self.all(chain.records(), &Source::Chain(chain))?;
                self.sink.node(key, &own)?;
                (0..8).try_for_each(|octant| self.hand_on_between(key.child(octant), nodes))
            }
        }
    }

    /// The nodes that points are parted among: below one of too many points its children, down to the cells that were counted.
    fn between(&mut self, key: Key, source: &Source<'_>) -> Result<BTreeMap<Key, Between>> {
        // Below a step of the coordinates nothing is parted.
        let levels = COUNTED.min(self.bits - key.level);
        let mut counts = vec![0_u64; 1 << (3 * levels)];
        let bits = self.bits;
        self.each(source, &mut |_, record| {
            let cell = Key::containing(place(record), key.level + levels, bits);
            counts[index(cell, levels)] += 1;
            Ok(())
        })?;
        let mut nodes = BTreeMap::new();
        self.part(key, (key.level, levels), &counts, &mut nodes);
        let buffers = nodes.len();
        self.spill.share(buffers);
        Ok(nodes)
    }

    /// Adds a node and what is below it; how many points lie in it.
    fn part(&self, key: Key, (top, levels): (u32, u32), counts: &[u64], nodes: &mut BTreeMap<Key, Between>) -> u64 {
        let depth = top + levels - key.level;
        let points = if depth == 0 {
            counts[index(key, levels)]
        } else {
            let mut below = BTreeMap::new();
            let points = (0..8).map(|octant| self.part(key.child(octant), (top, levels), counts, &mut below)).sum();
            if points > self.most && key.is_parted(self.bits) {
                nodes.append(&mut below);
                nodes.insert(key, Between::Keeps(Cells::new(), Chain::default()));
                return points;
            }
            points
        };
        if points > 0 {
            nodes.insert(key, Between::Takes(Chain::default()));
        }
        points
    }
}

/// Place of a cell among those that are counted.
fn index(cell: Key, levels: u32) -> usize {
    let mask = (1 << levels) - 1;
    cell.place.iter().fold(0, |index, x| index << levels | (x & mask) as usize)
}
