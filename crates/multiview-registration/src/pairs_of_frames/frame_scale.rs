//! Frames whose ranges have another scale than those of the others.
//!
//! A rigid motion takes up a part of a wrong scale, and pairs then fit well at wrong poses. So the scale of one frame against
//! another is a seventh unknown beside the pose of a pair, and a frame whose pairs all say that it differs is named.

use crate::pairs_of_frames::frame_pairs::FramePair;
use projective_registration::SharedError;

/// Standard deviations that a frame of 16 right ones exceeds in one of a thousand surveys.
const LARGEST_SIGMAS: f64 = 4.0;

/// Logarithm of the scale of the ranges of `source` against those of `target`, and its variance.
#[derive(Debug, Clone, Copy)]
struct Compared {
    target: usize,
    source: usize,
    logarithm: f64,
    variance: f64,
}

impl Compared {
    fn is_of(&self, frame: usize) -> bool {
        self.target == frame || self.source == frame
    }
}

/// Frames with another scale than the others, and the scale of their ranges against those; the worst is taken out again and
/// again.
pub(crate) fn scaled(count: usize, pairs: &[FramePair], shared: &SharedError) -> Vec<(usize, f64)> {
    let compared = |pair: &FramePair| {
        let (logarithm, variance) = pair.influence.relative_scale(shared);
        Compared { target: pair.alignment.target, source: pair.alignment.source, logarithm, variance }
    };
    let mut left: Vec<Compared> = pairs.iter().map(compared).collect();
    let mut found = Vec::new();
    // The last two cannot be told apart.
    while left.iter().any(|pair| !pair.is_of(left[0].target) || !pair.is_of(left[0].source)) {
        let scales = (0..count).filter_map(|frame| Some((frame, scale_of(frame, &left)?)));
        let worst = scales.max_by(|a, b| a.1.1.total_cmp(&b.1.1)).filter(|(_, (_, sigmas))| *sigmas > LARGEST_SIGMAS);
        let Some((frame, (logarithm, _))) = worst else { break };
        found.push((frame, logarithm.exp()));
        left.retain(|pair| !pair.is_of(frame));
    }
    found
}

/// Logarithm of the scale of a frame against those that it is paired with, and by how many standard deviations it is not 0.
fn scale_of(frame: usize, pairs: &[Compared]) -> Option<(f64, f64)> {
    let (mut sum, mut weights, mut count) = (0.0, 0.0, 0.0_f64);
    for pair in pairs.iter().filter(|pair| pair.is_of(frame)) {
        let sign = if pair.source == frame { 1.0 } else { -1.0 };
        sum += sign * pair.logarithm / pair.variance;
        weights += 1.0 / pair.variance;
        count += 1.0;
    }
    // Half of the errors of its pairs are the frame's own, which all of them share.
    let variance = count.midpoint(1.0) / weights;
    let mean = sum / weights;
    mean.is_finite().then_some((mean, mean.abs() / variance.sqrt()))
}
