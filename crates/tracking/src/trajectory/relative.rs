use super::absolute::TrajectoryErrorOptions;
use super::association::{Stamped, associate};
use super::statistics::ErrorStatistics;
use crate::error::Result;
use rigid_pose::{InputError, require_option, require_positive};

/// Over how long a step drift is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RelativeStep {
    /// Number of common poses.
    Frames(usize),
    /// Time, second.
    Seconds(f64),
    /// Length of the true path, metre.
    Metres(f64),
}

/// Error of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeError {
    /// Index in the estimate of the step's first pose and of its second.
    pub estimate: [usize; 2],
    /// Times of the two poses, second.
    pub timestamps_s: [f64; 2],
    /// Length of the true path between them, metre.
    pub path_m: f64,
    /// Error of the step's translation, metre.
    pub translation_error_m: f64,
    /// Error of the step's rotation, radian.
    pub rotation_error_rad: f64,
}

/// Relative pose error (RPE).
#[derive(Debug, Clone, PartialEq)]
pub struct RelativePoseError {
    /// Every step, in the order of its first pose's time.
    pub steps: Vec<RelativeError>,
    /// Translation errors, metre.
    pub translation_m: ErrorStatistics,
    /// Rotation errors, radian.
    pub rotation_rad: ErrorStatistics,
}

impl RelativePoseError {
    /// The `count` steps of the largest translation errors, the worst first.
    pub fn worst(&self, count: usize) -> Vec<RelativeError> {
        let mut worst = self.steps.clone();
        worst.sort_by(|a, b| b.translation_error_m.total_cmp(&a.translation_error_m));
        worst.truncate(count);
        worst
    }
}

/// Errors of the motion over steps that begin at every common pose: `(Tᵢ⁻¹ Tⱼ)⁻¹ (Eᵢ⁻¹ Eⱼ)` with truth T and estimate E.
///
/// A step ends at the later pose whose time or path from the first is nearest to the one wanted, and is left out where
/// it misses by more than the tolerance. Follows `[Sturm2012]`.
///
/// # Errors
/// [`crate::Error::NoCommonTime`], [`InputError::TooFewPoints`] where there is no such step; [`InputError::Empty`], [`InputError::NonFinite`],
/// [`InputError::InvalidOption`] for the input.
pub fn relative_pose_error(
    estimate: &[Stamped],
    truth: &[Stamped],
    step: RelativeStep,
    options: &TrajectoryErrorOptions,
) -> Result<RelativePoseError> {
    check(step, options.step_tolerance)?;
    let pairs = associate(estimate, truth, options.max_time_difference_s)?;
    let mut path = Vec::with_capacity(pairs.len());
    let mut way = 0.0;
    for (index, &(_, t)) in pairs.iter().enumerate() {
        if let Some(&(_, before)) = index.checked_sub(1).and_then(|before| pairs.get(before)) {
            way += (truth[t].1.translation.vector - truth[before].1.translation.vector).norm();
        }
        path.push(way);
    }
    let times: Vec<f64> = pairs.iter().map(|&(e, _)| estimate[e].0).collect();
    let end = |first: usize| match step {
        RelativeStep::Frames(frames) => Some(first.saturating_add(frames)).filter(|&second| second < pairs.len()),
        RelativeStep::Seconds(seconds) => nearest(&times, first, seconds, options.step_tolerance),
        RelativeStep::Metres(metres) => nearest(&path, first, metres, options.step_tolerance),
    };
    let steps = (0..pairs.len()).filter_map(|first| {
        let second = end(first)?;
        let [(e, t), (f, u)] = [pairs[first], pairs[second]];
        let moved = estimate[e].1.inv_mul(&estimate[f].1);
        let error = truth[t].1.inv_mul(&truth[u].1).inv_mul(&moved);
        Some(RelativeError {
            estimate: [e, f],
            timestamps_s: [times[first], times[second]],
            path_m: path[second] - path[first],
            translation_error_m: error.translation.vector.norm(),
            rotation_error_rad: error.rotation.angle(),
        })
    });
    let steps: Vec<RelativeError> = steps.collect();
    let translation_m = ErrorStatistics::of(steps.iter().map(|step| step.translation_error_m));
    let rotation_rad = ErrorStatistics::of(steps.iter().map(|step| step.rotation_error_rad));
    let too_few = InputError::TooFewPoints { what: "relative pose error: steps of the length", found: 0, needed: 1 };
    let (translation_m, rotation_rad) = translation_m.zip(rotation_rad).ok_or(too_few)?;
    Ok(RelativePoseError { steps, translation_m, rotation_rad })
}

fn check(step: RelativeStep, tolerance: f64) -> Result<()> {
    let length = match step {
        RelativeStep::Frames(frames) => frames as f64,
        RelativeStep::Seconds(length) | RelativeStep::Metres(length) => length,
    };
    require_positive("step", length)?;
    let is_inside = |tolerance: f64| tolerance >= 0.0 && tolerance.is_finite();
    Ok(require_option("step_tolerance", tolerance, "0 or more and finite", is_inside)?)
}

/// The index behind `first` whose value, in a list that does not fall, is nearest to that of `first` plus `step`.
fn nearest(values: &[f64], first: usize, step: f64, tolerance: f64) -> Option<usize> {
    let wanted = values[first] + step;
    let above = values.partition_point(|value| *value < wanted).max(first + 1);
    let candidates =
        [Some(above - 1).filter(|below| *below > first), Some(above).filter(|above| *above < values.len())];
    let miss = |index: &usize| (values[*index] - wanted).abs();
    let best = candidates.into_iter().flatten().min_by(|a, b| miss(a).total_cmp(&miss(b)))?;
    (miss(&best) <= tolerance * step).then_some(best)
}
