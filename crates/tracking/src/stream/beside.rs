//! The search after a loss in a stream that does not wait: a part of it each frame, and the alignment without a guess beside them.

use std::sync::{Arc, OnceLock};

use nalgebra::Isometry3;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::options::Relocalisation;
use crate::stream::locate::Measured;
use crate::stream::tracker::Tracker;
use global_registration::{CoarseOptions, FeatureCloud, align_without_guess};
use point_cloud::Cloud;

/// Frames behind the one that is aligned without a guess, after which what was found serves: a third of a second at 30 Hz, in which
/// an alignment of frames of 640 x 480 ends beside the frames. With fewer the frame has to wait; with more the camera has moved on.
const FRAMES: usize = 10;

/// Where a keyframe was seen from by features alone, and its features for the next time; nothing of what could not be found.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub(crate) features: Option<Arc<FeatureCloud>>,
    pub(crate) keyframe_from_camera: Option<Isometry3<f64>>,
}

impl Found {
    /// Of the keyframe the features, or the cloud that they are made from.
    pub(crate) fn new(source: &Cloud, features: Option<Arc<FeatureCloud>>, keyframe: Option<Cloud>) -> Self {
        let options = CoarseOptions::default();
        let made = || FeatureCloud::new(&keyframe?, &options).ok().map(Arc::new);
        let features = features.or_else(made);
        let guess = features.as_ref().and_then(|target| {
            let source = FeatureCloud::new(source, &options).ok()?;
            align_without_guess(&source, target, &options).ok()
        });
        Self { features, keyframe_from_camera: guess.map(|guess| guess.target_from_source) }
    }
}

/// An alignment that goes on beside the frames.
#[derive(Debug, Clone)]
struct Search {
    /// Number of the keyframe.
    keyframe: usize,
    frames_left: usize,
    /// Not, where the camera has been found otherwise meanwhile.
    is_wanted: bool,
    found: Arc<OnceLock<Found>>,
}

/// The thread for alignments, the one that it is at, and what is due: a keyframe, and where the camera is in its frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Beside {
    pool: Option<Arc<ThreadPool>>,
    search: Option<Search>,
    due: Option<(usize, Isometry3<f64>)>,
}

impl Tracker {
    /// Whether the search after a loss may not hold frames up.
    pub(crate) fn is_beside(&self) -> bool {
        self.options.relocalisation == Relocalisation::Beside
    }

    /// The current frame anywhere among the keyframes: two of them are tried, the most alike and the others in turn.
    pub(crate) fn search_beside(&mut self, lost_frames: usize) -> Option<Measured> {
        if let Some((k, guess)) = self.beside.due.take()
            && let Some(measured) = self.verified(k, &guess)
        {
            return Some(measured);
        }
        let ranked = self.ranked();
        let at =
            if lost_frames.is_multiple_of(2) { 0 } else { 1 + lost_frames / 2 % ranked.len().max(2).saturating_sub(1) };
        let found = ranked.get(at).and_then(|(_, k, guess)| self.verified(*k, guess));
        if found.is_none() {
            let turn = lost_frames / FRAMES % ranked.len().max(1);
            if let Some((_, k, _)) = ranked.get(turn) {
                self.begin_beside(*k);
            }
        }
        found
    }

    /// Counts a frame; what the alignment has found is taken in where it is due.
    pub(crate) fn count_beside(&mut self) {
        self.beside.due = None;
        let Some(search) = &mut self.beside.search else { return };
        search.frames_left = search.frames_left.saturating_sub(1);
        if search.frames_left > 0 {
            return;
        }
        let Some(Search { keyframe, is_wanted, found, .. }) = self.beside.search.take() else { return };
        let Found { features, keyframe_from_camera } = found.wait();
        // It may have been taken out.
        let Some(k) = self.keyframes.list.iter().position(|known| known.number == keyframe) else { return };
        self.keyframes.list[k].features.clone_from(features);
        self.beside.due = keyframe_from_camera.filter(|_| is_wanted).map(|pose| (k, pose));
    }

    /// Begins to align the current frame with a keyframe, unless another alignment is at work.
    fn begin_beside(&mut self, k: usize) {
        if self.beside.search.is_some() {
            return;
        }
        if self.beside.pool.is_none() {
            // Where there is no other thread, frames are sought by their looks alone.
            self.beside.pool = ThreadPoolBuilder::new().num_threads(1).build().ok().map(Arc::new);
        }
        let Some(pool) = &self.beside.pool else { return };
        let (number, (features, keyframe)) = (self.keyframes.list[k].number, self.keyframes.list[k].features());
        let (source, found) = (self.current.to_cloud(), Arc::new(OnceLock::new()));
        let told = Arc::clone(&found);
        // Nobody else sets it.
        pool.spawn(move || drop(told.set(Found::new(&source, features, keyframe))));
        self.beside.search = Some(Search { keyframe: number, frames_left: FRAMES, is_wanted: true, found });
    }

    /// The camera is known again. What goes on goes on, and no other alignment begins before it ends.
    pub(crate) fn end_beside(&mut self) {
        if let Some(search) = &mut self.beside.search {
            search.is_wanted = false;
        }
    }
}
