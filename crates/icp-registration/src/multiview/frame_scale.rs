//! Frames whose ranges have another scale than those of the others.
//!
//! A rigid motion takes up a part of a wrong scale, and pairs then fit well at wrong poses. So the scale of one frame against
//! another is a seventh unknown beside the pose of a pair, and a frame whose pairs all say that it differs is named.

use super::frame_pairs::FramePair;
use crate::kernel::quantile;
use crate::organised::RelativeScale;

/// Median absolute deviation to standard deviation.
const MAD: f64 = 1.4826;
/// Standard deviations that one in a thousand of right surveys exceeds, of 16 frames.
const LARGEST_SIGMAS: f64 = 4.0;

/// Frames with another scale than the others, and the scale of their ranges against those.
pub(super) fn scaled(count: usize, pairs: &[FramePair]) -> Vec<(usize, f64)> {
    let known: Vec<(usize, usize, RelativeScale)> =
        pairs.iter().map(|pair| (pair.alignment.target, pair.alignment.source, pair.influence.scale)).collect();
    let mut found: Vec<(usize, f64)> = Vec::new();
    // Each frame out at most once.
    for _ in 0..count {
        let left = |frame: usize| !found.iter().any(|(out, _)| *out == frame);
        let of_left: Vec<_> = known.iter().filter(|(t, s, _)| left(*t) && left(*s)).copied().collect();
        let worst =
            (0..count).filter(|frame| left(*frame)).filter_map(|frame| Some((frame, stands_out(frame, &of_left)?)));
        let Some((frame, (logarithm, _))) = worst.max_by(|a, b| a.1.1.total_cmp(&b.1.1)) else { break };
        found.push((frame, logarithm.exp()));
    }
    found
}

/// Logarithm of the scale of a frame, and by how many standard deviations it differs from that of the others, where that is
/// significant. Pairs of the others with each other tell how far scales scatter beyond their variances.
fn stands_out(frame: usize, pairs: &[(usize, usize, RelativeScale)]) -> Option<(f64, f64)> {
    let is_own = |(target, source, _): &&(usize, usize, RelativeScale)| *target == frame || *source == frame;
    let others = pairs.iter().filter(|pair| !is_own(pair));
    let mut over: Vec<f64> = others.map(|(_, _, scale)| scale.logarithm.abs() / scale.variance.sqrt()).collect();
    if over.len() < 2 {
        return None;
    }
    let factor = (MAD * quantile(&mut over, 0.5)).max(1.0);
    let (mut sum, mut weights, mut own) = (0.0, 0.0, 0_usize);
    for (_, source, scale) in pairs.iter().filter(is_own) {
        let sign = if *source == frame { 1.0 } else { -1.0 };
        sum += sign * scale.logarithm / scale.variance;
        weights += 1.0 / scale.variance;
        own += 1;
    }
    // Half of the errors of its pairs are the frame's own, which all of them share.
    let variance = factor.powi(2) / weights * (own as f64).midpoint(1.0);
    let over_sigma = (sum / weights).abs() / variance.sqrt();
    // NaN fails.
    (over_sigma > LARGEST_SIGMAS).then_some((sum / weights, over_sigma))
}
