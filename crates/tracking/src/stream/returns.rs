//! Places seen before: a new keyframe is registered with older ones that should see the same, as far as the path is known.

use nalgebra::Isometry3;

use crate::stream::tracker::Tracker;
use pose_graph::Edge;
use projective_registration::Agreement;

impl Tracker {
    /// Registers the newest keyframe, which is the current frame, with older ones. Only registrations that fit the path
    /// within its covariance are taken.
    pub(crate) fn close_loops(&mut self, new: usize) {
        if self.options.loop_attempts == 0 {
            return;
        }
        let joined: Vec<bool> = (0..=new).map(|k| k == new || self.keyframes.graph.joined(k, new)).collect();
        let others = |k: usize| !joined[k];
        let candidates = self.keyframes.candidates(&self.current, new, &Isometry3::identity(), others);
        let mut closing = Vec::new();
        for (overlap, k) in candidates.into_iter().take(self.options.loop_attempts) {
            if overlap < Agreement::LEAST_OVERLAP {
                break;
            }
            let guess = self.keyframes.graph.relative(k, new);
            if let Ok(measured) = self.try_keyframe(k, &guess) {
                let edge = Edge { a: k, b: new, a_from_b: measured.relation(), alike: 1.0 };
                if measured.is_sound() && self.keyframes.graph.fits(&edge) {
                    closing.push(edge);
                }
            }
        }
        // Half of the errors are the frame's, which all have in common: n with the variance (1 + 1/n)/2 of their mean.
        let alike = (closing.len() as f64).midpoint(1.0);
        self.keyframes.graph.take(closing.into_iter().map(|edge| Edge { alike, ..edge }));
    }
}
