//! Clocks that do not agree.

use statistics::upper_median;

use crate::mounting::carrier::{Span, TimedPose};

/// Steps into which an interval between the camera's poses is divided in the search for the time offset.
const STEPS: f64 = 4.0;
/// Most time offsets that are tried.
const MOST_OFFSETS: usize = 10_000;

/// The time offset at which carrier and camera turn alike: angles of motions do not depend on the mounting.
pub(crate) fn best_offset(carrier: &[TimedPose], camera: &[TimedPose], most_s: f64, max_gap_s: f64) -> f64 {
    let mut gaps: Vec<f64> = camera.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
    let step = (upper_median(&mut gaps) / STEPS).max(2.0 * most_s / MOST_OFFSETS as f64);
    let steps = if step.is_normal() { (most_s / step) as i64 } else { 0 };
    let misfit = |offset_s: f64| {
        let angle = |pair: &[TimedPose]| {
            let [a, b] = [0, 1].map(|k| {
                let time_s = pair[k].time_s + offset_s;
                Span::at(carrier, time_s, max_gap_s).map(|span| span.pose(time_s).pose)
            });
            Some(
                (a?.rotation.angle_to(&b?.rotation) - pair[0].pose.pose.rotation.angle_to(&pair[1].pose.pose.rotation))
                    .abs(),
            )
        };
        let mut found: Vec<f64> = camera.windows(2).filter_map(angle).collect();
        // Half of the motions at least, and the middle one of them: gross errors do not decide it.
        let enough = 2 * found.len() >= camera.len();
        if enough { upper_median(&mut found) } else { f64::INFINITY }
    };
    let tried = (-steps..=steps).map(|k| k as f64 * step).map(|offset_s| (misfit(offset_s), offset_s));
    tried.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.abs().total_cmp(&b.1.abs()))).map_or(0.0, |(_, offset_s)| offset_s)
}
