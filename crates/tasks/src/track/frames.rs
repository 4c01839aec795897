//! The frames of a survey in the order of time, a few in memory at a time.

use std::path::Path;
use std::sync::Arc;

use camera_model::OrganisedCloud;
use commands::memory::{FrameBytes, Memory, Work};
use commands::plan::DriftTreatment;
use commands::{Doubt, Progress, root_of};
use nalgebra::Isometry3;
use pipeline::stages::{Line, Step, Watch};
use pipeline::stations::projection;
use pipeline::survey::{FrameWatch, OpenSurvey, Purpose, SenseVotes, StoredWatch, View, open, read_calibration};
use pipeline::{Error, Result, Stage};
use projective_registration::Projection;
use range_io::survey::Survey;
use rayon::prelude::*;
use tracking::TrackerOptions;

use crate::register::input::stages;

/// Of a pixel of a keyframe: 80 bytes for each node, which is made from four pixels, as much again for features and map.
const BYTES_A_PIXEL: u64 = 40;
/// Of a frame: its pose as tracked and adjusted, its row in summary and tables; 1600 were measured.
const BYTES_A_FRAME: u64 = 2500;

/// The sense of the phase is the same in all frames: it is judged in some.
const SENSE_EVERY: usize = 16;

/// Reads frames and brings them to unflagged points.
pub(crate) struct FrameSource {
    survey: OpenSurvey,
    /// What each frame goes through.
    line: Line,
    /// Positions in the survey, in the order of time.
    pub(crate) order: Vec<usize>,
    /// Frames that are brought to points at the same time.
    pub(crate) at_once: usize,
    watch: FrameWatch,
    votes: SenseVotes,
    stored: StoredWatch,
}

/// The points of one frame, a pixel each, NaN where nothing was measured or a flag excludes it.
pub(crate) struct PointFrame {
    pub(crate) points: Vec<[f64; 3]>,
    pub(crate) sigma: Option<Vec<f32>>,
}

impl PointFrame {
    fn new(cloud: OrganisedCloud) -> Self {
        let mut points = cloud.points;
        for (point, flags) in points.iter_mut().zip(&cloud.flags) {
            if !flags.is_empty() {
                *point = [f64::NAN; 3];
            }
        }
        let known = cloud.sigma.iter().any(|sigma| *sigma > 0.0);
        Self { points, sigma: known.then_some(cloud.sigma) }
    }
}

impl FrameSource {
    pub(crate) fn new(path: &Path, calibration: Option<&Path>) -> Result<Self> {
        let correction = Purpose::Ranges(DriftTreatment::Apply);
        let survey = open(path, read_calibration(&root_of(path), calibration)?, correction)?;
        let order = in_order(path, &survey.survey)?;
        let mut stages = stages(survey.survey.level, survey.calibration.as_deref());
        // Frames of a moving camera are neither averaged nor fused.
        stages.retain(|stage| !matches!(stage, Stage::Average(_) | Stage::FuseExposures(_)));
        let line = Line::new(&stages, &survey)?;
        let bytes = FrameBytes::of(&survey.survey);
        // Keyframes and the map that is made of them; poses and what is said of each frame.
        let keyframes = BYTES_A_PIXEL * bytes.pixels * (TrackerOptions::default().max_keyframes as u64 + 4);
        let kept = keyframes + BYTES_A_FRAME * order.len() as u64;
        let (each, most) = (bytes.read + bytes.staged, rayon::current_num_threads());
        let at_once = Memory::present().at_once(&Work { what: "tracking frames", kept, each, most })?;
        Ok(Self {
            survey,
            line,
            order,
            at_once,
            watch: FrameWatch::of_stream(),
            votes: SenseVotes::default(),
            stored: StoredWatch::default(),
        })
    }

    /// How points fall on the camera's pixels.
    pub(crate) fn projection(&self) -> Result<Arc<Projection>> {
        let format = self.line.camera().format;
        projection(self.line.camera()).ok_or_else(|| {
            let (width, height) = (format.width, format.height);
            Error::Camera(format!("{width} x {height} pixels are too few to track a camera by"))
        })
    }

    pub(crate) fn survey(&self) -> &Survey {
        &self.survey.survey
    }

    /// The calibration in use, in words.
    pub(crate) fn calibration(&self) -> &str {
        &self.survey.calibration_words
    }

    pub(crate) fn approximate_pose(&self, station: &str) -> Option<Isometry3<f64>> {
        self.survey.approximate_pose(station)
    }

    pub(crate) fn true_pose(&self, station: &str) -> Option<Isometry3<f64>> {
        self.survey.true_pose(station)
    }

    /// Frames of the survey, in this order; a frame that shows nothing has only NaN.
    pub(crate) fn read(&mut self, indices: &[usize], progress: &dyn Progress) -> Result<Vec<PointFrame>> {
        let mut shown: Vec<Result<View>> = indices.par_iter().map(|&index| self.survey.view(index)).collect();
        progress.frames_in_memory(self.survey.live.count());
        shown.retain(|view| !matches!(view, Err(Error::File(range_io::Error::NothingMeasured { .. }))));
        for view in shown.iter().flatten() {
            self.watch.look(view);
            self.stored.look(&self.survey, view);
        }
        let shown = self.line.apply(shown, &mut Sense { votes: &mut self.votes })?;
        let mut shown = shown.into_iter().peekable();
        let frame = |&index: &usize| {
            let view = shown.next_if(|view| view.frames == [index]);
            view.and_then(|view| view.cloud).map_or_else(|| self.blank(), PointFrame::new)
        };
        Ok(indices.iter().map(frame).collect())
    }

    /// What speaks against the frames that were read.
    ///
    /// # Errors
    /// [`Error::Incompatible`] for a calibration that holds for none of their ranges.
    pub(crate) fn doubts(&self) -> Result<Vec<Doubt>> {
        let mut doubts = self.survey.doubts.clone();
        doubts.extend(self.line.steps().iter().flat_map(Step::doubts).cloned());
        doubts.extend(self.watch.doubts());
        doubts.extend(self.votes.doubt());
        doubts.extend(self.stored.doubts());
        for step in self.line.steps() {
            doubts.extend(step.judge_span(&self.survey)?);
        }
        Ok(doubts)
    }

    fn blank(&self) -> PointFrame {
        let camera = &self.survey.survey.camera;
        PointFrame { points: vec![[f64::NAN; 3]; camera.width * camera.height], sigma: None }
    }
}

/// Judges phases before they are unwrapped.
struct Sense<'a> {
    votes: &'a mut SenseVotes,
}

impl Watch for Sense<'_> {
    fn before(&mut self, _: usize, stage: &Stage, views: &[View]) {
        if matches!(stage, Stage::Unwrap(_)) {
            let some = |view: &&View| view.frames.iter().any(|index| index.is_multiple_of(SENSE_EVERY));
            views.iter().filter(some).for_each(|view| self.votes.look_at(view));
        }
    }
}

/// Positions of the frames in the order of their times, which must differ.
fn in_order(path: &Path, survey: &Survey) -> Result<Vec<usize>> {
    let refused = |message: String| Error::Survey { path: path.to_owned(), message };
    if let [only] = survey.frames.as_slice() {
        let file = only.file.display();
        return Err(refused(format!("it has one frame ({file}); a camera is tracked over two and more")));
    }
    let mut times = Vec::with_capacity(survey.frames.len());
    for (index, frame) in survey.frames.iter().enumerate() {
        let missing = || {
            let file = frame.file.display();
            refused(format!("frame {index} ({file}) has no timestamp_s, which tells in what order frames are tracked"))
        };
        times.push((frame.timestamp_s.ok_or_else(missing)?, index));
    }
    times.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    if let Some(pair) = times.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        let (time, a, b) = (pair[0].0, pair[0].1, pair[1].1);
        return Err(refused(format!("frames {a} and {b} have the same timestamp_s of {time}: one camera is tracked")));
    }
    Ok(times.into_iter().map(|(_, index)| index).collect())
}
