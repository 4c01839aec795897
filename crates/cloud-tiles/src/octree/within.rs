//! A node and all below it, of points in memory.

use super::key::{Cells, Key};
use super::{LEAF, Octree};
use crate::Result;
use crate::record::place;

impl Octree<'_> {
    pub(super) fn within(&mut self, key: Key, records: &[u8]) -> Result<()> {
        let all: Vec<u32> = (0..(records.len() / self.length) as u32).collect();
        self.node(key, records, all)
    }

    fn node(&mut self, key: Key, records: &[u8], points: Vec<u32>) -> Result<()> {
        if points.is_empty() {
            return Ok(());
        }
        if points.len() <= LEAF || !key.is_parted(self.bits) {
            return self.hand_on(key, records, &points);
        }
        let (mut cells, mut own, mut further) = (Cells::new(), Vec::new(), [const { Vec::new() }; 8]);
        for point in points {
            let place = place(&records[point as usize * self.length..]);
            if cells.take(key.cell(place, self.bits)) {
                own.push(point);
            } else {
                further[key.octant(place, self.bits)].push(point);
            }
        }
        drop(cells);
        self.hand_on(key, records, &own)?;
        for (octant, points) in (0..).zip(further) {
            self.node(key.child(octant), records, points)?;
        }
        Ok(())
    }

    fn hand_on(&mut self, key: Key, records: &[u8], points: &[u32]) -> Result<()> {
        let length = self.length;
        let mut own = Vec::with_capacity(points.len() * length);
        for point in points {
            own.extend_from_slice(&records[*point as usize * length..][..length]);
        }
        self.sink.node(key, &own)
    }
}
