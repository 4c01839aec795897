//! A pixel pitch that is that of another camera.

use crate::findings::contradiction::{Cause, CauseKind};
use crate::{CalibrationOutcome, Network};

/// Principal distances are given within 5 % by makers of lenses, and near focus makes them some percent longer.
const USUAL_CHANGE: f64 = 1.1;

/// A principal distance that differs from the given one as no lens of that name does.
pub(super) fn of_camera(network: &Network, outcome: &CalibrationOutcome) -> Option<Cause> {
    let nominal = network.camera.interior.principal_distance_mm;
    let found = outcome.camera.interior.principal_distance_mm;
    let [x, y] = network.camera.format.pixel_pitch_mm;
    let factor = found / nominal;
    (factor.ln().abs() > USUAL_CHANGE.ln()).then(|| Cause {
        kind: CauseKind::PixelPitch,
        station: None,
        names: Vec::new(),
        words: format!(
            "the principal distance is {found:.3} mm where {nominal} mm are given: these fit with a pixel pitch of {:.5} x \
             {:.5} mm instead of {x} x {y} mm",
            x / factor,
            y / factor
        ),
        remedy: "mend `pixel_pitch_mm` or `principal_distance_mm` of the camera in survey.ron; where the given one was a \
                 guess, give the one found",
        log_odds: f64::INFINITY,
    })
}
