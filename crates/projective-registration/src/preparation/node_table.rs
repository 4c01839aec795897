//! The nodes on which the rays of a camera fall that follow no formula.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use crate::preparation::table::Table;

/// Nodes a side of a piece. Lenses are smooth: over four nodes of three pixels a lens that shifts the rim by 2 % of the frame leaves a straight
/// line by less than a hundredth of a node, and a table of every node would not stay in the cache beside the planes (0.3 and 0.5 MB of 640 x 480 pixels).
const SPACING: f64 = 4.0;
/// Above the number of nodes of any frame: from there on single precision holds whole numbers, in its low bits.
const TWO_TO_23: f32 = 8_388_608.0;

/// Nodes over a regular grid in u = x/depth, v = y/depth, in bilinear pieces: one load tells a whole piece.
#[derive(Debug)]
pub(crate) struct NodeTable {
    origin: [f32; 2],
    /// Pieces per unit of u and v.
    density: [f32; 2],
    /// Pieces along u and v.
    cols: usize,
    rows: usize,
    /// Column of nodes at the first corner of each piece, what it rises by along u, along v, and along both; then the row. NaN where no ray leads.
    pieces: Vec<[f32; 8]>,
}

impl NodeTable {
    /// `rays`: (u, v) of each node, row by row.
    pub(crate) fn new(cols: usize, rows: usize, rays: &[[f64; 2]]) -> Self {
        let table = Table::of_every(SPACING, cols, rows, rays);
        let (cols, rows) = (table.cols - 1, table.rows - 1);
        let piece = |k: usize| {
            let first = k / cols * table.cols + k % cols;
            let corners = [0, 1, table.cols, table.cols + 1].map(|step| table.pixels[first + step]);
            let [along_u, along_v, both] = [
                [0, 1].map(|i| corners[1][i] - corners[0][i]),
                [0, 1].map(|i| corners[2][i] - corners[0][i]),
                [0, 1].map(|i| corners[3][i] - corners[2][i] - (corners[1][i] - corners[0][i])),
            ];
            let of = |i: usize| [corners[0][i], along_u[i], along_v[i], both[i]];
            let ([a, b, c, d], [e, f, g, h]) = (of(0), of(1));
            [a, b, c, d, e, f, g, h]
        };
        Self {
            origin: table.origin.map(|o| o as f32),
            density: table.density.map(|d| d as f32),
            cols,
            rows,
            pieces: (0..cols * rows).map(piece).collect(),
        }
    }

    /// Columns and rows of the nodes that look along (u, v, -1), some at a time; NaN or outside the frame where none does.
    #[inline(always)]
    pub(crate) fn read<const N: usize>(&self, u: &[f32; N], v: &[f32; N]) -> [[f32; N]; 2] {
        let (most_col, most_row) = (self.cols as f32, self.rows as f32);
        let (mut across, mut down, mut at) = ([0.0; N], [0.0; N], [0_u32; N]);
        for k in 0..N {
            let (x, y) = ((u[k] - self.origin[0]) * self.density[0], (v[k] - self.origin[1]) * self.density[1]);
            // What lies beyond the table is at its rim, outside the frame. No branches: they would be taken lane by lane. NaN becomes 0.
            let (x, y) = (if x > 0.0 { x } else { 0.0 }, if y > 0.0 { y } else { 0.0 });
            let (x, y) = (if x < most_col { x } else { most_col }, if y < most_row { y } else { most_row });
            let (col, row) = (x.floor(), y.floor());
            let col = if col < most_col - 1.0 { col } else { most_col - 1.0 };
            let row = if row < most_row - 1.0 { row } else { most_row - 1.0 };
            (across[k], down[k]) = (x - col, y - row);
            at[k] = whole(row * most_col + col);
        }
        let mut pieces = [[f32::NAN; 8]; N];
        for k in 0..N {
            pieces[k] = self.pieces[at[k] as usize];
        }
        let mut terms = [[0.0; N]; 8];
        for k in 0..N {
            for i in 0..8 {
                terms[i][k] = pieces[k][i];
            }
        }
        let mut found = [[0.0; N]; 2];
        for k in 0..N {
            let (a, b) = (across[k], down[k]);
            found[0][k] = terms[0][k] + a * terms[1][k] + b * (terms[2][k] + a * terms[3][k]);
            found[1][k] = terms[4][k] + a * terms[5][k] + b * (terms[6][k] + a * terms[7][k]);
        }
        found
    }
}

/// A whole number below 2²³, as the low bits of its sum with that: a cast would be done lane by lane.
#[inline(always)]
pub(crate) fn whole(number: f32) -> u32 {
    (number + TWO_TO_23).to_bits() ^ TWO_TO_23.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays of a frame whose lens shifts the rim by a tenth of the half of the frame.
    fn ray(col: f64, row: f64) -> [f64; 2] {
        let (x, y) = ((col - 106.0) / 106.0, (79.5 - row) / 106.0);
        let factor = 0.6 * (1.0 + 0.1 * (x * x + y * y));
        [x * factor, y * factor]
    }

    #[test]
    fn rays_between_nodes_are_found_up_to_the_rim_of_the_frame() {
        let (cols, rows) = (213, 160);
        let rays: Vec<[f64; 2]> = (0..cols * rows).map(|k| ray((k % cols) as f64, (k / cols) as f64)).collect();
        let table = NodeTable::new(cols, rows, &rays);
        for k in 0..4000_usize {
            // All over the frame, half a node beyond its outer nodes included.
            let at = [(k * 1597 % 4001) as f64 / 4001.0 * 213.0 - 0.5, (k * 2741 % 4003) as f64 / 4003.0 * 160.0 - 0.5];
            let [u, v] = ray(at[0], at[1]);
            let [col, row] = table.read(&[u as f32], &[v as f32]);
            let off = (f64::from(col[0]) - at[0]).hypot(f64::from(row[0]) - at[1]);
            assert!(off < 0.02, "{at:?}: {col:?} {row:?}");
        }
        for [u, v] in [[5.0, 0.0], [-5.0, 0.1], [0.0, 3.0], [0.0, -1e9], [1e30, 1e30], [f32::NAN, 0.0]] {
            let [col, row] = table.read(&[u], &[v]);
            let inside = (-0.5..212.5).contains(&col[0]) && (-0.5..159.5).contains(&row[0]);
            assert!(!inside, "{u} {v}: {col:?} {row:?}");
        }
    }
}
