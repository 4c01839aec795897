//! From a range frame to its points.

use nalgebra::{Isometry3, Point3};
use range_image::{Flags, RangeFrame};
use rayon::prelude::*;

use crate::ray_table::CHUNK;
use crate::{RayTable, Result};

/// The points of one frame in the order of its pixels, row by row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OrganisedCloud {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Points in the camera frame, metre; NaN where the frame has no range.
    pub points: Vec<[f64; 3]>,
    /// Standard deviation along the ray, metre; NaN where it is not known.
    pub sigma: Vec<f32>,
    /// Amplitude in the camera's unit; NaN where the camera gives none.
    pub amplitude: Vec<f32>,
    /// Reasons to distrust a point.
    pub flags: Vec<Flags>,
}

impl OrganisedCloud {
    /// Number of points that have a value.
    pub fn valid_count(&self) -> usize {
        self.points.iter().filter(|point| point[0].is_finite()).count()
    }

    fn resize(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        let count = width * height;
        self.points.resize(count, [f64::NAN; 3]);
        self.sigma.resize(count, f32::NAN);
        self.amplitude.resize(count, f32::NAN);
        self.flags.resize(count, Flags::empty());
    }

    /// Writes the points in another frame into `out` (camera frame to `target`, same order, NaN stays NaN).
    pub fn points_into(&self, target_from_camera: &Isometry3<f64>, out: &mut Vec<[f64; 3]>) {
        out.clear();
        out.extend(
            self.points
                .iter()
                .map(|&point| -> [f64; 3] { target_from_camera.transform_point(&Point3::from(point)).into() }),
        );
    }
}

impl RayTable {
    /// The points of a frame in the camera frame, Eq. 3.
    ///
    /// A range that is NaN, infinite, zero or negative is no distance: its point is NaN and carries
    /// [`Flags::NO_DATA`]. Everything else of the frame is carried over as it is.
    pub fn back_project(&self, frame: &RangeFrame) -> Result<OrganisedCloud> {
        let mut cloud = OrganisedCloud::default();
        self.back_project_into(frame, &mut cloud)?;
        Ok(cloud)
    }

    /// [`Self::back_project`] into a cloud whose memory is used again: nothing is allocated when the size is the same.
    ///
    /// The cloud is not touched where the frame does not fit the table.
    pub fn back_project_into(&self, frame: &RangeFrame, cloud: &mut OrganisedCloud) -> Result<()> {
        frame.validate()?;
        self.require_size(&frame.range, "range frame")?;
        cloud.resize(frame.width(), frame.height());
        let per_point = cloud.points.par_chunks_mut(CHUNK).zip(cloud.flags.par_chunks_mut(CHUNK));
        let per_pixel = self.directions().par_chunks(CHUNK).zip(frame.range.as_slice().par_chunks(CHUNK));
        let flags = frame.flags.as_slice().par_chunks(CHUNK);
        per_point.zip(per_pixel.zip(flags)).for_each(|((points, flags), ((rays, ranges), reasons))| {
            for ((point, ray), &range) in points.iter_mut().zip(rays).zip(ranges) {
                let range = if is_distance(range) { f64::from(range) } else { f64::NAN };
                *point = [ray[0] * range, ray[1] * range, ray[2] * range];
            }
            for ((flag, &reason), &range) in flags.iter_mut().zip(reasons).zip(ranges) {
                *flag = if is_distance(range) { reason } else { reason | Flags::NO_DATA };
            }
        });
        copy(frame.sigma.as_slice(), &mut cloud.sigma);
        copy(frame.amplitude.as_slice(), &mut cloud.amplitude);
        Ok(())
    }
}

/// Whether a value can be a distance in front of the camera.
fn is_distance(range: f32) -> bool {
    range > 0.0 && range < f32::INFINITY
}

fn copy(from: &[f32], to: &mut [f32]) {
    let chunks = to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK));
    chunks.for_each(|(to, from)| to.copy_from_slice(from));
}
