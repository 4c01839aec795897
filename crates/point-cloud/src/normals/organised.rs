//! Normals of an organised frame from its image neighbours.

use nalgebra::Vector3;
use rayon::prelude::*;
use rigid_pose::{require_length, require_option};

use super::{Neighbourhood, facing, no_normal};
use crate::error::Result;

/// How the neighbourhood of a pixel is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrganisedNormalOptions {
    /// Half width of the window: `2 h + 1` pixels squared. Default 2.
    pub half_width_px: usize,
    /// A neighbour belongs to the surface while its range differs from the centre's by at most this fraction of the
    /// centre's range for each pixel between them. Default 0.03: with pixels of 0.25 degree a surface seen under 8
    /// degrees passes, a step of 9 cm at 3 m beside the pixel does not.
    pub max_relative_jump: f64,
    /// Smallest fraction of the window that must lie on the surface. Default 0.9. Points at edges, corners of the frame
    /// and holes thus get no normal: planes fitted to one-sided windows there lean, and pairs with partners beyond the
    /// edge of what was seen pull a registration aside by a millimetre.
    pub min_fill: f64,
    /// Half width up to which windows are widened, doubled each time, where they lie on one surface but their points are
    /// too noisy to show its plane. Default: that of the window, no pixel gets a wider one.
    pub widest_half_width_px: Option<usize>,
}

impl Default for OrganisedNormalOptions {
    fn default() -> Self {
        Self { half_width_px: 2, max_relative_jump: 0.03, min_fill: 0.9, widest_half_width_px: None }
    }
}

/// Unit normals of a frame, pointing to the camera; NaN in all components where there is none.
///
/// `points`: `width · height` points in the camera frame (perspective centre at the origin), row by row, metre, NaN
/// where there is no range. A plane is fitted to the pixels of the window that lie on the same surface as its centre:
/// windows do not reach over a jump of the range. No normal is given where less than `min_fill` of the window
/// remains, or where its points form a line or a blob.
///
/// # Errors
/// [`InputError::LengthMismatch`](rigid_pose::InputError::LengthMismatch) where the points do not fill the frame, [`InputError::InvalidOption`](rigid_pose::InputError::InvalidOption).
pub fn organised_normals(
    points: &[[f64; 3]],
    width: usize,
    height: usize,
    options: &OrganisedNormalOptions,
) -> Result<Vec<Vector3<f64>>> {
    let expected = width.saturating_mul(height);
    require_length("points of the frame", expected, points.len())?;
    require_option("max_relative_jump", options.max_relative_jump, "positive", |jump| jump > 0.0)?;
    let half_width = options.half_width_px as f64;
    require_option("half_width_px", half_width, "1 to 100", |width| (1.0..=100.0).contains(&width))?;
    if let Some(widest) = options.widest_half_width_px {
        let domain = "half_width_px to 100";
        require_option("widest_half_width_px", widest as f64, domain, |width| (half_width..=100.0).contains(&width))?;
    }
    require_option("min_fill", options.min_fill, "0 to 1", |fill| (0.0..=1.0).contains(&fill))?;
    let ranges: Vec<f64> = points.iter().map(|p| Vector3::from(*p).norm()).collect();
    let frame = Frame { points, ranges: &ranges, width, height, options };
    let mut normals = vec![no_normal(); expected];
    normals.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, line)| {
        for (col, normal) in line.iter_mut().enumerate() {
            *normal = frame.normal(col, row).unwrap_or_else(no_normal);
        }
    });
    Ok(normals)
}

struct Frame<'a> {
    points: &'a [[f64; 3]],
    ranges: &'a [f64],
    width: usize,
    height: usize,
    options: &'a OrganisedNormalOptions,
}

impl Frame<'_> {
    fn normal(&self, col: usize, row: usize) -> Option<Vector3<f64>> {
        let centre_index = row * self.width + col;
        let range = self.ranges[centre_index];
        if !(range > 0.0 && range < 1e100) {
            return None;
        }
        let centre = Vector3::from(self.points[centre_index]);
        let mut half = self.options.half_width_px;
        let widest = self.options.widest_half_width_px.unwrap_or(half).max(half);
        loop {
            let window = (2 * half + 1).pow(2) as f64;
            let min_count = (self.options.min_fill * window).ceil() as usize;
            let neighbourhood = self.neighbourhood((col, row), half, &centre);
            if neighbourhood.count() < min_count.max(3) {
                return None;
            }
            if let Some(normal) = neighbourhood.normal(min_count) {
                return Some(facing(normal, &-centre));
            }
            if half >= widest {
                return None;
            }
            half = (2 * half).min(widest);
        }
    }

    /// The pixels of the window that lie on the surface of its centre.
    fn neighbourhood(&self, (col, row): (usize, usize), half: usize, centre: &Vector3<f64>) -> Neighbourhood {
        let range = self.ranges[row * self.width + col];
        let jump = self.options.max_relative_jump * range;
        let (first_row, last_row) = (row.saturating_sub(half), (row + half).min(self.height - 1));
        let (first_col, last_col) = (col.saturating_sub(half), (col + half).min(self.width - 1));
        let mut neighbourhood = Neighbourhood::default();
        for r in first_row..=last_row {
            for c in first_col..=last_col {
                let index = r * self.width + c;
                let steps = r.abs_diff(row).max(c.abs_diff(col)).max(1) as f64;
                // A NaN range fails the comparison and is left out.
                if (self.ranges[index] - range).abs() <= jump * steps {
                    neighbourhood.add(&(Vector3::from(self.points[index]) - centre));
                }
            }
        }
        neighbourhood
    }
}
