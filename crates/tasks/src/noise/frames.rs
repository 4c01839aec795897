//! The frames of a survey by station, read as often as they are asked for, a few at a time.

use std::cell::Cell;

use commands::Progress;
use commands::memory::{FrameBytes, Memory, Work};
use pipeline::Error;
use pipeline::survey::{LiveFrames, OpenSurvey, View};
use rayon::prelude::*;
use sensor_noise::Frames;

/// Frames that are read at once at most: reading is unpacking, which cores share.
const READ_AT_ONCE: usize = 8;

/// Why there is no estimate.
#[derive(Debug)]
pub(crate) enum Failed {
    /// Frames cannot be read, or not be used.
    Read(Error),
    /// They do not determine it.
    Undetermined(sensor_noise::Error),
}

impl From<Error> for Failed {
    fn from(error: Error) -> Self {
        Self::Read(error)
    }
}

impl From<sensor_noise::Error> for Failed {
    fn from(error: sensor_noise::Error) -> Self {
        Self::Undetermined(error)
    }
}

/// An opened survey with the frames of each station.
pub(crate) struct Stations<'a> {
    pub(crate) survey: &'a OpenSurvey,
    progress: &'a dyn Progress,
    /// Name and frames of each station, in the order of the survey.
    named: Vec<(String, Vec<usize>)>,
    /// Frames that were read since all were last.
    done: Cell<usize>,
    read_at_once: usize,
}

/// What is kept of each value whose scatter is estimated (means, variances, their order), byte, and of how many values at most: more
/// are thinned.
const BYTES_A_VALUE: u64 = 170;
const MOST_VALUES: u64 = 1 << 22;

impl<'a> Stations<'a> {
    /// Refuses a survey for whose frames too little memory is allowed.
    pub(crate) fn new(survey: &'a OpenSurvey, progress: &'a dyn Progress) -> Result<Self, Error> {
        let mut stations: Vec<(String, Vec<usize>)> = Vec::new();
        let mut places = std::collections::BTreeMap::new();
        for (index, frame) in survey.survey.frames.iter().enumerate() {
            let place = *places.entry(&frame.station).or_insert(stations.len());
            match stations.get_mut(place) {
                Some((_, frames)) => frames.push(index),
                None => stations.push((frame.station.clone(), vec![index])),
            }
        }
        let (bytes, camera) = (FrameBytes::of(&survey.survey), &survey.survey.camera);
        let planes = (camera.modulation_hz.len().max(1) * camera.phase_steps.unwrap_or(1)) as u64;
        let values = (bytes.pixels * planes * stations.len() as u64).min(MOST_VALUES);
        let (kept, each) = (BYTES_A_VALUE * values, bytes.read + bytes.waiting);
        let work = Work { what: "estimating noise", kept, each, most: READ_AT_ONCE };
        let read_at_once = Memory::present().at_once(&work)?;
        Ok(Self { survey, progress, named: stations, done: Cell::new(0), read_at_once })
    }

    /// Name and frames of each station as what `make` makes of a view.
    pub(crate) fn made<'s, F>(&'s self, make: Make<'s, F>) -> Vec<(String, Station<'s, F>)> {
        let station = |(name, frames): &'s (String, Vec<usize>)| (name.clone(), Station { all: self, frames, make });
        self.named.iter().map(station).collect()
    }

    fn advance(&self) {
        let total = self.survey.survey.frames.len();
        if self.done.get() == 0 {
            self.progress.begin("frames", total);
        }
        self.done.set((self.done.get() + 1) % total);
        self.progress.advance(if self.done.get() == 0 { total } else { self.done.get() });
    }
}

type Make<'a, F> = &'a (dyn Fn(View) -> Result<F, Failed> + Sync);

/// The frames of one station.
pub(crate) struct Station<'a, F> {
    all: &'a Stations<'a>,
    frames: &'a [usize],
    make: Make<'a, F>,
}

impl<F: Send> Frames<F> for Station<'_, F> {
    type Error = Failed;

    fn count(&self) -> usize {
        self.frames.len()
    }

    fn each(&self, see: &mut dyn FnMut(&F) -> Result<(), sensor_noise::Error>) -> Result<(), Failed> {
        let (survey, make) = (self.all.survey, self.make);
        for some in self.frames.chunks(self.all.read_at_once) {
            let read = some.par_iter().map(|index| {
                let view = survey.view(*index)?;
                let live = view.live.clone();
                Ok((make(view)?, live))
            });
            let read: Vec<Result<(F, LiveFrames), Failed>> = read.collect();
            self.all.progress.frames_in_memory(survey.live.count());
            for frame in read {
                see(&frame?.0)?;
                self.all.advance();
            }
        }
        Ok(())
    }
}
