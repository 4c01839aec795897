//! Whether repeated frames show a scene and a camera at rest, before they are averaged.

use rayon::prelude::*;

use crate::average::require_alike;
use crate::{ComplexFrame, Error, Flags, RangeFrame, Raster, Result, chi_squared_upper_quantile};

/// Pixels that one task takes; its sums are added in the order of the pixels.
const PIXELS_PER_TASK: usize = 4096;

/// Frames' common deviations that are less significant than this are chance.
const SIGNIFICANT: f64 = 5.0;

/// When repeated frames count as at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct RestOptions {
    /// Probability with which noise alone makes a pixel count as moved.
    pub moved_probability: f64,
    /// Largest share of pixels that may have moved.
    pub largest_moved_share: f64,
    /// Largest deviation that all pixels of a frame may have in common, in standard deviations of a pixel in one frame.
    pub largest_drift_sigmas: f64,
}

impl Default for RestOptions {
    /// One pixel in ten thousand; half of the pixels; a fifth of a standard deviation.
    fn default() -> Self {
        Self { moved_probability: 1e-4, largest_moved_share: 0.5, largest_drift_sigmas: 0.2 }
    }
}

/// What all pixels of a frame have in common beside the mean of all frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameDeviation {
    /// Phase in radian, or range in metre.
    pub distance: f64,
    /// Share of the amplitude; zero for ranges.
    pub amplitude: f64,
}

/// What the tests say together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RestVerdict {
    /// Nothing moves but single pixels, nothing drifts.
    AtRest,
    /// Too large a share of the pixels moved.
    SceneMoved {
        /// That share.
        share: f64,
    },
    /// A frame deviates as a whole: the camera warms up, or the light changed.
    Drifts {
        /// The frame that deviates most, counted from 0.
        frame: usize,
        /// Phase or range, or amplitude.
        what: &'static str,
        /// How far, in standard deviations of a pixel.
        sigmas: f64,
    },
    /// No pixel has a known standard deviation in two frames: nothing can be tested.
    SigmaUnknown,
}

/// The tests of repeated frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// Pixels whose values scatter more than their sigma says.
    pub moved: Raster<bool>,
    /// Their number.
    pub moved_pixels: usize,
    /// Pixels that could be tested.
    pub tested_pixels: usize,
    /// Each frame as a whole, from the pixels that did not move.
    pub frames: Vec<FrameDeviation>,
    /// Standard deviation of these deviations.
    pub deviation_sigma: f64,
    /// What that means.
    pub verdict: RestVerdict,
}

impl Rest {
    /// Flags the pixels that moved with [`Flags::MOTION`].
    pub fn flag(&self, flags: &mut Raster<Flags>) {
        for (flags, moved) in flags.as_mut_slice().iter_mut().zip(self.moved.as_slice()) {
            if *moved {
                flags.insert(Flags::MOTION);
            }
        }
    }
}

/// Tests complex images in units of their sigma: each pixel by `Σ |z − mean|² / σ²`, which is χ² with `2 (n − 1)` degrees
/// of freedom for each frequency, and each frame by the phase and the amplitude that all pixels have in common.
///
/// Pixels without a value or a sigma in two frames are not tested.
pub fn check_rest(frames: &[ComplexFrame], options: &RestOptions) -> Result<Rest> {
    require_alike(frames)?;
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "test of rest" }) };
    let size = [first.width(), first.height()];
    check(size, frames.len(), options, ["phase", "amplitude"], |pixel, test| {
        for index in 0..first.channels.len() {
            let value = |frame: &ComplexFrame| {
                let channel = &frame.channels[index];
                let parts = [channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]];
                (parts.map(f64::from), f64::from(channel.sigma.as_slice()[pixel]))
            };
            let values: Vec<([f64; 2], f64)> = frames.iter().map(value).collect();
            test.add(&values, 2, |mean| mean);
        }
    })
}

/// Tests range frames in the same way, with `n − 1` degrees of freedom.
pub fn check_rest_of_ranges(frames: &[RangeFrame], options: &RestOptions) -> Result<Rest> {
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "test of rest" }) };
    for (index, frame) in frames.iter().enumerate() {
        frame.validate()?;
        if (frame.width(), frame.height()) != (first.width(), first.height()) {
            return Err(Error::Inconsistent { index, what: "the size" });
        }
    }
    check([first.width(), first.height()], frames.len(), options, ["range", "amplitude"], |pixel, test| {
        let value = |frame: &RangeFrame| {
            let range = f64::from(frame.range.as_slice()[pixel]);
            ([0.0, range], f64::from(frame.sigma.as_slice()[pixel]))
        };
        let values: Vec<([f64; 2], f64)> = frames.iter().map(value).collect();
        // What ranges have in common is counted in metre, not relative to them.
        test.add(&values, 1, |_| [1.0, 0.0]);
    })
}

/// One pixel's part in the tests.
struct PixelTest {
    square: f64,
    degrees: usize,
    /// Weighted deviation of each frame along the value (amplitude) and across it (phase).
    common: Vec<[f64; 2]>,
    weight: f64,
}

impl PixelTest {
    /// Adds a value of `parts` parts that count; `along` gives the direction of the amplitude from the mean.
    fn add(&mut self, values: &[([f64; 2], f64)], parts: usize, along: impl Fn([f64; 2]) -> [f64; 2]) {
        let known = |value: &&([f64; 2], f64)| value.0.iter().all(|part| part.is_finite()) && value.1 > 0.0;
        let count = values.iter().filter(known).count();
        if count < 2 {
            return;
        }
        let total = |of: fn(&([f64; 2], f64)) -> f64| values.iter().filter(known).map(of).sum::<f64>() / count as f64;
        let (mean, variance) = ([total(|v| v.0[0]), total(|v| v.0[1])], total(|v| v.1 * v.1));
        let [re, im] = along(mean);
        for value in values.iter().filter(known) {
            self.square += ((value.0[0] - mean[0]).powi(2) + (value.0[1] - mean[1]).powi(2)) / variance;
        }
        self.degrees += parts * (count - 1);
        if count < values.len() {
            return;
        }
        for (common, value) in self.common.iter_mut().zip(values) {
            let [x, y] = [value.0[0] - mean[0], value.0[1] - mean[1]];
            common[0] += (x * re + y * im) / variance;
            common[1] += (y * re - x * im) / variance;
        }
        self.weight += (re * re + im * im) / variance;
    }
}

/// Sums over some pixels.
struct Part {
    moved: Vec<bool>,
    tested: usize,
    common: Vec<[f64; 2]>,
    weight: f64,
    weighted: usize,
}

fn check(
    [width, height]: [usize; 2],
    frames: usize,
    options: &RestOptions,
    names: [&'static str; 2],
    add: impl Fn(usize, &mut PixelTest) + Sync,
) -> Result<Rest> {
    options.validate()?;
    if frames < 2 {
        return Err(Error::OutOfDomain {
            name: "frames",
            value: 1.0,
            expected: "a test of rest needs at least two frames",
        });
    }
    let limits = Limits::new(options.moved_probability);
    let sum = |start: usize| {
        let end = (width * height).min(start + PIXELS_PER_TASK);
        let nothing = || vec![[0.0; 2]; frames];
        let mut part = Part { moved: vec![false; end - start], tested: 0, common: nothing(), weight: 0.0, weighted: 0 };
        let mut known = limits.clone();
        for pixel in start..end {
            let mut test = PixelTest { square: 0.0, degrees: 0, common: nothing(), weight: 0.0 };
            add(pixel, &mut test);
            if test.degrees == 0 {
                continue;
            }
            part.tested += 1;
            part.moved[pixel - start] = test.square > known.of(test.degrees);
            if part.moved[pixel - start] || test.weight <= 0.0 {
                continue;
            }
            for (sum, own) in part.common.iter_mut().zip(&test.common) {
                *sum = [sum[0] + own[0], sum[1] + own[1]];
            }
            part.weight += test.weight;
            part.weighted += 1;
        }
        part
    };
    let starts: Vec<usize> = (0..width * height).step_by(PIXELS_PER_TASK).collect();
    let parts: Vec<Part> = starts.into_par_iter().map(sum).collect();
    let mut moved = Vec::with_capacity(width * height);
    let (mut tested, mut weight, mut weighted, mut common) = (0, 0.0, 0, vec![[0.0; 2]; frames]);
    for part in parts {
        moved.extend(part.moved);
        tested += part.tested;
        weight += part.weight;
        weighted += part.weighted;
        for (sum, own) in common.iter_mut().zip(&part.common) {
            *sum = [sum[0] + own[0], sum[1] + own[1]];
        }
    }
    let deviations =
        common.iter().map(|[a, d]| FrameDeviation { distance: d / weight, amplitude: a / weight }).collect();
    let mut rest = Rest {
        moved_pixels: moved.iter().filter(|moved| **moved).count(),
        moved: Raster::from_vec(width, height, moved)?,
        tested_pixels: tested,
        frames: deviations,
        deviation_sigma: ((1.0 - 1.0 / frames as f64) / weight).sqrt(),
        verdict: RestVerdict::SigmaUnknown,
    };
    // Of a pixel in one frame, in the unit of the deviations.
    let pixel_sigma = (weighted as f64 / weight).sqrt();
    rest.verdict = rest.judge(options, pixel_sigma, names);
    Ok(rest)
}

impl Rest {
    fn judge(&self, options: &RestOptions, pixel_sigma: f64, names: [&'static str; 2]) -> RestVerdict {
        if self.tested_pixels == 0 {
            return RestVerdict::SigmaUnknown;
        }
        let share = self.moved_pixels as f64 / self.tested_pixels as f64;
        if share > options.largest_moved_share {
            return RestVerdict::SceneMoved { share };
        }
        let mut worst = (0.0, RestVerdict::AtRest);
        for (frame, deviation) in self.frames.iter().enumerate() {
            for (value, what) in [deviation.distance, deviation.amplitude].into_iter().zip(names) {
                let sigmas = value.abs() / pixel_sigma;
                let drifts = value.abs() > SIGNIFICANT * self.deviation_sigma && sigmas > options.largest_drift_sigmas;
                if drifts && sigmas > worst.0 {
                    worst = (sigmas, RestVerdict::Drifts { frame, what, sigmas });
                }
            }
        }
        worst.1
    }
}

impl RestOptions {
    /// Refuses probabilities and shares beyond 0 to 1, and a negative drift.
    pub fn validate(&self) -> Result<()> {
        let inside = |value: f64| value > 0.0 && value < 1.0;
        for (name, value, holds) in [
            ("moved_probability", self.moved_probability, inside(self.moved_probability)),
            ("largest_moved_share", self.largest_moved_share, inside(self.largest_moved_share)),
            ("largest_drift_sigmas", self.largest_drift_sigmas, self.largest_drift_sigmas >= 0.0),
        ] {
            if !holds {
                let expected = "a share between 0 and 1, or a drift that is not negative";
                return Err(Error::OutOfDomain { name, value, expected });
            }
        }
        Ok(())
    }
}

/// Quantiles of χ² that were needed so far: a frame has few numbers of values.
#[derive(Clone)]
struct Limits {
    probability: f64,
    known: Vec<(usize, f64)>,
}

impl Limits {
    fn new(probability: f64) -> Self {
        Self { probability, known: Vec::new() }
    }

    fn of(&mut self, degrees: usize) -> f64 {
        if let Some((_, limit)) = self.known.iter().find(|(known, _)| *known == degrees) {
            return *limit;
        }
        let limit = chi_squared_upper_quantile(degrees as f64, self.probability);
        self.known.push((degrees, limit));
        limit
    }
}
