//! A survey on its way through a plan: streamed through the stages that take stations one by one, then joined.

use std::path::Path;
use std::time::Instant;

use camera_model::Camera;
use range_io::calibration::Calibration;

use crate::run::stream::{Before, Order, stream};
use crate::run::tally::Tally;
use crate::stages::joining::{Gathered, Joined, adjust, register};
use crate::stages::{Findings, Line};
use crate::survey::compatible::Purpose;
use crate::survey::open::{OpenSurvey, open};
use crate::survey::plausibility::{FrameWatch, StoredWatch};
use crate::survey::records::StageSummary;
use crate::survey::view::View;
use crate::{Plan, Result, Stage};
use commands::Doubt;
use commands::memory::keeping;
use commands::plan::RegisterOptions;
use commands::{Progress, Tape};

/// What a run knows of a survey so far: no rasters.
pub(crate) struct Flow {
    pub(crate) survey: OpenSurvey,
    pub(crate) order: Order,
    line: Line,
    gathered: Option<Gathered>,
    /// What each stage did.
    pub(crate) stages: Vec<StageSummary>,
    /// What speaks against survey and frames.
    pub(crate) doubts: Vec<Doubt>,
    pub(crate) joined: Joined,
    /// The stage that brings the stations together just now, or did last.
    pub(crate) joining: &'static str,
}

/// What was seen of frames on their way.
pub(crate) struct Seen {
    pub(crate) tally: Tally,
    pub(crate) looked: FrameWatch,
    pub(crate) stored: StoredWatch,
}

impl Seen {
    /// Nothing yet.
    pub(crate) fn new(tally: Tally) -> Self {
        Self { tally, looked: FrameWatch::default(), stored: StoredWatch::default() }
    }
}

impl Flow {
    /// Opens a survey for a plan; refuses a plan that the survey's level rules out. The calibration comes with its name in
    /// words.
    pub(crate) fn new(plan: &Plan, folder: &Path, calibration: (Option<Calibration>, String)) -> Result<Self> {
        let survey = open(folder, calibration, Purpose::of(&plan.stages))?;
        plan.check_level(survey.survey.level)?;
        let line = Line::new(&plan.stages, &survey)?;
        let order = Order::new(&survey.survey, &plan.stages, None);
        let options = plan.stages.iter().find_map(|stage| match stage {
            Stage::Register(options) => Some(options),
            _ => None,
        });
        let gathered = |options: &RegisterOptions| Gathered::new(options, &survey, line.camera(), order.views());
        let (gathered, doubts) = (options.map(gathered), survey.doubts.clone());
        let (stages, joined) = (Vec::new(), Joined::default());
        Ok(Self { survey, order, line, gathered, stages, doubts, joined, joining: "" })
    }

    /// The camera whose rays make the clouds.
    pub(crate) fn camera(&self) -> &Camera {
        self.line.camera()
    }

    /// Takes all frames through the stages up to registration and hands on each view that comes out.
    pub(crate) fn views(
        &mut self,
        keep: &mut dyn FnMut(View, &OpenSurvey) -> Result<()>,
        progress: &dyn Progress,
    ) -> Result<()> {
        let tally = self.tally(&self.order, Before::default());
        let seen = self.part_of_views(tally, keep, progress)?;
        self.conclude(seen)
    }

    /// Figures for the frames of a whole, where others come before those here.
    pub(crate) fn tally(&self, whole: &Order, before: Before) -> Tally {
        Tally::new(&self.line, whole.frames(), whole.views(), before)
    }

    /// Takes the frames that the order has left through the stages; what was seen on the way.
    pub(crate) fn part_of_views(
        &mut self,
        mut tally: Tally,
        keep: &mut dyn FnMut(View, &OpenSurvey) -> Result<()>,
        progress: &dyn Progress,
    ) -> Result<Seen> {
        let (survey, gathered) = (&self.survey, &mut self.gathered);
        let gathered_bytes = gathered.as_ref().map_or(0, Gathered::bytes);
        let mut keep = |view: View| {
            if let Some(gathered) = gathered {
                gathered.add(&view, survey);
            }
            keep(view, survey)
        };
        let (order, line) = (&self.order, &mut self.line);
        let bytes = tally.bytes(survey) + gathered_bytes;
        let (looked, stored) = keeping(bytes, || stream(survey, order, line, &mut tally, &mut keep, progress))?;
        Ok(Seen { tally, looked, stored })
    }

    /// Makes figures and doubts of what was seen of all frames.
    pub(crate) fn conclude(&mut self, seen: Seen) -> Result<()> {
        let (stages, doubts) = seen.tally.finish(&self.line, &self.survey)?;
        self.stages = stages;
        self.doubts.extend(seen.looked.doubts());
        self.doubts.extend(seen.stored.doubts());
        self.doubts.extend(doubts);
        Ok(())
    }

    /// Writes what was found and seen, or adds what was in another part of the survey.
    pub(crate) fn carry(&mut self, seen: &mut Seen, tape: &mut Tape) {
        self.line.carry(tape);
        seen.tally.carry(tape);
        seen.looked.carry(tape);
        seen.stored.carry(tape);
    }

    /// Brings all stations into one frame, where a stage of the plan does so.
    pub(crate) fn join(&mut self, plan: &Plan, progress: &dyn Progress) -> Result<()> {
        for stage in &plan.stages {
            let clock = Instant::now();
            let (found, before) = match stage {
                Stage::Register(options) => self.register(options, progress),
                Stage::Adjust(options) => (adjust::run(&mut self.joined, options, progress), 0.0),
                _ => continue,
            };
            self.joining = stage.name();
            let findings = found?;
            let seconds = before + clock.elapsed().as_secs_f64();
            // It moves whole stations, and no range.
            let (truth, change) =
                self.stages.last().map_or((None, None), |last| (last.truth.clone(), last.change_median_m));
            let change_median_m = change.map(|_| 0.0);
            self.stages.push(StageSummary { name: stage.name(), seconds, findings, change_median_m, truth });
        }
        Ok(())
    }

    /// What it found, and the time that gathering took.
    fn register(&mut self, options: &RegisterOptions, progress: &dyn Progress) -> (Result<Findings>, f64) {
        let Some(gathered) = self.gathered.take() else { return (Ok(Findings::new()), 0.0) };
        let seconds = gathered.seconds;
        let found = register::run(gathered, options, progress).map(|(joined, findings)| {
            self.joined = joined;
            findings
        });
        (found, seconds)
    }
}
