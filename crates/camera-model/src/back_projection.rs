//! From a range frame to its points.
// Only what is inlined is compiled for wide registers; branches would keep loops scalar, and lanes are counted in several
// planes at once.
#![allow(clippy::inline_always, clippy::needless_bitwise_bool, clippy::needless_range_loop)]

use std::ops::MulAssign;

use nalgebra::{Isometry3, Point3};
use range_image::{Flags, RangeFrame, with_wide_registers};
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
        let found = cloud.points.par_chunks_mut(CHUNK).zip(cloud.flags.par_chunks_mut(CHUNK));
        let found = found.zip(cloud.sigma.par_chunks_mut(CHUNK)).zip(cloud.amplitude.par_chunks_mut(CHUNK));
        let given = self.directions().par_chunks(CHUNK).zip(frame.range.as_slice().par_chunks(CHUNK));
        let given = given.zip(frame.flags.as_slice().par_chunks(CHUNK));
        let given =
            given.zip(frame.sigma.as_slice().par_chunks(CHUNK)).zip(frame.amplitude.as_slice().par_chunks(CHUNK));
        found.zip(given).for_each(
            |((((points, flags), sigmas), amplitudes), ((((rays, ranges), reasons), sigma), amplitude))| {
                with_wide_registers(
                    #[inline(always)]
                    || {
                        scale_rays(rays, ranges, points);
                        flag_missing(ranges, reasons, flags);
                    },
                );
                sigmas.copy_from_slice(sigma);
                amplitudes.copy_from_slice(amplitude);
            },
        );
        Ok(())
    }

    /// [`Self::back_project`] of the pixels from `first` on (counted row by row), as many as there are ranges: for those who
    /// work through a frame row by row. In single precision, rays included: a coordinate is good to `1.2e-7` of the range, a
    /// micrometre at 8 m. Flags are added to those that there are; allocates nothing.
    ///
    /// Fails where the slices differ in length or reach beyond the image.
    pub fn back_project_pixels(
        &self,
        first: usize,
        range: &[f32],
        points: &mut [[f32; 3]],
        flags: &mut [Flags],
    ) -> Result<()> {
        let count = range.len();
        let rays = first.checked_add(count).and_then(|end| self.single().get(first..end));
        let Some(rays) = rays.filter(|_| points.len() == count && flags.len() == count) else {
            let (width, height) = (self.format().width, self.format().height);
            let (found_width, found_height) = (first.saturating_add(count.max(points.len()).max(flags.len())), 1);
            let what = "pixels to back-project";
            return Err(range_image::Error::SizeMismatch { what, width, height, found_width, found_height }.into());
        };
        with_wide_registers(
            #[inline(always)]
            || {
                scale_rays(rays, range, points);
                add_missing(range, flags);
            },
        );
        Ok(())
    }
}

/// Pixels taken at a time, so that the compiler can vectorise.
const LANES: usize = 16;
/// Flags taken at a time.
const FLAGS: usize = 32;

/// A coordinate in either precision.
trait Coordinate: Copy + From<f32> + MulAssign {}

impl Coordinate for f32 {}
impl Coordinate for f64 {}

#[inline(always)]
fn scale_rays<T: Coordinate>(rays: &[[T; 3]], ranges: &[f32], points: &mut [[T; 3]]) {
    let whole = ranges.len() / LANES * LANES;
    for start in (0..whole).step_by(LANES) {
        scale::<T, LANES>(start, rays, ranges, points);
    }
    for start in whole..ranges.len() {
        scale::<T, 1>(start, rays, ranges, points);
    }
}

/// `L` pixels from `start` on, coordinates in the order in which they lie. Places are looked up block by block: chunks that need no
/// look are put side by side by the compiler, which gathers and scatters each coordinate then. Points are written when all are found:
/// rays that they might lie over would be taken one coordinate at a time.
#[inline(always)]
fn scale<T: Coordinate, const L: usize>(start: usize, rays: &[[T; 3]], ranges: &[f32], points: &mut [[T; 3]]) {
    let (Some(rays), Some(ranges)) = (rays[start..].first_chunk::<L>(), ranges[start..].first_chunk::<L>()) else {
        return;
    };
    let Some(points) = points[start..].first_chunk_mut::<L>() else { return };
    let mut distances = [f32::NAN; L];
    for lane in 0..L {
        distances[lane] = if is_distance(ranges[lane]) { ranges[lane] } else { f32::NAN };
    }
    let known = distances.map(|distance| [T::from(distance); 3]);
    let mut found = *rays;
    for (found, range) in found.as_flattened_mut().iter_mut().zip(known.as_flattened()) {
        *found *= *range;
    }
    *points = found;
}

/// Adds the flag of what is no distance.
#[inline(always)]
fn add_missing(ranges: &[f32], flags: &mut [Flags]) {
    let (ranges, last_ranges) = ranges.as_chunks::<FLAGS>();
    let (flags, last_flags) = flags.as_chunks_mut::<FLAGS>();
    for (flags, ranges) in flags.iter_mut().zip(ranges) {
        // As wide as the ranges that they are found by.
        let mut found = [0_u32; FLAGS];
        for lane in 0..FLAGS {
            found[lane] = u32::from(missing(ranges[lane]));
        }
        for lane in 0..FLAGS {
            flags[lane] = Flags::from_bits_retain(flags[lane].bits() | found[lane] as u16);
        }
    }
    for (flags, &range) in last_flags.iter_mut().zip(last_ranges) {
        *flags = Flags::from_bits_retain(flags.bits() | missing(range));
    }
}

#[inline(always)]
fn flag_missing(ranges: &[f32], reasons: &[Flags], flags: &mut [Flags]) {
    for ((flag, &reason), &range) in flags.iter_mut().zip(reasons).zip(ranges) {
        *flag = Flags::from_bits_retain(reason.bits() | missing(range));
    }
}

/// The flag of a value that is no distance.
#[inline(always)]
fn missing(range: f32) -> u16 {
    if is_distance(range) { 0 } else { Flags::NO_DATA.bits() }
}

/// Whether a value can be a distance in front of the camera. Compared with infinity, it would become a question for the class of
/// the number, which compilers answer lane by lane.
#[inline(always)]
fn is_distance(range: f32) -> bool {
    (range > 0.0) & (range <= f32::MAX)
}
