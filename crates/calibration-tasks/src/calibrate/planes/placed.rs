//! A capture of a plane with the plane and the pose that it is calibrated with.

use nalgebra::Isometry3;
use range_calibration::{DifferenceOptions, Plane, PlaneCapture, RangeDifference, differences_to_plane};
use range_image::Modulation;

use crate::calibrate::planes::planes_outcome::Sample;
use crate::calibrate::start::Start;

/// One capture.
pub(crate) struct Placed<'a> {
    pub(crate) capture: &'a PlaneCapture<'a>,
    pub(crate) name: String,
    pub(crate) plane: Plane,
    pub(crate) pose: Isometry3<f64>,
}

impl Placed<'_> {
    /// The differences of every so many pixels to the plane, with their places. `rewraps`: the reference tells the number
    /// of whole intervals better than the phases could.
    pub(crate) fn samples(
        &self,
        start: &Start,
        options: &DifferenceOptions,
        rewraps: bool,
    ) -> Result<Vec<Sample>, range_calibration::Error> {
        let capture = self.capture;
        let differences = differences_to_plane(capture.frame, &start.camera, &self.pose, &self.plane, options)?;
        let format = start.camera.format;
        let [xp, yp] = start.camera.interior.principal_point_mm;
        // The terms are functions of what was observed: the drift goes to the reference.
        let drifted = |difference: RangeDifference| RangeDifference {
            reference_range_m: difference.reference_range_m + capture.drift_m,
            ..difference
        };
        let sample = |mut difference: RangeDifference| {
            if rewraps {
                rewrap(&mut difference, start.modulation);
            }
            Sample {
                station: capture.name.clone(),
                plane: self.name.clone(),
                pixel: format.pixel_from_image([difference.x_mm + xp, difference.y_mm + yp]),
                drift_m: capture.drift_m,
                difference,
            }
        };
        Ok(differences.into_iter().map(drifted).map(sample).collect())
    }
}

fn rewrap(difference: &mut RangeDifference, modulation: Modulation) {
    let interval = modulation.ambiguity_interval_m();
    let intervals = ((difference.reference_range_m - difference.observed_range_m) / interval).round();
    difference.observed_range_m += intervals * interval;
}
