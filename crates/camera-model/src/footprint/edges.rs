//! Pixels whose patches may go over an edge.

use range_image::Flags;
use statistics::mad_scale;

use super::Seen;
use super::local_planes::around;
use crate::OrganisedCloud;

/// Standard deviations by which a pixel lies beside the line between opposite neighbours where it, or one of them, goes over an edge: of
/// four directions, one pixel in 4000 of a plane does. Three would take one in 90, five leaves edges of twenty degrees in noise.
const BESIDE: f64 = 4.0;
/// Least scale of what is beside: exact surfaces leave rounding.
const LEAST_SCALE: f64 = 0.1;
/// Pixels from which the scale of noise is found: it is known to a third of a percent then.
const SAMPLE: usize = 32_768;

/// Tells which pixels of a frame lie at edges.
pub(super) struct Edges<'a> {
    seen: &'a [Seen],
    cloud: &'a OrganisedCloud,
    has_mixed: bool,
    scale: f64,
}

impl<'a> Edges<'a> {
    pub(super) fn new(seen: &'a [Seen], cloud: &'a OrganisedCloud) -> Self {
        let has_mixed = cloud.flags.iter().any(|flags| flags.contains(Flags::MIXED_PIXEL));
        let unscaled = Self { seen, cloud, has_mixed, scale: 1.0 };
        // Odd: images are an even number of columns wide, and a step that divides it would see a few of them only.
        let sample = (0..seen.len()).step_by((seen.len() / SAMPLE) | 1);
        let beside = sample.flat_map(|index| unscaled.beside(index % cloud.width, index / cloud.width));
        let mut known: Vec<f64> = beside.flatten().map(f64::sqrt).collect();
        // Deviations that come with the points may have any scale.
        Self { scale: mad_scale(&mut known).max(LEAST_SCALE), ..unscaled }
    }

    /// What the standard deviations of the ranges have to be multiplied by.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether a pixel, or one beside it, goes over an edge.
    pub(super) fn is_at_edge(&self, col: usize, row: usize) -> bool {
        let most = (BESIDE * self.scale).powi(2);
        self.beside(col, row).iter().flatten().any(|squared| *squared > most)
            || self.has_mixed && self.is_beside_mixed(col, row)
    }

    /// Squared distances of a pixel from the lines between opposite neighbours, over their variances.
    fn beside(&self, col: usize, row: usize) -> [Option<f64>; 4] {
        let OrganisedCloud { width, height, .. } = *self.cloud;
        let (has_cols, has_rows) = ((1..width - 1).contains(&col), (1..height - 1).contains(&row));
        let (index, has_both) = (row * width + col, has_cols && has_rows);
        let own = &self.seen[index];
        [(1, has_cols), (width, has_rows), (width + 1, has_both), (width - 1, has_both)].map(|(step, has)| {
            let [before, after] = if has { [&self.seen[index - step], &self.seen[index + step]] } else { return None };
            if !(own.is_known() && before.is_known() && after.is_known()) {
                return None;
            }
            let second = (before.inverse + after.inverse - 2.0 * own.inverse) / (own.inverse * own.inverse);
            let variance = before.sigma_m.powi(2) + after.sigma_m.powi(2) + 4.0 * own.sigma_m.powi(2);
            Some(second * second / variance)
        })
    }

    /// Whether a pixel or one about it mixes two surfaces: what is left of it may reach into this pixel.
    fn is_beside_mixed(&self, col: usize, row: usize) -> bool {
        let OrganisedCloud { width, height, .. } = *self.cloud;
        let rows = around(row, height, 1).map(|row| &self.cloud.flags[row * width..][around(col, width, 1)]);
        rows.flatten().any(|flags| flags.contains(Flags::MIXED_PIXEL))
    }
}
