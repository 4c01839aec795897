//! Cells of space labelled with a near point: a nearest neighbour at the price of one look.

use crate::cells::{CellTable, key_of, middle, shifted};
use crate::description::fpfh::{dot, subtract};

/// Every cell in reach of a point names the point nearest to its middle.
#[derive(Debug, Clone)]
pub(crate) struct Labels {
    per_cell: f32,
    table: CellTable,
}

impl Labels {
    /// Labels the cells of the points that are `usable` and the 26 about each.
    pub(crate) fn new(points: &[[f32; 3]], usable: impl Fn(usize) -> bool, cell: f32) -> Self {
        let per_cell = 1.0 / cell;
        let mut table = CellTable::new(4 * points.len());
        let distance = |key: u64, i: u32| {
            let d = subtract(middle(key), points[i as usize].map(|c| c * per_cell));
            dot(d, d)
        };
        for i in (0..points.len()).filter(|&i| usable(i)) {
            let Some(key) = key_of(points[i], per_cell) else { continue };
            for step in 0..27 {
                let key = shifted(key, [step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1]);
                let (label, is_new) = table.get_or_insert(key, i as u32);
                if !is_new && distance(key, i as u32) < distance(key, label) {
                    table.set(key, i as u32);
                }
            }
        }
        Self { per_cell, table }
    }

    #[inline]
    pub(crate) fn near(&self, point: [f32; 3]) -> Option<usize> {
        key_of(point, self.per_cell).and_then(|key| self.table.get(key)).map(|i| i as usize)
    }
}
