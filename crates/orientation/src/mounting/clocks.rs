//! Clocks that do not agree.

use statistics::upper_median;

use crate::mounting::carrier::{Span, TimedPose, ends};

/// Steps into which an interval between the camera's poses is divided in the search for the time offset.
const STEPS: f64 = 4.0;
/// Most time offsets that are tried.
const MOST_OFFSETS: usize = 10_000;

/// Share of noise in what the motion tells of the clocks, at most: more makes the stated deviation too small by half of that share or
/// more, since noise that two poses differ by passes for motion. Stated over true deviation of simulated offsets: 0.95 at this share.
const LARGEST_NOISE_SHARE: f64 = 0.1;

/// Seconds over which the carrier's motion stands out of its noise, at the times given; `None` where it never does. `variances`: of a
/// position (m²) and of a rotation (radian²), carrier and camera together.
pub(crate) fn baseline(carrier: &[TimedPose], times_s: &[f64], max_gap_s: f64, variances: [f64; 2]) -> Option<f64> {
    let mut gaps: Vec<f64> = carrier.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
    let whole_s = carrier.last()?.time_s - carrier.first()?.time_s;
    let mut baseline_s = upper_median(&mut gaps);
    while baseline_s <= 2.0 * whole_s {
        let (mut told, mut noise) = (0.0, 0.0);
        for time_s in times_s {
            let span = Span::moving(carrier, *time_s, max_gap_s, baseline_s);
            let (Some(span), Some([first, last])) = (span, ends(carrier, *time_s, max_gap_s, baseline_s)) else {
                continue;
            };
            let rates = [span.velocity, span.rate];
            for (k, rate) in rates.iter().enumerate() {
                let trace = |pose: &TimedPose| pose.pose.covariance.fixed_view::<3, 3>(3 * k, 3 * k).trace();
                told += rate.norm_squared() / variances[k];
                noise += (trace(first) + trace(last)) / (last.time_s - first.time_s).powi(2) / variances[k];
            }
        }
        if told > 0.0 && noise <= LARGEST_NOISE_SHARE * told {
            return Some(baseline_s);
        }
        baseline_s *= 2.0;
    }
    None
}

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
