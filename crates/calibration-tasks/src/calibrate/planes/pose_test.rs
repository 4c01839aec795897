//! Whether residuals of a capture are what a wrong pose, or a wrong plane, leaves.

use nalgebra::{Matrix3, Vector3};
use self_calibration::{ObservationQuality, Verdict};
use statistics::{Distribution, bonferroni};

use crate::calibrate::planes::placed::Placed;
use crate::calibrate::planes::planes_outcome::Found;
use crate::calibrate::start::Start;

/// Probability that any pose of sound captures is doubted.
const LEVEL: f64 = 0.001;
/// Shift along the normal and two tilts: all that a plane shows of a pose.
const SEEN: f64 = 3.0;

/// A sentence for each capture whose residuals a movement of its pose, held as exact, would explain.
pub(crate) fn doubts(placed: &[Placed<'_>], found: &Found, start: &Start) -> Vec<String> {
    let held = |placed: &&Placed<'_>| placed.capture.world_from_camera.is_some() && placed.capture.covariance.is_none();
    let held: Vec<&Placed<'_>> = placed.iter().filter(held).collect();
    let level = bonferroni(LEVEL, held.len());
    let limit = Distribution::ChiSquared { dof: SEEN }.upper_quantile(level);
    // Where all scatters more than stated, that is told as such.
    let scale = found.sigma0().map_or(1.0, |sigma0| sigma0.max(1.0));
    let doubt = |placed: &Placed<'_>| {
        let own = found.residuals().iter().filter(|quality| {
            quality.station == placed.capture.name && quality.target == placed.name && quality.verdict == Verdict::Used
        });
        let movement = Movement::new(placed, own, start)?;
        let statistic = movement.statistic / (scale * scale);
        (statistic > limit).then(|| movement.sentence(placed, (statistic / limit).sqrt()))
    };
    held.into_iter().filter_map(doubt).collect()
}

/// The movement of a plane against the camera that explains residuals best.
struct Movement {
    /// Along the normal, metre.
    shift_m: f64,
    tilt_rad: f64,
    /// By how much it reduces the sum of squares.
    statistic: f64,
}

impl Movement {
    /// `None` where the pixels do not show one.
    fn new<'q>(
        placed: &Placed<'_>,
        residuals: impl Iterator<Item = &'q ObservationQuality>,
        start: &Start,
    ) -> Option<Self> {
        let normal = placed.plane.normal();
        let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
        let second = normal.cross(&first);
        let place = placed.pose.translation.vector;
        let seen: Vec<(Vector3<f64>, f64, &ObservationQuality)> = residuals
            .map(|quality| {
                let direction = placed.pose.rotation * start.camera.ray(quality.pixel);
                let reference = quality.observed - quality.uncorrected_m;
                (place + direction * reference, normal.dot(&direction), quality)
            })
            .collect();
        let middle = seen.iter().map(|(point, ..)| point).sum::<Vector3<f64>>() / seen.len().max(1) as f64;
        let (mut products, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (point, cosine, quality) in &seen {
            let from_middle = point - middle;
            // n · (t + r d) = D: the range r changes by one over the cosine.
            let row = Vector3::new(1.0, from_middle.dot(&first), from_middle.dot(&second)) / (*cosine * quality.sigma);
            products += row * row.transpose();
            right += row * (quality.residual / quality.sigma);
        }
        let movement = products.cholesky()?.solve(&right);
        let statistic = movement.dot(&right);
        statistic.is_finite().then(|| Self {
            shift_m: movement.x.abs(),
            tilt_rad: movement.y.hypot(movement.z),
            statistic,
        })
    }

    fn sentence(&self, placed: &Placed<'_>, times: f64) -> String {
        format!(
            "station `{}`: its residuals fit if it is {:.1} mm along the normal of {} and {:.3} degrees elsewhere, {times:.1} \
             times what chance explains at a level of {LEVEL}; its pose is held as exact: give its standard deviations in \
             stations.csv, or mend it there or the plane in planes.csv",
            placed.capture.name,
            1e3 * self.shift_m,
            placed.name,
            self.tilt_rad.to_degrees(),
        )
    }
}
