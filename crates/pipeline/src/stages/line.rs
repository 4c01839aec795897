//! The stages that views go through by themselves, ready for one survey.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use camera_model::{Camera, RayTable};
use rayon::prelude::*;

use crate::stages::average::{Average, Tests};
use crate::stages::fuse::Fuse;
use crate::stages::{Findings, Found, ViewStage, cloud, deconvolve, demodulate, flag, multipath, ranges, wraps};
use crate::survey::open::OpenSurvey;
use crate::survey::view::View;
use crate::{Error, Result};
use commands::plan::Stage;
use commands::{Doubt, Tape};

/// What stages are made ready with: the state that those before them leave.
pub(crate) struct Making<'a> {
    pub(crate) survey: &'a OpenSurvey,
    /// The camera whose rays make the clouds.
    pub(crate) camera: Camera,
    pub(crate) rays: Arc<RayTable>,
    /// Amplitude below which the phase of a single frame is too noisy, as `Demodulate` was told.
    pub(crate) low_amplitude: Option<f64>,
}

/// The stages up to registration, in order, with what they have found so far.
pub struct Line {
    steps: Vec<Step>,
    camera: Camera,
    rays: Arc<RayTable>,
}

/// One of them.
pub struct Step {
    stage: Stage,
    work: Work,
    found: Found,
}

enum Work {
    Views(Box<dyn ViewStage>),
    /// Makes one view of those of a station.
    Fuse(Fuse),
    /// Makes one view of all frames of a station.
    Mean(Average),
}

/// Is told of views before and after each stage. Frames that go into a mean are shown before it in parts.
pub trait Watch {
    /// Before the stage of this number.
    fn before(&mut self, _number: usize, _stage: &Stage, _views: &[View]) {}
    /// The mean of some of a station's frames, or of the means of its parts, took so long.
    fn mean(&mut self, _number: usize, _time: Duration) {}
    /// After it.
    fn after(&mut self, _number: usize, _stage: &Stage, _views: &[View]) {}
}

/// Nobody watches.
impl Watch for () {}

impl Line {
    /// Makes all stages but `Register` and `Adjust` ready.
    ///
    /// # Errors
    /// For stages that need a calibration that is not there.
    pub fn new(stages: &[Stage], survey: &OpenSurvey) -> Result<Self> {
        let (camera, rays) = (survey.nominal_camera, Arc::clone(&survey.rays));
        let mut making = Making { survey, camera, rays, low_amplitude: None };
        let mut steps = Vec::new();
        for stage in stages {
            if let Some(work) = Work::new(stage, &mut making)? {
                steps.push(Step { stage: stage.clone(), work, found: Found::default() });
            }
        }
        Ok(Self { steps, camera: making.camera, rays: making.rays })
    }

    /// The camera whose rays make the clouds.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Its rays.
    pub fn rays(&self) -> &RayTable {
        &self.rays
    }

    /// The stages.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Writes what the stages found, or adds what they found in another part of the survey.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        for step in &mut self.steps {
            step.found.carry(tape);
        }
    }

    /// Whether a stage works on all views of a station.
    pub(crate) fn fuses(&self) -> bool {
        self.steps.iter().any(|step| matches!(step.work, Work::Fuse(_)))
    }

    /// Number of the stage that averages.
    pub(crate) fn average(&self) -> Option<usize> {
        self.steps.iter().position(|step| matches!(step.work, Work::Mean(_)))
    }

    /// Takes views through all stages that there are in a range, and the error of a view that would come after them.
    pub(crate) fn apply_some(
        &mut self,
        range: Range<usize>,
        (mut views, mut failed): (Vec<View>, Result<()>),
        watch: &mut dyn Watch,
    ) -> Result<Vec<View>> {
        for number in range {
            let step = &mut self.steps[number];
            watch.before(number, &step.stage, &views);
            match &step.work {
                // The error of an earlier view takes the place of a later one's, whichever stage it is in.
                Work::Views(stage) => failed = each(stage.as_ref(), &mut views, &mut step.found).and(failed),
                _ if failed.is_err() => break,
                Work::Fuse(fuse) => fuse.apply(&mut views, &mut step.found)?,
                Work::Mean(average) => {
                    let (view, tests) = average.mean(std::mem::take(&mut views))?;
                    Average::record(&tests, view.frames.len(), &mut step.found);
                    views.push(view);
                }
            }
            watch.after(number, &step.stage, &views);
        }
        failed.map(|()| views)
    }

    /// Takes views through all stages: those of one station where exposures are fused, or else any.
    ///
    /// # Errors
    /// That of the first view that has one, be it in reading it or in any stage.
    pub fn apply(&mut self, views: Vec<Result<View>>, watch: &mut dyn Watch) -> Result<Vec<View>> {
        self.apply_some(0..self.steps.len(), up_to_error(views), watch)
    }

    /// The mean of some frames, or of means of parts of them, by the stage of this number.
    pub(crate) fn mean(&self, number: usize, views: Vec<View>) -> Result<(View, Tests)> {
        match self.steps.get(number).map(|step| &step.work) {
            Some(Work::Mean(average)) => average.mean(views),
            _ => Err(Error::Needs { stage: "Average", needs: "Demodulate" }),
        }
    }

    /// Records the mean of a station that was made in parts.
    pub(crate) fn record_mean(&mut self, number: usize, view: &View, tests: &Tests, watch: &mut dyn Watch) {
        let Some(step) = self.steps.get_mut(number) else { return };
        Average::record(tests, view.frames.len(), &mut step.found);
        watch.after(number, &step.stage, std::slice::from_ref(view));
    }
}

/// Takes views through a stage at the same time; what is found of them, up to the first error, in their order.
fn each(stage: &dyn ViewStage, views: &mut Vec<View>, found: &mut Found) -> Result<()> {
    let one = |view: &mut View| {
        let mut own = Found::default();
        stage.apply(view, &mut own).map(|()| own)
    };
    let (done, failed) = up_to_error(views.par_iter_mut().map(one).collect::<Vec<_>>());
    views.truncate(done.len());
    for own in done {
        found.join(own);
    }
    failed
}

/// What comes before the first error, and that error.
pub(crate) fn up_to_error<T>(some: impl IntoIterator<Item = Result<T>>) -> (Vec<T>, Result<()>) {
    let mut failed = Ok(());
    let good = some.into_iter().map_while(|one| one.map_err(|error| failed = Err(error)).ok()).collect();
    (good, failed)
}

impl Step {
    /// The stage.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// What it found so far.
    pub fn findings(&self) -> Findings {
        match &self.work {
            Work::Views(stage) => stage.findings(&self.found),
            Work::Fuse(_) => self.found.sums.clone(),
            Work::Mean(_) => Average::findings(&self.found),
        }
    }

    /// What speaks against the views that it saw.
    pub fn doubts(&self) -> &[Doubt] {
        &self.found.doubts
    }

    /// Whether the calibration holds for the ranges that were corrected.
    ///
    /// # Errors
    /// [`Error::Incompatible`] where it holds for none.
    pub fn judge_span(&self, survey: &OpenSurvey) -> Result<Option<Doubt>> {
        survey.calibration.as_ref().map_or(Ok(None), |calibration| self.found.span.judge(&calibration.span))
    }
}

impl Work {
    /// `None` for the stages that need all stations.
    fn new(stage: &Stage, making: &mut Making<'_>) -> Result<Option<Self>> {
        let views: Box<dyn ViewStage> = match stage {
            Stage::Average(options) => {
                return Ok(Some(Self::Mean(Average { options: options.clone(), low_amplitude: making.low_amplitude })));
            }
            Stage::Register(_) | Stage::Adjust(_) => return Ok(None),
            Stage::Demodulate(options) => Box::new(demodulate::Demodulate::new(options, making)?),
            Stage::Deconvolve(options) => Box::new(deconvolve::Deconvolve::new(options, making)?),
            Stage::Unwrap(options) => Box::new(wraps::unwrap::Unwrap::new(options, making)),
            Stage::RepairWraps(options) => Box::new(wraps::repair::Repair::new(options, making)?),
            Stage::CorrectRange(options) => Box::new(ranges::correct::CorrectRange::new(options, making)?),
            Stage::CorrectImagePoint(_) => Box::new(cloud::CorrectImagePoint::new(making)?),
            Stage::Multipath(options) => Box::new(multipath::Multipath::new(options, making)),
            Stage::FuseExposures(options) => return Ok(Some(Self::Fuse(Fuse { options: options.clone() }))),
            Stage::PointCloud(_) => Box::new(cloud::PointCloud { rays: Arc::clone(&making.rays) }),
            Stage::Flag(options) => Box::new(flag::Flag::new(options, making)),
        };
        Ok(Some(Self::Views(views)))
    }
}
