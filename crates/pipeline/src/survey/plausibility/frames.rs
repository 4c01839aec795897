//! Frames that hold nothing, hold the same as another one, or are in another unit than metre.

use std::collections::{BTreeMap, BTreeSet};

use range_image::Samples;
use statistics::{quantile, upper_median};

use crate::command::verdict::{Doubt, DoubtKind};
use crate::survey::plausibility::{FURTHEST_M, NEAREST_M, some_of};
use crate::survey::view::{View, ViewData};

/// Values of a plane that are looked at, evenly over it: noise makes no two frames alike in so many.
const LOOKED_AT: usize = 1024;
/// From so many frames on, each of a station of its own, a survey is the stream of a moving camera.
const STREAM: usize = 16;
/// Frames that a recorder may drop one after the other, filling in the last one that it has.
const MOST_DROPPED: usize = 3;
/// Part of a plane's values that are one and the same in a dead frame; the rest are hot pixels.
const DEAD_SHARE: f64 = 0.98;

/// What has been seen of the frames so far.
#[derive(Debug, Default)]
pub struct FrameWatch {
    /// Station and value of dead frames.
    dead: Vec<(String, f64)>,
    /// Station and frame by the frame's content.
    seen: BTreeMap<u64, (String, usize)>,
    /// Station and frame of a frame and of the earlier one of another station that it repeats.
    repeats: Vec<[(String, usize); 2]>,
    /// Median range of each frame that came with ranges, metre.
    ranges_m: Vec<f64>,
    frames: usize,
    stations: BTreeSet<String>,
    is_stream: bool,
}

impl FrameWatch {
    /// For the frames of a moving camera, however few.
    pub fn of_stream() -> Self {
        Self { is_stream: true, ..Self::default() }
    }

    /// Looks at a frame as it was read.
    pub fn look(&mut self, view: &View) {
        self.frames += 1;
        self.stations.insert(view.station.clone());
        let frame = view.frames.first().copied().unwrap_or_default();
        let planes = planes(view);
        if let Some(value) = planes.iter().find_map(|plane| dead_value(plane)) {
            self.dead.push((view.station.clone(), f64::from(value)));
            return;
        }
        let content = planes
            .iter()
            .flatten()
            .fold(FNV_OFFSET, |hash, value| (hash ^ u64::from(value.to_bits())).wrapping_mul(FNV_PRIME));
        let here = (view.station.clone(), frame);
        match self.seen.get(&content) {
            Some(earlier) if earlier.0 != here.0 => self.repeats.push([here, earlier.clone()]),
            Some(_) => {}
            None => drop(self.seen.insert(content, here)),
        }
        if let (ViewData::Range(_), Some(plane)) = (&view.data, planes.first()) {
            let mut values: Vec<f64> = plane.iter().map(|value| f64::from(*value)).collect();
            self.ranges_m.push(quantile(&mut values, 0.5));
        }
    }

    /// What speaks against the frames.
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = self.dead_stations();
        doubts.extend(self.repeated_stations());
        let middle = quantile(&mut self.ranges_m.clone(), 0.5);
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

    fn dead_stations(&self) -> Vec<Doubt> {
        if self.dead.len() == self.frames && self.frames > 1 {
            let words = format!(
                "all {} frames hold one and the same value (the first: {}): the camera was dead, dark or saturated",
                self.frames, self.dead[0].1
            );
            return vec![Doubt::new(DoubtKind::DeadFrames, words)];
        }
        let mut stations: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
        for (station, value) in &self.dead {
            stations.entry(station).or_insert((0, *value)).0 += 1;
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

    /// Whether a frame stands for one that a recorder of a stream has dropped: it repeats the one before.
    fn is_dropped(&self, frame: usize, earlier: usize) -> bool {
        let is_stream = self.is_stream || (self.frames >= STREAM && self.frames == self.stations.len());
        is_stream && frame.abs_diff(earlier) <= MOST_DROPPED
    }

    fn repeated_stations(&self) -> Vec<Doubt> {
        let mut stations: BTreeMap<&str, Vec<&[(String, usize); 2]>> = BTreeMap::new();
        for repeat in self.repeats.iter().filter(|[here, earlier]| !self.is_dropped(here.1, earlier.1)) {
            stations.entry(&repeat[0].0).or_default().push(repeat);
        }
        let doubt = |(station, repeats): (&str, Vec<&[(String, usize); 2]>)| {
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
