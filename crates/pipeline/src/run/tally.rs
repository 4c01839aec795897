//! What each stage changed, gathered as views go through: counts, and medians of thinned pixels.

use std::time::{Duration, Instant};

use rayon::prelude::*;
use statistics::{Thinning, quantile};

use crate::Result;
use crate::run::stream::Before;
use crate::stages::{Line, Watch};
use crate::survey::open::OpenSurvey;
use crate::survey::plausibility::{SenseVotes, beyond_maximum};
use crate::survey::records::StageSummary;
use crate::survey::truth::{TruthTally, wrap};
use crate::survey::view::{Snapshot, View};
use commands::plan::Stage;
use commands::{Doubt, Tape};

/// The figures of all stages up to registration.
pub(crate) struct Tally {
    stages: Vec<StageTally>,
    /// The views as the last stage left them, which is how the next one finds them.
    last: Vec<Option<Snapshot>>,
    last_stage: usize,
    clock: Instant,
}

struct StageTally {
    thinning: Thinning,
    /// Values of one quantity that will be kept.
    kept: u64,
    /// Views before and after it.
    views: [usize; 2],
    /// Absolute changes of the ranges, metre; `None` once a view had none.
    changes: Option<Vec<f64>>,
    truth: TruthTally,
    seconds: f64,
    votes: SenseVotes,
    beyond: Vec<Doubt>,
}

impl Tally {
    /// For the stages of a line, of which those up to the one that averages see as many views as there are frames.
    pub(crate) fn new(line: &Line, frames: usize, views: usize, before: Before) -> Self {
        let format = line.camera().format;
        let fuses = line.steps().iter().position(|step| matches!(step.stage(), Stage::FuseExposures(_)));
        let is_from = |stage: Option<usize>, number: usize| stage.is_some_and(|stage| number >= stage);
        let of_stage = |number: usize| {
            let views = if is_from(line.average(), number) { views } else { frames };
            let first = match (is_from(fuses, number), is_from(line.average(), number)) {
                (true, _) => before.views,
                (false, true) => before.means,
                (false, false) => before.frames,
            };
            let pixels = views * format.width * format.height;
            let thinning = Thinning::of(pixels).after(first);
            StageTally {
                thinning,
                kept: thinning.kept(pixels),
                views: [0, 0],
                changes: Some(Vec::new()),
                truth: TruthTally::default(),
                seconds: 0.0,
                votes: SenseVotes::default(),
                beyond: Vec::new(),
            }
        };
        let stages = (0..line.steps().len()).map(of_stage).collect();
        Self { stages, last: Vec::new(), last_stage: usize::MAX, clock: Instant::now() }
    }

    /// What it takes, byte: the changes of ranges and their errors.
    pub(crate) fn bytes(&self, survey: &OpenSurvey) -> u64 {
        let numbers = 1 + u64::from(survey.has_truth());
        self.stages.iter().map(|stage| 8 * numbers * stage.kept).sum()
    }

    /// Writes it, or adds another part of the views.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        for stage in &mut self.stages {
            for count in &mut stage.views {
                tape.count(count);
            }
            let mut more = if tape.is_read() { None } else { stage.changes.take() };
            tape.option(&mut more, Vec::new, Tape::numbers);
            stage.changes = stage.changes.take().zip(more).map(|(all, more)| [all, more].concat());
            stage.truth.carry(tape);
            tape.sum(&mut stage.seconds);
            stage.votes.carry(tape);
            tape.records(&mut stage.beyond);
        }
    }

    /// The figures and the doubts of the stages, in their order.
    pub(crate) fn finish(self, line: &Line, survey: &OpenSurvey) -> Result<(Vec<StageSummary>, Vec<Doubt>)> {
        let (mut summaries, mut doubts) = (Vec::new(), Vec::new());
        for (step, tally) in line.steps().iter().zip(self.stages) {
            doubts.extend(tally.votes.doubt());
            doubts.extend(step.doubts().iter().cloned());
            doubts.extend(tally.beyond);
            doubts.extend(step.judge_span(survey)?);
            let changes = tally.changes.filter(|_| tally.views[0] == tally.views[1]);
            let change = changes.map(|mut changes| quantile(&mut changes, 0.5));
            summaries.push(StageSummary {
                name: step.stage().name(),
                seconds: tally.seconds,
                findings: step.findings(),
                change_median_m: change.filter(|change| change.is_finite()),
                truth: tally.truth.figures(),
            });
        }
        Ok((summaries, doubts))
    }

    /// Adds what the stage changed.
    fn compare(&mut self, number: usize, views: &[View], now: &[Option<Snapshot>]) {
        let tally = &mut self.stages[number];
        for (place, (view, after)) in views.iter().zip(now).enumerate() {
            let before = self.last.get(place).and_then(Option::as_ref);
            let (Some(changes), Some((before, after))) = (&mut tally.changes, before.zip(after.as_ref())) else {
                tally.changes = None;
                return;
            };
            let (before, after) = (before.range.as_slice(), after.range.as_slice());
            let change = |pixel: usize| {
                let change = f64::from(after[pixel]) - f64::from(before[pixel]);
                view.modulation.map_or(change, |modulation| wrap(change, modulation)).abs()
            };
            changes.extend(tally.thinning.indices(tally.views[1] + place, after.len()).map(change));
        }
    }
}

impl Watch for Tally {
    fn before(&mut self, number: usize, stage: &Stage, views: &[View]) {
        // Of frames that become a mean there is no change to tell.
        let is_mean = matches!(stage, Stage::Average(_)) && views.len() > 1;
        let is_known = self.last.len() == views.len() && self.last_stage.wrapping_add(1) == number && number > 0;
        if is_mean {
            self.last.clear();
        } else if !is_known {
            self.last = views.par_iter().map(View::snapshot).collect();
        }
        let tally = &mut self.stages[number];
        tally.views[0] += views.len();
        if matches!(stage, Stage::Unwrap(_)) {
            for view in views {
                tally.votes.look_at(view);
            }
        }
        self.clock = Instant::now();
    }

    fn mean(&mut self, number: usize, time: Duration) {
        self.stages[number].seconds += time.as_secs_f64();
        // What follows is told by `after`, or is work on the frames of the next part.
        self.clock = Instant::now();
    }

    fn after(&mut self, number: usize, stage: &Stage, views: &[View]) {
        self.stages[number].seconds += self.clock.elapsed().as_secs_f64();
        let now: Vec<Option<Snapshot>> = views.par_iter().map(View::snapshot).collect();
        self.compare(number, views, &now);
        let tally = &mut self.stages[number];
        for (view, snapshot) in views.iter().zip(&now) {
            if let Some(snapshot) = snapshot {
                tally.truth.add(view, &snapshot.range, tally.thinning);
            }
        }
        let maximum_range_m = match stage {
            Stage::Unwrap(options) => options.maximum_range_m,
            Stage::RepairWraps(options) => Some(options.maximum_range_m),
            _ => None,
        };
        if let Some(maximum_m) = maximum_range_m {
            tally.beyond.extend(views.iter().filter_map(|view| beyond_maximum(view, stage.name(), maximum_m)));
        }
        tally.views[1] += views.len();
        (self.last, self.last_stage) = (now, number);
    }
}
