//! Places seen before: a new keyframe is registered with older ones that should see the same, as far as the path is known.

use nalgebra::Isometry3;

use crate::stream::tracker::Tracker;
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
        let few = candidates.into_iter().take(self.options.loop_attempts);
        let seen: Vec<usize> =
            few.filter(|(overlap, _)| *overlap >= Agreement::LEAST_OVERLAP).map(|(_, k)| k).collect();
        self.seek_loops(new, seen.into_iter());
    }
}
