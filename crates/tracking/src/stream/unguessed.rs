//! Alignment with a keyframe without a guess, when everything else has failed.

use std::sync::Arc;

use nalgebra::Isometry3;

use crate::options::Relocalisation;
use crate::stream::locate::Measured;
use crate::stream::tracker::Tracker;
use global_registration::{CoarseOptions, FeatureCloud, align_without_guess};

impl Tracker {
    /// Tries one keyframe a frame, those that look most like the frame first, in turn.
    pub(crate) fn without_guess(
        &mut self,
        ranked: &[(f32, usize, Isometry3<f64>)],
        lost_frames: usize,
    ) -> Option<Measured> {
        if self.options.relocalisation != Relocalisation::Coarse {
            return None;
        }
        let options = CoarseOptions::default();
        let &(_, k, _) = ranked.get(lost_frames % ranked.len().max(1))?;
        let source = FeatureCloud::new(&self.current.to_cloud(), &options).ok()?;
        let keyframe = &mut self.keyframes.list[k];
        if keyframe.features.is_none() {
            keyframe.features = FeatureCloud::new(&keyframe.frame.to_cloud(), &options).ok().map(Arc::new);
        }
        let guess = align_without_guess(&source, keyframe.features.as_ref()?, &options).ok()?;
        self.verified(k, &guess.target_from_source)
    }
}
