//! Frames that hold nothing, hold the same as another one, or are in another unit than metre.

use std::collections::{BTreeMap, BTreeSet};

use range_image::Samples;
use statistics::{quantile, upper_median};

use crate::survey::plausibility::{FURTHEST_M, NEAREST_M, some_of};
use crate::survey::view::{View, ViewData};
use commands::{Doubt, DoubtKind, Tape};

/// Values of a plane that are looked at, evenly over it: noise makes no two frames alike in so many.
const LOOKED_AT: usize = 1024;
/// From so many frames on, each of a station of its own, a survey is the stream of a moving camera.
const STREAM: usize = 16;
/// Frames that a recorder may drop one after the other, filling in the last one that it has.
const MOST_DROPPED: usize = 3;
/// Part of a plane's values that are one and the same in a dead frame; the rest are hot pixels.
const DEAD_SHARE: f64 = 0.98;

/// What has been seen of the frames so far, in whatever order.
#[derive(Debug, Default)]
pub struct FrameWatch {
    looked: Vec<Looked>,
    is_stream: bool,
}

/// What is kept of a frame.
#[derive(Debug, Default)]
struct Looked {
    frame: usize,
    station: String,
    /// The value of a dead frame.
    dead: Option<f32>,
    /// Two frames of the same are the same.
    content: u64,
    /// Median of a frame that came with ranges, metre.
    range_m: Option<f64>,
}

/// Station and frame of a frame and of the earlier one of another station that it repeats.
type Repeat<'a> = [(&'a str, usize); 2];

impl FrameWatch {
    /// For the frames of a moving camera, however few.
    pub fn of_stream() -> Self {
        Self { is_stream: true, ..Self::default() }
    }

    /// Looks at a frame as it was read.
    pub fn look(&mut self, view: &View) {
        let planes = planes(view);
        let hash = |hash: u64, value: &f32| (hash ^ u64::from(value.to_bits())).wrapping_mul(FNV_PRIME);
        let range_m = match (&view.data, planes.first()) {
            (ViewData::Range(_), Some(plane)) => {
                let mut values: Vec<f64> = plane.iter().map(|value| f64::from(*value)).collect();
                Some(quantile(&mut values, 0.5))
            }
            _ => None,
        };
        self.looked.push(Looked {
            frame: view.frames.first().copied().unwrap_or_default(),
            station: view.station.clone(),
            dead: planes.iter().find_map(|plane| dead_value(plane)),
            content: planes.iter().flatten().fold(FNV_OFFSET, hash),
            range_m,
        });
    }

    /// Writes it, or adds the frames of another part of the survey.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        tape.list(&mut self.looked, Looked::default, |tape, looked| {
            tape.count(&mut looked.frame);
            tape.text(&mut looked.station);
            let mut dead = looked.dead.map(f64::from);
            tape.option(&mut dead, f64::default, Tape::number);
            looked.dead = dead.map(|value| value as f32);
            looked.content = tape.bits(looked.content);
            tape.option(&mut looked.range_m, f64::default, Tape::number);
        });
    }

    /// What speaks against the frames.
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut frames: Vec<&Looked> = self.looked.iter().collect();
        frames.sort_by_key(|looked| looked.frame);
        let mut doubts = dead_stations(&frames);
        doubts.extend(self.repeated_stations(&frames));
        let alive = frames.iter().filter(|looked| looked.dead.is_none());
        let middle = quantile(&mut alive.filter_map(|looked| looked.range_m).collect::<Vec<f64>>(), 0.5);
        if !middle.is_nan() && !(NEAREST_M..=FURTHEST_M).contains(&middle) {
            let (value, unit) = if middle < 1.0 { (1e3 * middle, "mm") } else { (middle, "m") };
            let words = format!(
                "half of all ranges are {} {value:.3} {unit}, which no camera of this kind measures: ranges and depths are in metres \
                 (integers times depth.scale_m of survey.ron)",
                if middle < NEAREST_M { "below" } else { "above" }
            );
            doubts.push(Doubt::new(DoubtKind::Units, words));
        }
        doubts
    }

    fn repeated_stations(&self, frames: &[&Looked]) -> Vec<Doubt> {
        let all: BTreeSet<&str> = frames.iter().map(|looked| looked.station.as_str()).collect();
        let is_stream = self.is_stream || (frames.len() >= STREAM && frames.len() == all.len());
        // A frame that repeats the one before stands for one that a recorder of a stream has dropped.
        let is_dropped = |[here, earlier]: &Repeat<'_>| is_stream && here.1.abs_diff(earlier.1) <= MOST_DROPPED;
        let mut stations: BTreeMap<&str, Vec<Repeat<'_>>> = BTreeMap::new();
        for repeat in repeats(frames).into_iter().filter(|repeat| !is_dropped(repeat)) {
            stations.entry(repeat[0].0).or_default().push(repeat);
        }
        let doubt = |(station, repeats): (&str, Vec<Repeat<'_>>)| {
            let [(_, frame), (other, earlier)] = repeats[0];
            let words = format!(
                "{} of its frames are bit for bit those of station {other} (frame {frame} is frame {earlier}): one of the two \
                 has the files of the other",
                repeats.len()
            );
            Doubt::about(DoubtKind::RepeatedFrames, station, words)
        };
        if stations.len() > MOST_NAMED {
            let names: Vec<&str> = stations.keys().copied().collect();
            let words = format!(
                "{} stations have frames that are bit for bit those of another station ({}): files were copied, or the \
                 recording repeats what it had dropped",
                names.len(),
                some_of(&names)
            );
            return vec![Doubt::new(DoubtKind::RepeatedFrames, words)];
        }
        stations.into_iter().map(doubt).collect()
    }
}

fn dead_stations(frames: &[&Looked]) -> Vec<Doubt> {
    let dead = || frames.iter().filter_map(|looked| Some((looked.station.as_str(), f64::from(looked.dead?))));
    if let Some((_, first)) = dead().next().filter(|_| dead().count() == frames.len() && frames.len() > 1) {
        let words = format!(
            "all {} frames hold one and the same value (the first: {first}): the camera was dead, dark or saturated",
            frames.len()
        );
        return vec![Doubt::new(DoubtKind::DeadFrames, words)];
    }
    let mut stations: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for (station, value) in dead() {
        stations.entry(station).or_insert((0, value)).0 += 1;
    }
    let doubt = |(station, (frames, value)): (&str, (usize, f64))| {
        let words = format!(
            "{frames} of its frames hold one and the same value ({value}) at all pixels of an image: dead, dark or \
             saturated; leave them out of survey.ron"
        );
        Doubt::about(DoubtKind::DeadFrames, station, words)
    };
    stations.into_iter().map(doubt).collect()
}

/// Frames that are those of another station; of dead ones nothing can be told.
fn repeats<'a>(frames: &[&'a Looked]) -> Vec<Repeat<'a>> {
    let mut seen: BTreeMap<u64, (&str, usize)> = BTreeMap::new();
    let mut repeats = Vec::new();
    for looked in frames.iter().filter(|looked| looked.dead.is_none()) {
        let here = (looked.station.as_str(), looked.frame);
        let earlier = *seen.entry(looked.content).or_insert(here);
        if earlier.0 != here.0 {
            repeats.push([here, earlier]);
        }
    }
    repeats
}

/// Stations with a line of their own; more are counted in one.
const MOST_NAMED: usize = 5;

const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0100_0000_01b3;

/// Some values of each plane of a frame.
fn planes(view: &View) -> Vec<Vec<f32>> {
    match &view.data {
        ViewData::Samples(raw) => {
            let size = (raw.width() * raw.height()).max(1);
            match raw.samples() {
                Samples::F32(values) => values.chunks(size).map(|plane| some(plane, |value| value)).collect(),
                Samples::U16(values) => values.chunks(size).map(|plane| some(plane, f32::from)).collect(),
                Samples::I16(values) => values.chunks(size).map(|plane| some(plane, f32::from)).collect(),
            }
        }
        ViewData::Phase(frame) => frame.channels.iter().map(|one| some(one.real.as_slice(), |value| value)).collect(),
        ViewData::Range(frame) => vec![some(frame.range.as_slice(), |value| value)],
    }
}

fn some<T: Copy>(plane: &[T], value: impl Fn(T) -> f32) -> Vec<f32> {
    let step = plane.len().div_ceil(LOOKED_AT).max(1);
    plane.iter().step_by(step).map(|sample| value(*sample)).collect()
}

/// The value that nearly all finite ones of a plane have; two values are no plane.
fn dead_value(plane: &[f32]) -> Option<f32> {
    let mut finite: Vec<f32> = plane.iter().copied().filter(|value| value.is_finite()).collect();
    if finite.len() < 16 {
        return None;
    }
    // What nearly all have is what the one in the middle has.
    let value = upper_median(&mut finite);
    let same = finite.iter().filter(|other| other.to_bits() == value.to_bits()).count();
    (same as f64 >= DEAD_SHARE * finite.len() as f64).then_some(value)
}
