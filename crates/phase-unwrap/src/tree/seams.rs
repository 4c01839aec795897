//! Links beyond the four of the grid: across the seam of a cyclic axis, and from frame to frame.

use crate::Boundary;
use crate::tree::grid::Grid;

/// A link between two pixels that are no neighbours on the grid. Seams come after all links of the grid in the order of
/// equal costs, and among themselves in the order of their list.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seam {
    pub from: u32,
    pub to: u32,
    /// Cost beyond that of the two pixels, rad^2.
    pub surcharge: f32,
}

impl Seam {
    /// Index step of the axis that a seam of a cyclic axis closes.
    pub fn ahead(&self, grid: &Grid) -> usize {
        let (col, other) = (self.from as usize % grid.stride, self.to as usize % grid.stride);
        if col == other { grid.stride } else { 1 }
    }
}

/// Seams of a block of `frames` grids of equal height one below the other, `pitch` rows apart.
pub(crate) fn cyclic_seams(grid: &Grid, frame: [usize; 3], boundaries: [Boundary; 2], seams: &mut Vec<Seam>) {
    let [frames, height, pitch] = frame;
    let seam = |from: usize, to: usize| Seam { from: from as u32, to: to as u32, surcharge: 0.0 };
    seams.clear();
    for first in (0..frames).map(|frame| frame * pitch) {
        if boundaries[0] == Boundary::Cyclic {
            let row = |row: usize| seam(grid.index(grid.width - 1, row), grid.index(0, row));
            seams.extend((first..first + height).map(row));
        }
        if boundaries[1] == Boundary::Cyclic {
            let col = |col: usize| seam(grid.index(col, first + height - 1), grid.index(col, first));
            seams.extend((0..grid.width).map(col));
        }
    }
}

/// Lets the rim of a padded plane show the other side of each cyclic axis.
pub(crate) fn wrap_rim(grid: &Grid, boundaries: [Boundary; 2], plane: &mut [f32]) {
    let stride = grid.stride;
    if boundaries[0] == Boundary::Cyclic {
        for row in plane.chunks_exact_mut(stride) {
            row[0] = row[grid.width];
            row[grid.width + 1] = row[1];
        }
    }
    if boundaries[1] == Boundary::Cyclic {
        let last = grid.height * stride;
        plane.copy_within(last..last + stride, 0);
        plane.copy_within(stride..2 * stride, last + stride);
    }
}
