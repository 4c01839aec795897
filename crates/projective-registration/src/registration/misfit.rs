//! How well surfaces lie on each other at a pose, whatever moves by itself.
//!
//! Where something large and near moves, two poses compete: one of the room, one of what moves. Near surfaces are known so much better
//! that the sum over nodes, each of which counts by its own noise, may prefer the latter, though all of the room then lies a little
//! beside itself. Over cells of the frame that is plain: noise goes down in the mean of a cell, what lies beside does not, and the middle
//! one of all cells does not care by how much a few are off.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use icp_registration::TUKEY;
use nalgebra::{Isometry3, Vector3};
use point_cloud::SAME_SURFACE_COSINE;
use statistics::SIGMA_OF_MAD;

use crate::partners::locate::{Locate, WithLocate, with_locate};
use crate::partners::pairs::{AT_ONCE, Moved};
use crate::preparation::bits::{median_of_bits, positive_bits};
use crate::preparation::blocks::{Block, Points};
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::BLOCK;
use crate::registration::aligner::FrameAligner;

impl FrameAligner {
    /// How far surfaces of `source` lie beside those of `target` at a pose `target_from_source`: the mean residual of each cell of the
    /// frame (some 400) over its standard deviation, in size, and the median of these. About 0.7 where there is nothing but the noise of
    /// the nodes. `None` where the frames have no surface in common.
    pub fn misfit(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        target_from_source: &Isometry3<f64>,
    ) -> Option<f64> {
        let moved = Moved::new(source, target, target_from_source, &Vector3::zeros(), 1.0);
        self.means.clear();
        self.means.resize(source.grid.cell_count, [0.0; 2]);
        let (blocks, cells) = (&source.points.blocks, &source.grid.cells);
        with_locate(target, Means { moved: &moved, blocks, cells, sums: &mut self.means });
        self.scratch.clear();
        let of_cells = self.means.iter().filter(|[_, count]| *count > 0.0);
        self.scratch.extend(of_cells.map(|mean| positive_bits(in_sigmas(*mean))));
        median_of_bits(&mut self.scratch).map(f64::from)
    }

    /// The points of a frame without the cells that lie beside the surfaces of another one, at a pose, farther than most cells let expect.
    /// Their memory is that of the aligner, to be given back.
    pub(crate) fn without_strays(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        pose: &Isometry3<f64>,
    ) -> Points {
        let usual = SIGMA_OF_MAD * self.misfit(source, target, pose).unwrap_or(0.0);
        let reach = (TUKEY * usual.max(1.0)) as f32;
        let mut blocks = std::mem::take(&mut self.rest);
        blocks.clone_from(&source.points.blocks);
        for (block, cells) in blocks.iter_mut().zip(&source.grid.cells) {
            for (variance, cell) in block.variance.iter_mut().zip(cells) {
                if in_sigmas(self.means[usize::from(*cell)]) > reach {
                    *variance = f32::NAN;
                }
            }
        }
        Points { blocks, ..source.points }
    }
}

/// Size of the mean of a cell over its standard deviation, from the sum of its residuals over theirs and their number.
fn in_sigmas([sum, count]: [f32; 2]) -> f32 {
    sum.abs() / count.sqrt()
}

/// Sums of residuals over their standard deviations, and how many there are, of each cell.
struct Means<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    cells: &'a [[u16; BLOCK]],
    sums: &'a mut [[f32; 2]],
}

impl WithLocate for Means<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(self, locate: L) {
        let reach = TUKEY as f32;
        for (blocks, cells) in self.blocks.chunks(AT_ONCE).zip(self.cells.chunks(AT_ONCE)) {
            let distances = self.moved.distances(locate, blocks.iter());
            for (k, cell) in cells.iter().flatten().enumerate() {
                let residual = distances.residual[k] / distances.variance[k].sqrt();
                // NaN fails: no partner.
                if distances.cosine[k] >= SAME_SURFACE_COSINE as f32 && residual.is_finite() {
                    let [sum, count] = &mut self.sums[usize::from(*cell)];
                    *sum += residual.clamp(-reach, reach);
                    *count += 1.0;
                }
            }
        }
    }
}
