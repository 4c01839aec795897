//! The frames of a survey, one after the other, through the stages up to registration.
//!
//! What is in memory at a time: a frame for each thread on its way through the stages, fewer where little memory is allowed; at most
//! [`AVERAGED_AT_ONCE`] frames of a station that is averaged (and the means of as many parts); the views of a station that are fused.
//! How many go at once changes no result: each goes by itself, and what is found is gathered in their order.

use std::collections::VecDeque;
use std::time::Instant;

use range_io::survey::Survey;
use rayon::prelude::*;

use crate::Result;
use crate::stages::average::Tests;
use crate::stages::{Line, Watch, up_to_error};
use crate::survey::open::OpenSurvey;
use crate::survey::plausibility::{FrameWatch, StoredWatch};
use crate::survey::view::View;
use commands::Progress;
use commands::memory::{FrameBytes, Memory, Work};
use commands::plan::Stage;

/// Frames that are averaged and tested at once, each kept as complex images. 64 of 640 x 480 pixels and one frequency take
/// 350 MB; of fewer the tests would tell less of each part.
const AVERAGED_AT_ONCE: usize = 64;

/// The frames of each mean of a station; of one frame each where nothing is averaged.
type Group = Vec<usize>;

/// How the frames of a survey make views.
#[derive(Clone)]
pub(crate) struct Order {
    /// What goes through the stages together: a station where exposures are fused, or else one mean.
    units: Vec<Vec<Group>>,
}

impl Order {
    /// Of all frames, or those of one station.
    pub(crate) fn new(survey: &Survey, stages: &[Stage], only: Option<&str>) -> Self {
        let averages = stages.iter().any(|stage| matches!(stage, Stage::Average(_)));
        let fuses = stages.iter().any(|stage| matches!(stage, Stage::FuseExposures(_)));
        let frames = survey.frames.iter().enumerate();
        let frames = frames.filter(|(_, frame)| only.is_none_or(|only| only == frame.station));
        if !averages && !fuses {
            return Self { units: frames.map(|(index, _)| vec![vec![index]]).collect() };
        }
        let stations = grouped(frames, |(_, frame)| frame.station.clone());
        let groups = stations.into_iter().map(|station| {
            // Means are of frames with one integration time.
            let time = |frame: &(usize, &range_io::survey::FrameEntry)| {
                if averages { (None, frame.1.integration_time_s.map(f64::to_bits)) } else { (Some(frame.0), None) }
            };
            let groups = grouped(station.into_iter(), time).into_iter();
            groups.map(|group| group.into_iter().map(|(index, _)| index).collect()).collect::<Vec<Group>>()
        });
        let units = if fuses { groups.collect() } else { groups.flatten().map(|group| vec![group]).collect() };
        Self { units }
    }

    /// Leaves the units of one part of several alone, as equal as may be, and tells what comes before it.
    pub(crate) fn cut(&mut self, part: Part) -> Before {
        let [first, end] = [part.number - 1, part.number].map(|end| end * self.units.len() / part.of);
        let after = self.units.split_off(end);
        let units = self.units.split_off(first);
        let before = Before { frames: self.frames(), means: self.units.iter().map(Vec::len).sum(), views: first };
        drop(after);
        self.units = units;
        before
    }

    /// Frames, and means of them, that go through the stages at once in the memory that is allowed, beside what is on its way in any
    /// case.
    fn at_once(&self, survey: &OpenSurvey, line: &Line) -> Result<usize> {
        let bytes = FrameBytes::of(&survey.survey);
        let longest = self.units.iter().flatten().map(Vec::len).max().unwrap_or(0);
        let waiting = if line.average().is_some() { waiting(longest) } else { 0 };
        // Those that are fused are in memory together.
        let others = self.units.iter().map(Vec::len).max().unwrap_or(1).saturating_sub(1);
        let kept = waiting as u64 * bytes.waiting + others as u64 * bytes.staged;
        let what = match waiting {
            0 => "taking frames through the stages".to_owned(),
            _ => format!("averaging {longest} frames of a station"),
        };
        let (each, most) = (bytes.read + bytes.staged, rayon::current_num_threads());
        Memory::present().at_once(&Work { what: &what, kept, each, most })
    }

    /// The frames, as the survey counts them.
    pub(crate) fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        self.units.iter().flatten().flatten().copied()
    }

    /// Frames.
    pub(crate) fn frames(&self) -> usize {
        self.units.iter().flatten().map(Vec::len).sum()
    }

    /// Views that come out of it.
    pub(crate) fn views(&self) -> usize {
        self.units.len()
    }
}

/// Frames, and means of parts, of a station of so many frames that are in memory together until they are averaged.
fn waiting(frames: usize) -> usize {
    let parts = parts_of(frames);
    if parts > 1 { parts + waiting(frames.div_ceil(parts)) } else { frames }
}

/// Parts in which so many frames are averaged.
fn parts_of(frames: usize) -> usize {
    frames.div_ceil(AVERAGED_AT_ONCE).min(AVERAGED_AT_ONCE)
}

/// One of several parts of a survey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Which one, from 1.
    pub number: usize,
    /// Of how many.
    pub of: usize,
}

/// What comes before a part of a survey.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Before {
    pub(crate) frames: usize,
    /// Means of frames, where exposures are fused later.
    pub(crate) means: usize,
    pub(crate) views: usize,
}

/// A view that waits for others that it is averaged with: their mean has all but its values from the first.
fn beside(view: View, is_first: bool) -> View {
    if is_first { view } else { View { before: None, truth: None, reference_range: None, ..view } }
}

/// Items of one key, in the order in which keys come first.
fn grouped<T, K: Ord>(items: impl Iterator<Item = T>, key: impl Fn(&T) -> K) -> Vec<Vec<T>> {
    let (mut groups, mut places): (Vec<Vec<T>>, _) = (Vec::new(), std::collections::BTreeMap::new());
    for item in items {
        let place = *places.entry(key(&item)).or_insert(groups.len());
        match groups.get_mut(place) {
            Some(group) => group.push(item),
            None => groups.push(vec![item]),
        }
    }
    groups
}

/// A survey on its way.
struct Stream<'a> {
    survey: &'a OpenSurvey,
    line: &'a mut Line,
    watch: &'a mut dyn Watch,
    progress: &'a dyn Progress,
    waiting: std::vec::IntoIter<usize>,
    read: VecDeque<Result<View>>,
    at_once: usize,
    looked: FrameWatch,
    stored: StoredWatch,
    done: usize,
}

/// Takes the frames through the stages and hands on each view that comes out; what was seen of the frames as they were
/// read.
pub(crate) fn stream(
    survey: &OpenSurvey,
    order: &Order,
    line: &mut Line,
    watch: &mut dyn Watch,
    keep: &mut dyn FnMut(View) -> Result<()>,
    progress: &dyn Progress,
) -> Result<(FrameWatch, StoredWatch)> {
    let waiting: Vec<usize> = order.units.iter().flatten().flatten().copied().collect();
    progress.begin("frames", waiting.len());
    let (waiting, read) = (waiting.into_iter(), VecDeque::new());
    let at_once = order.at_once(survey, line)?;
    // What is fused are the views of one station.
    let together = if line.fuses() { 1 } else { at_once };
    let (looked, stored) = (FrameWatch::default(), StoredWatch::default());
    let mut stream = Stream { survey, line, watch, progress, waiting, read, at_once, looked, stored, done: 0 };
    for units in order.units.chunks(together) {
        stream.units(units)?.into_iter().try_for_each(&mut *keep)?;
    }
    Ok((stream.looked, stream.stored))
}

/// Takes the frames of one station through the stages of a line, watched.
pub fn follow_station(
    survey: &OpenSurvey,
    station: &str,
    (stages, line): (&[Stage], &mut Line),
    watch: &mut dyn Watch,
    progress: &dyn Progress,
) -> Result<()> {
    let order = Order::new(&survey.survey, stages, Some(station));
    stream(survey, &order, line, watch, &mut |_| Ok(()), progress).map(drop)
}

impl Stream<'_> {
    fn units(&mut self, units: &[Vec<Group>]) -> Result<Vec<View>> {
        let average = self.line.average();
        let views = up_to_error(units.iter().flatten().map(|frames| match average {
            Some(number) => self.mean(number, frames),
            None => self.next(),
        }));
        let rest = average.map_or(0, |number| number + 1)..self.line.steps().len();
        let views = self.line.apply_some(rest, views, self.watch)?;
        if average.is_none() {
            self.done += units.iter().flatten().map(Vec::len).sum::<usize>();
            self.progress.advance(self.done);
        }
        Ok(views)
    }

    fn mean(&mut self, number: usize, frames: &[usize]) -> Result<View> {
        let (view, tests) = self.part(number, frames)?;
        self.line.record_mean(number, &view, &tests, self.watch);
        Ok(view)
    }

    /// The mean of frames, in parts where they are many.
    fn part(&mut self, number: usize, frames: &[usize]) -> Result<(View, Tests)> {
        let parts = parts_of(frames.len());
        let (mut views, mut tests): (Vec<View>, _) = (Vec::new(), Tests::default());
        if parts > 1 {
            for part in 0..parts {
                let ends = [part, part + 1].map(|end| end * frames.len() / parts);
                let (view, found) = self.part(number, &frames[ends[0]..ends[1]])?;
                views.push(beside(view, views.is_empty()));
                tests = tests.join(found);
            }
        } else {
            for some in frames.chunks(self.at_once) {
                let some = up_to_error(some.iter().map(|_| self.next()));
                let some = self.line.apply_some(0..number, some, self.watch)?;
                self.done += some.len();
                self.progress.advance(self.done);
                for view in some {
                    views.push(beside(view, views.is_empty()));
                }
            }
            self.watch.before(number, self.line.steps()[number].stage(), &views);
        }
        let clock = Instant::now();
        let (view, found) = self.line.mean(number, views)?;
        self.watch.mean(number, clock.elapsed());
        Ok((view, tests.join(found)))
    }

    /// The frame whose turn it is.
    fn next(&mut self) -> Result<View> {
        if self.read.is_empty() {
            let indices: Vec<usize> = self.waiting.by_ref().take(self.at_once).collect();
            let views = indices.into_par_iter().map(|index| self.survey.view(index)).collect::<Vec<Result<View>>>();
            self.read = VecDeque::from(views);
            self.progress.frames_in_memory(self.survey.live.count());
            for view in self.read.iter().flatten() {
                self.looked.look(view);
                self.stored.look(self.survey, view);
            }
        }
        self.read.pop_front().unwrap_or_else(|| Err(crate::Error::unfit("read frames", "the survey", "no frame")))
    }
}
