//! Repair of wrapped ranges and depths where the camera gave no phases.

use std::f32::consts::TAU;

use range_image::Raster;

use crate::frequencies::fold::{Fold, locate, phase_from_folded};
use crate::image::continuity::relative_counts;
use crate::{Error, Result, SpatialOptions, Unwrapped, unwrap_spatial};

/// Brightness of the first interval, its median times this, beyond which nothing is pushed away: albedos differ by ten.
/// A smaller factor leaves bright boards folded, a larger one pushes reflectors away.
const GLARE: f32 = 10.0;
/// Fewer pixels than this in the first interval tell nothing about it.
const GLARE_PIXELS: usize = 64;

/// Share of the largest confidence in its segment that a pixel needs to get an interval added: below, it bends as noise
/// and mixed pixels do, and a range moved by a wrong interval harms more than one that is left and flagged. A choice on
/// which the figures of `tests/repair.rs` rest.
const ADDING_SHARE: f32 = 0.95;

/// How wrapped ranges are repaired.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepairOptions {
    /// How counts are found. By default at most one wrap is searched, and a confidence of 0.8 makes a count sure.
    pub spatial: SpatialOptions,
    /// Where the camera's ranges begin. Default: [`Fold::Detect`].
    pub fold: Fold,
    /// What the camera has done to the amplitudes. Default: [`AmplitudeKind::Received`].
    pub amplitude_kind: AmplitudeKind,
}

/// What a camera's amplitudes stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AmplitudeKind {
    /// The signal received: a surface that is twice as far is four times as dark.
    #[default]
    Received,
    /// Times the square of the range that the camera reports, so that near and far surfaces look alike. This is undone
    /// with the wrapped range, which is what the camera knew.
    RangeCompensated,
    /// One of both, nobody knows which. A count is sure where one of them makes it sure and the other is not sure of another.
    Unknown,
}

impl Default for RepairOptions {
    fn default() -> Self {
        let spatial = SpatialOptions { maximum_wraps: 1, minimum_confidence: 0.8, ..SpatialOptions::default() };
        Self { spatial, fold: Fold::default(), amplitude_kind: AmplitudeKind::default() }
    }
}

/// Ranges with the intervals added that the camera had lost.
#[derive(Debug, Clone, PartialEq)]
pub struct RepairedRanges {
    /// Metres. Where a count is not sure, and where nothing is to be repaired, the value that came in.
    pub range: Raster<f32>,
    /// Intervals added to the range that came in.
    pub wraps: Raster<i32>,
    /// 0 (a guess, or no value) to 1 for the count found, whether it was added or not; NaN where the ranges were taken
    /// for unwrapped already.
    pub confidence: Raster<f32>,
    /// Pixels whose count is not sure: the value may be one or several intervals too near.
    pub unsure: Raster<bool>,
    /// Island of each pixel: 0 where masked, else 1 + index into `islands`.
    pub island: Raster<u32>,
    /// What was found about each island.
    pub islands: Vec<RepairedIsland>,
    /// What was found about the frame.
    pub verdict: RepairVerdict,
}

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RepairVerdict {
    /// Ranges span more than one interval: something has unwrapped them before, and they are left alone.
    AlreadyUnwrapped,
    /// Counts come from brightness and continuity, and are absolute where sure.
    Absolute {
        /// Range in metres at which the camera's ranges begin.
        fold_m: f64,
    },
    /// No amplitudes: a surface that runs through the fold is continued beyond it, on the assumption that its nearest
    /// part lies in the first interval. What does not run through the fold is unsure.
    Relative {
        /// Range in metres at which the camera's ranges begin.
        fold_m: f64,
    },
}

/// What became of a connected part of the image.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RepairedIsland {
    /// Number of pixels.
    pub pixels: usize,
    /// Pixels that got intervals added.
    pub repaired: usize,
    /// Pixels whose count is not sure.
    pub unsure: usize,
}

impl RepairedIsland {
    /// Whether most of the island's counts are sure.
    pub fn is_decided(&self) -> bool {
        2 * self.unsure < self.pixels
    }
}

/// Depths with the intervals added that the camera had lost along the rays.
#[derive(Debug, Clone, PartialEq)]
pub struct RepairedDepths {
    /// Metres along the viewing axis; as it came in where nothing was added.
    pub depth: Raster<f32>,
    /// The same in ranges, with counts and verdicts.
    pub ranges: RepairedRanges,
}

/// Finds the intervals that wrapped ranges have lost ("a ceiling at 2 m reads 6 cm") and adds them where they are sure.
///
/// `range_m` holds radial ranges in metres in `[fold, fold + interval)`, not finite where there is no value; `interval_m`
/// is the ambiguity interval U. In `mask`, true means use. With amplitudes the counts are those of
/// [`unwrap_spatial`](crate::unwrap_spatial) on `phase = 2 pi (range - fold) / U`. An amplitude of another kind than
/// stated, or pixels far outside the interval, make counts unsure or wrong: see [`AmplitudeKind`].
///
/// # Errors
/// [`Error::OutOfDomain`] for an option or interval, [`Error::AllMasked`], [`Error::Raster`] where sizes differ.
///
/// ```
/// use phase_unwrap::range_image::Raster;
/// use phase_unwrap::{RepairOptions, repair_ranges};
///
/// // A floor from 2 m to 8 m, seen by a camera that counts to 5 m only; brightness falls with the square of the range.
/// let truth = Raster::from_fn(60, 80, |_col, row| 2.0 + 0.076 * row as f32);
/// let amplitude = truth.map(|range| 900.0 / (range * range));
/// let shown = truth.map(|range| range % 5.0);
/// let found = repair_ranges(&shown, Some(&amplitude), None, 5.0, &RepairOptions::default())?;
/// assert_eq!(found.wraps[(30, 75)], 1);
/// assert!((found.range[(30, 75)] - truth[(30, 75)]).abs() < 1e-5);
/// # Ok::<(), phase_unwrap::Error>(())
/// ```
pub fn repair_ranges(
    range_m: &Raster<f32>,
    amplitude: Option<&Raster<f32>>,
    mask: Option<&Raster<bool>>,
    interval_m: f64,
    options: &RepairOptions,
) -> Result<RepairedRanges> {
    options.spatial.validate()?;
    if let Some(amplitude) = amplitude {
        range_m.require_same_size(amplitude, "amplitude")?;
    }
    if let Some(mask) = mask {
        range_m.require_same_size(mask, "mask")?;
    }
    let Some(fold_m) = locate(range_m, mask, interval_m, options.fold)? else {
        return Ok(left_alone(range_m));
    };
    let phase = phase_from_folded(range_m, interval_m, fold_m);
    let Some(amplitude) = amplitude else {
        let found = relative_counts(&phase, mask, &options.spatial)?;
        return Ok(apply(range_m, interval_m, found, options, RepairVerdict::Relative { fold_m }));
    };
    let of_kind = |kind| absolute_counts(&phase, &received_amplitude(amplitude, &phase, kind), mask, &options.spatial);
    let found = match options.amplitude_kind {
        AmplitudeKind::Unknown => of_kind(AmplitudeKind::Received)?
            .zip(of_kind(AmplitudeKind::RangeCompensated)?)
            .map(|(received, compensated)| agreed(received, &compensated)),
        kind => of_kind(kind)?,
    };
    let Some(found) = found else {
        let found = relative_counts(&phase, mask, &options.spatial)?;
        return Ok(apply(range_m, interval_m, found, options, RepairVerdict::Relative { fold_m }));
    };
    Ok(apply(range_m, interval_m, found, options, RepairVerdict::Absolute { fold_m }))
}

/// Counts by brightness and continuity; `None` where no amplitude says anything.
fn absolute_counts(
    phase: &Raster<f32>,
    received: &Raster<f32>,
    mask: Option<&Raster<bool>>,
    options: &SpatialOptions,
) -> Result<Option<Unwrapped>> {
    let mut found = unwrap_spatial(phase, Some(received), mask, options)?;
    if found.typical_amplitude_at_interval.is_none() {
        return Ok(None);
    }
    doubt_glare(phase, received, options.minimum_confidence, &mut found);
    Ok(Some(found))
}

/// The surer of two opinions for each pixel, less what the other holds for another count. An interval is added only where
/// both do so.
fn agreed(mut one: Unwrapped, other: &Unwrapped) -> Unwrapped {
    let pixels = one.wraps.as_mut_slice().iter_mut().zip(one.confidence.as_mut_slice());
    let others = other.wraps.as_slice().iter().zip(other.confidence.as_slice());
    for ((wraps, confidence), (&other_wraps, &other_confidence)) in pixels.zip(others) {
        let (surer, less) = (confidence.max(other_confidence), confidence.min(other_confidence));
        let contradicted = *wraps != other_wraps;
        *wraps = if other_confidence > *confidence { other_wraps } else { *wraps };
        *confidence = match contradicted {
            false => surer,
            true if *wraps == 0 => surer * (1.0 - less),
            true => 0.0,
        };
    }
    one
}

/// Takes the confidence from added counts that would make a surface far brighter than what lies in the first interval:
/// a bright surface is no reason to push anything away, and amplitudes may not be what they were said to be.
fn doubt_glare(phase: &Raster<f32>, amplitude: &Raster<f32>, minimum_confidence: f32, found: &mut Unwrapped) {
    let brightness = |index: usize| {
        let cycles = phase.as_slice()[index] / TAU + found.wraps.as_slice()[index] as f32;
        amplitude.as_slice()[index] * cycles * cycles
    };
    let sure = |index: usize| found.confidence.as_slice()[index] >= minimum_confidence;
    let near = (0..phase.len()).filter(|&index| sure(index) && found.wraps.as_slice()[index] == 0);
    let mut near: Vec<f32> = near.map(brightness).filter(|brightness| *brightness > 0.0).collect();
    if near.len() < GLARE_PIXELS {
        return;
    }
    let limit = GLARE * statistics::upper_median(&mut near);
    let glaring: Vec<bool> = (0..phase.len()).map(|i| found.wraps.as_slice()[i] > 0 && brightness(i) > limit).collect();
    for (confidence, glaring) in found.confidence.as_mut_slice().iter_mut().zip(glaring) {
        if glaring {
            *confidence = 0.0;
        }
    }
}

/// As [`repair_ranges`] for depths along the viewing axis. `cosine` is that of the angle between each pixel's ray and
/// the axis, in `(0, 1]`, not finite where the ray is not known: a range wraps along its ray, so depths wrap by
/// `interval * cosine`.
pub fn repair_depths(
    depth_m: &Raster<f32>,
    cosine: &Raster<f32>,
    amplitude: Option<&Raster<f32>>,
    mask: Option<&Raster<bool>>,
    interval_m: f64,
    options: &RepairOptions,
) -> Result<RepairedDepths> {
    depth_m.require_same_size(cosine, "cosine")?;
    // Cosines rounded to single precision may exceed one by their last bit.
    let outside = |value: &&f32| value.is_finite() && !(**value > 0.0 && **value <= 1.0 + f32::EPSILON);
    if let Some(&value) = cosine.as_slice().iter().find(outside) {
        return Err(Error::OutOfDomain { name: "cosine", value: value.into(), expected: "above 0 and at most 1" });
    }
    let mut range = depth_m.clone();
    for (range, cosine) in range.as_mut_slice().iter_mut().zip(cosine.as_slice()) {
        *range /= cosine;
    }
    let ranges = repair_ranges(&range, amplitude, mask, interval_m, options)?;
    let mut depth = depth_m.clone();
    let added = ranges.wraps.as_slice().iter().zip(cosine.as_slice());
    for (depth, (&wraps, cosine)) in depth.as_mut_slice().iter_mut().zip(added) {
        if wraps != 0 {
            *depth += (f64::from(wraps) * interval_m * f64::from(*cosine)) as f32;
        }
    }
    Ok(RepairedDepths { depth, ranges })
}

/// The signal received; what is not positive says nothing.
fn received_amplitude(amplitude: &Raster<f32>, phase: &Raster<f32>, kind: AmplitudeKind) -> Raster<f32> {
    let mut received = amplitude.clone();
    if kind == AmplitudeKind::RangeCompensated {
        for (received, phase) in received.as_mut_slice().iter_mut().zip(phase.as_slice()) {
            *received /= phase * phase;
        }
    }
    received
}

fn left_alone(range_m: &Raster<f32>) -> RepairedRanges {
    let (width, height) = (range_m.width(), range_m.height());
    RepairedRanges {
        range: range_m.clone(),
        wraps: Raster::filled(width, height, 0),
        confidence: Raster::filled(width, height, f32::NAN),
        unsure: range_m.map(|range| !range.is_finite()),
        island: Raster::filled(width, height, 0),
        islands: Vec::new(),
        verdict: RepairVerdict::AlreadyUnwrapped,
    }
}

/// Calls pixels unsure that sit loosely in their segment, where they would get an interval.
fn keep_loose_pixels(found: &Unwrapped, unsure: &mut Raster<bool>) {
    let segments = found.segment.as_slice();
    let mut surest = vec![0.0_f32; segments.iter().max().map_or(0, |&last| last as usize + 1)];
    for (&segment, &confidence) in segments.iter().zip(found.confidence.as_slice()) {
        surest[segment as usize] = surest[segment as usize].max(confidence);
    }
    let pixels = segments.iter().zip(found.confidence.as_slice()).zip(found.wraps.as_slice());
    for (unsure, ((&segment, &confidence), &wraps)) in unsure.as_mut_slice().iter_mut().zip(pixels) {
        *unsure |= wraps != 0 && confidence < ADDING_SHARE * surest[segment as usize];
    }
}

/// Adds the counts that are sure.
fn apply(
    range_m: &Raster<f32>,
    interval_m: f64,
    found: Unwrapped,
    options: &RepairOptions,
    verdict: RepairVerdict,
) -> RepairedRanges {
    let mut islands = vec![RepairedIsland::default(); found.islands.len()];
    let mut unsure = found.unsure(options.spatial.minimum_confidence);
    keep_loose_pixels(&found, &mut unsure);
    let (mut range, mut wraps) = (range_m.clone(), found.wraps);
    let counts = wraps.as_mut_slice().iter_mut().zip(unsure.as_slice()).zip(found.island.as_slice());
    for (range, ((wraps, &unsure), &island)) in range.as_mut_slice().iter_mut().zip(counts) {
        if unsure {
            *wraps = 0;
        } else {
            *range += (f64::from(*wraps) * interval_m) as f32;
        }
        if let Some(island) = islands.get_mut((island as usize).wrapping_sub(1)) {
            island.pixels += 1;
            island.repaired += usize::from(*wraps != 0);
            island.unsure += usize::from(unsure);
        }
    }
    RepairedRanges { range, wraps, confidence: found.confidence, unsure, island: found.island, islands, verdict }
}
