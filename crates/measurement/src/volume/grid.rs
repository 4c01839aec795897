//! The footprint of a region on a plane as a grid, and the points over its cells.

use nalgebra::Point3;

use super::{Cell, Frame};
use crate::region::Part;
use crate::{Error, Result};

/// Lines along each edge of a cell that tell how much of it lies in the footprint: an edge that runs through cells is known to a
/// tenth of their size, and over many cells far better.
const LINES: usize = 5;
/// Most cells: the memory of a large cloud. More points than that are seldom in one region.
const MOST_CELLS: f64 = 4_194_304.0;
/// Least determinant of the cells' positions around a cell, in parts of that of a full ring: below it they lie in a line, and only the
/// slope along it would be known.
const LEAST_SPREAD: f64 = 0.02;

/// The footprint: cells by rows.
pub(super) struct Grid {
    cell_m: f64,
    start: [f64; 2],
    size: [usize; 2],
    /// Area in the footprint and its middle.
    cells: Vec<Option<(f64, [f64; 2])>>,
}

/// A cell with points.
pub(super) struct Filled {
    position: [usize; 2],
    pub(super) area_m2: f64,
    /// Middle of the footprint in it.
    pub(super) middle: [f64; 2],
    pub(super) points: Vec<usize>,
    /// Mean of its points: two coordinates and height.
    mean: [f64; 3],
    pub(super) slope: [f64; 2],
}

impl Filled {
    /// Height of the surface in the middle of the footprint.
    pub(super) fn height(&self) -> f64 {
        let way = [0, 1].map(|axis| self.middle[axis] - self.mean[axis]);
        self.mean[2] + self.slope[0] * way[0] + self.slope[1] * way[1]
    }
}

impl Grid {
    pub(super) fn new(parts: &[Part], frame: &Frame, cell_m: f64) -> Result<Self> {
        if !(cell_m > 0.0 && cell_m.is_finite()) {
            return Err(Error::OutOfDomain {
                name: "cell_m",
                value: cell_m,
                expected: "a length is positive and finite",
            });
        }
        let (mut start, mut cells) = ([0.0; 2], [0.0; 2]);
        for axis in 0..2 {
            let mut span = [f64::INFINITY, f64::NEG_INFINITY];
            for part in parts {
                let [low, high] = part.extent(&frame.axes[axis]).ok_or(Error::Unbounded)?;
                span = [span[0].min(low), span[1].max(high)];
            }
            start[axis] = span[0] - frame.axes[axis].dot(&frame.origin);
            // Rounding does not make a column of its own.
            cells[axis] = ((span[1] - span[0]) / cell_m - 1e-9).ceil().max(1.0);
        }
        if cells[0] * cells[1] > MOST_CELLS {
            let expected = "larger cells: the footprint would have more than four million";
            return Err(Error::OutOfDomain { name: "cell_m", value: cell_m, expected });
        }
        let size = cells.map(|count| count as usize);
        let mut grid = Self { cell_m, start, size, cells: Vec::new() };
        let covered = |at: usize| grid.covered(parts, frame, [at % size[0], at / size[0]]);
        grid.cells = (0..size[0] * size[1]).map(covered).collect();
        Ok(grid)
    }

    /// Area and middle of the part of a cell over or under which the region lies.
    fn covered(&self, parts: &[Part], frame: &Frame, position: [usize; 2]) -> Option<(f64, [f64; 2])> {
        let (mut count, mut sum) = (0.0, [0.0; 2]);
        for line in 0..LINES * LINES {
            let inside = [line % LINES, line / LINES].map(|at| (at as f64 + 0.5) / LINES as f64);
            let at = [0, 1].map(|axis| self.start[axis] + (position[axis] as f64 + inside[axis]) * self.cell_m);
            let place = frame.on_plane(at);
            if parts.iter().any(|part| part.meets(&place, &frame.normal)) {
                count += 1.0;
                sum = [sum[0] + at[0], sum[1] + at[1]];
            }
        }
        let area = self.cell_m * self.cell_m * count / (LINES * LINES) as f64;
        (count > 0.0).then(|| (area, sum.map(|sum| sum / count)))
    }

    /// Cells of the footprint with points, and those without.
    pub(super) fn filled(&self, cloud: &[Point3<f64>], points: &[usize], frame: &Frame) -> (Vec<Filled>, Vec<Cell>) {
        let mut over: Vec<Vec<usize>> = vec![Vec::new(); self.cells.len()];
        for index in points {
            let local = frame.local(&cloud[*index].coords);
            let [column, row] = [0, 1].map(|axis| ((local[axis] - self.start[axis]) / self.cell_m).floor());
            let inside = column >= 0.0 && row >= 0.0 && column < self.size[0] as f64 && row < self.size[1] as f64;
            if inside {
                over[row as usize * self.size[0] + column as usize].push(*index);
            }
        }
        let (mut filled, mut missing) = (Vec::new(), Vec::new());
        for (at, points) in over.into_iter().enumerate() {
            let Some((area_m2, middle)) = self.cells[at] else { continue };
            let position = [at % self.size[0], at / self.size[0]];
            if points.is_empty() {
                missing.push(Cell { position, middle: frame.on_plane(middle).into(), area_m2 });
                continue;
            }
            let mut mean = [0.0; 3];
            for local in points.iter().map(|index| frame.local(&cloud[*index].coords)) {
                for (mean, local) in mean.iter_mut().zip(local) {
                    *mean += local / points.len() as f64;
                }
            }
            filled.push(Filled { position, area_m2, middle, points, mean, slope: [0.0; 2] });
        }
        self.slopes(&mut filled);
        (filled, missing)
    }

    /// Slopes by a plane through each cell and those around it, weighted by their points; zero where these lie in a line.
    fn slopes(&self, filled: &mut [Filled]) {
        let mut place = vec![usize::MAX; self.cells.len()];
        for (at, cell) in filled.iter().enumerate() {
            place[cell.position[1] * self.size[0] + cell.position[0]] = at;
        }
        let slopes: Vec<[f64; 2]> = filled.iter().map(|cell| self.slope(cell, filled, &place)).collect();
        for (cell, slope) in filled.iter_mut().zip(slopes) {
            cell.slope = slope;
        }
    }

    fn slope(&self, cell: &Filled, filled: &[Filled], place: &[usize]) -> [f64; 2] {
        let around = (0..9_usize).filter_map(|at| {
            let column = (cell.position[0] + at % 3).checked_sub(1).filter(|column| *column < self.size[0])?;
            let row = (cell.position[1] + at / 3).checked_sub(1).filter(|row| *row < self.size[1])?;
            filled.get(place[row * self.size[0] + column])
        });
        let around: Vec<&Filled> = around.collect();
        let total: f64 = around.iter().map(|other| other.points.len() as f64).sum();
        let middle = [0, 1, 2]
            .map(|axis| around.iter().map(|other| other.mean[axis] * other.points.len() as f64).sum::<f64>() / total);
        let [mut xx, mut xy, mut yy, mut xz, mut yz] = [0.0; 5];
        for other in around {
            let weight = other.points.len() as f64 / total;
            let [x, y, z] = [0, 1, 2].map(|axis| other.mean[axis] - middle[axis]);
            xx += weight * x * x;
            xy += weight * x * y;
            yy += weight * y * y;
            xz += weight * x * z;
            yz += weight * y * z;
        }
        let determinant = xx * yy - xy * xy;
        // Of a full ring: two thirds of a cell's edge squared in both directions.
        if determinant < LEAST_SPREAD * (2.0 / 3.0 * self.cell_m * self.cell_m).powi(2) {
            return [0.0; 2];
        }
        [(yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant]
    }
}
