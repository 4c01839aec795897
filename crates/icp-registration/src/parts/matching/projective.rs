//! The point of an organised frame at the pixel that a source point falls on.

use nalgebra::Point3;
use rigid_pose::{is_usable, require_length};

use super::nearest::partner_at;
use super::{Partner, PointMatching, Query};
use crate::error::Result;
use crate::parts::scene::TargetSurface;
use crate::target::IcpTarget;

/// Reverse calibration `[Blais1995]`: no search, the partner is what the target's camera saw at the pixel that the
/// source point projects to. Exact only close to the solution, and as fast as a look-up.
pub struct Projective<'a> {
    target: &'a IcpTarget,
    /// Index into the target's points by pixel, row by row.
    point_of_pixel: Vec<Option<usize>>,
    width: usize,
    height: usize,
    /// Position `(col, row)` in pixels of a point of the target frame, `None` outside the field of view.
    pixel: PixelOf<'a>,
}

/// Where a point falls in the image.
type PixelOf<'a> = Box<dyn Fn(&Point3<f64>) -> Option<[f64; 2]> + Sync + 'a>;

impl<'a> Projective<'a> {
    /// Matches with `target`, whose points are those pixels of the frame `points` (`width` · `height`, row by row, NaN
    /// without range) that have a range, in their order, as [`crate::Cloud::from_frame`] keeps them.
    ///
    /// `pixel`: projection of a point of the target's frame to `(col, row)`.
    ///
    /// # Errors
    /// [`InputError::LengthMismatch`](rigid_pose::InputError::LengthMismatch) where frame, size and target do not belong together.
    pub fn new(
        target: &'a IcpTarget,
        points: &[[f64; 3]],
        width: usize,
        height: usize,
        pixel: impl Fn(&Point3<f64>) -> Option<[f64; 2]> + Sync + 'a,
    ) -> Result<Self> {
        let expected = width.saturating_mul(height);
        require_length("points of the frame", expected, points.len())?;
        let mut count = 0;
        let point_of_pixel: Vec<Option<usize>> = points
            .iter()
            .map(|p| {
                let usable = is_usable(&Point3::from(*p));
                count += usize::from(usable);
                usable.then(|| count - 1)
            })
            .collect();
        require_length("points of the frame with a range", target.cloud.len(), count)?;
        Ok(Self { target, point_of_pixel, width, height, pixel: Box::new(pixel) })
    }

    fn index(&self, query: &Query) -> Option<usize> {
        let [col, row] = (self.pixel)(&query.moved.into())?;
        let inside = |v: f64, size: usize| v > -0.5 && v < size as f64 - 0.5;
        if !(inside(col, self.width) && inside(row, self.height)) {
            return None;
        }
        let index = self.point_of_pixel[row.round() as usize * self.width + col.round() as usize]?;
        let distance_m = (self.target.cloud.points[index].coords - query.moved).norm();
        (distance_m <= query.limit_m).then_some(index)
    }
}

impl PointMatching for Projective<'_> {
    fn target(&self) -> TargetSurface<'_> {
        self.target.surface()
    }

    fn partner(&self, query: &Query) -> Partner {
        self.index(query).map_or(Partner::none(0.0), |index| partner_at(self.target, index, 0.0))
    }
}
