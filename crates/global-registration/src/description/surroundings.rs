//! Neighbours of all points within a radius, found once.

use rayon::prelude::*;

use crate::cells::{key_of, shifted};
use crate::description::reduced::Reduced;

/// Points of a task.
const CELLS_PER_TASK: usize = 64;

/// Lists of neighbours, one behind the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surroundings {
    starts: Vec<u32>,
    items: Vec<Near>,
}

/// A neighbour.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    pub(crate) index: u32,
    /// Squared distance, metre².
    pub(crate) squared: f32,
}

impl Surroundings {
    /// Sorts the points by cells as wide as the radius, and lists for each the others within it.
    pub(crate) fn sort_and_list(reduced: &mut Reduced, radius: f32) -> Self {
        let keys = sort_by_cells(reduced, radius);
        let points = &reduced.points;
        let cells = runs_of_equal(&keys);
        let lists: Vec<(Vec<u32>, Vec<Near>)> = cells
            .par_chunks(CELLS_PER_TASK)
            .map(|chunk| {
                let (mut lengths, mut items) = (Vec::new(), Vec::new());
                for cell in chunk {
                    let ranges = neighbouring_ranges(&keys, keys[cell.start]);
                    for i in cell.clone() {
                        let before = items.len();
                        list(points, i, &ranges, radius * radius, &mut items);
                        lengths.push((items.len() - before) as u32);
                    }
                }
                (lengths, items)
            })
            .collect();
        let mut starts = vec![0];
        let mut items = Vec::with_capacity(lists.iter().map(|l| l.1.len()).sum());
        let mut end = 0;
        for (lengths, part) in lists {
            starts.extend(lengths.iter().map(|length| {
                end += length;
                end
            }));
            items.extend(part);
        }
        Self { starts, items }
    }

    /// The neighbours of a point, without itself; none where they were not listed.
    pub(crate) fn of(&self, index: usize) -> &[Near] {
        match self.starts.get(index..index + 2) {
            Some(&[first, end]) => &self.items[first as usize..end as usize],
            _ => &[],
        }
    }
}

fn sort_by_cells(reduced: &mut Reduced, cell: f32) -> Vec<u64> {
    let mut order: Vec<(u64, u32)> =
        reduced.points.iter().enumerate().map(|(i, p)| (key_of(*p, 1.0 / cell).unwrap_or(0), i as u32)).collect();
    order.sort_unstable();
    reduced.reorder(&order.iter().map(|o| o.1).collect::<Vec<_>>());
    order.into_iter().map(|o| o.0).collect()
}

fn runs_of_equal(keys: &[u64]) -> Vec<std::ops::Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for end in 1..=keys.len() {
        if end == keys.len() || keys[end] != keys[start] {
            runs.push(start..end);
            start = end;
        }
    }
    runs
}

/// Points of the 27 cells around: three cells along x lie behind each other.
fn neighbouring_ranges(keys: &[u64], key: u64) -> Vec<std::ops::Range<usize>> {
    let mut ranges = Vec::with_capacity(9);
    for z in -1..=1 {
        for y in -1..=1 {
            let (first, last) = (shifted(key, [-1, y, z]), shifted(key, [1, y, z]));
            let start = keys.partition_point(|&k| k < first);
            let end = start + keys[start..].partition_point(|&k| k <= last);
            if start < end {
                ranges.push(start..end);
            }
        }
    }
    ranges
}

fn list(points: &[[f32; 3]], i: usize, ranges: &[std::ops::Range<usize>], limit: f32, items: &mut Vec<Near>) {
    let p = points[i];
    let mut length = items.len();
    let most: usize = ranges.iter().map(ExactSizeIterator::len).sum();
    items.resize(length + most + 1, Near { index: 0, squared: 0.0 });
    for range in ranges {
        for (j, q) in range.clone().zip(&points[range.clone()]) {
            let squared = (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) + (p[2] - q[2]).powi(2);
            // Written always, kept only if near: no branch to be guessed.
            items[length] = Near { index: j as u32, squared };
            length += usize::from(squared <= limit && j != i);
        }
    }
    items.truncate(length);
}
