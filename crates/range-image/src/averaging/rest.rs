//! Whether repeated frames show a scene and a camera at rest, before they are averaged.

use rayon::prelude::*;
use statistics::{bonferroni, chi_squared_limit};

use crate::averaging::average::require_alike;
use crate::averaging::mean_flags::MeanFlags;
use crate::averaging::rest_pixel::PixelTest;

use crate::{ComplexFrame, Error, Flags, RangeFrame, Raster, Result};

/// Pixels that one task takes; its sums are added in the order of the pixels.
const PIXELS_PER_TASK: usize = 4096;

/// Frames' common deviations that are less significant than this are chance. In standard deviations: by chance one
/// frame in two million.
const SIGNIFICANT: f64 = 5.0;

/// A frame that deviates and moves the mean by fewer of the mean's standard deviations is let pass: the rare large noise of
/// real sensors would flag a pixel in one of thousands of frames otherwise.
const LEAST_BIAS: f64 = 0.5;

/// When repeated frames count as at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct RestOptions {
    /// Probability with which noise alone makes a pixel count as moved. Default: 1e-4.
    pub moved_probability: f64,
    /// Largest share of pixels that may have moved. Default: 0.5.
    pub largest_moved_share: f64,
    /// Largest deviation that all pixels of a frame may have in common, in standard deviations of a pixel in one frame.
    /// Default: 0.2.
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
    /// Pixels whose values scatter more than their sigma says, or that one frame shows elsewhere.
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
    /// What more than half of the frames say of the samples of a pixel; `None` where it could not be tested.
    samples: Vec<Option<Flags>>,
}

/// What the samples of a single frame show.
const OF_SAMPLES: Flags = Flags::MOTION.union(Flags::INTERFERENCE);

impl Rest {
    /// Flags pixels that moved in a mean of the frames: with [`Flags::INTERFERENCE`] where that flag is there already, else
    /// with [`Flags::MOTION`].
    ///
    /// These two flags go from tested pixels that did not move, unless more than half of the frames have them: what the
    /// samples of a single frame contradict each other by does not reach its value, and noise alone does so in some frame
    /// if there are enough.
    pub fn flag(&self, flags: &mut Raster<Flags>) {
        let tests = self.moved.as_slice().iter().zip(&self.samples);
        for (flags, (moved, samples)) in flags.as_mut_slice().iter_mut().zip(tests) {
            let Some(samples) = samples else { continue };
            let reason = if flags.contains(Flags::INTERFERENCE) { Flags::INTERFERENCE } else { Flags::MOTION };
            flags.remove(OF_SAMPLES);
            flags.insert(*samples);
            flags.set(reason, *moved || samples.contains(reason));
        }
    }
}

/// Tests complex images in units of their sigma: each pixel by `Σ |z − mean|² / σ²`, which is χ² with `2 (n − 1)` degrees
/// of freedom for each frequency; from three frames on also by the frame that deviates most, which is χ² with 2 degrees of
/// freedom for each frequency, n times; and each frame by the phase and the amplitude that all pixels have in common.
///
/// The first test is for what moves all the time, the second for what comes and goes again: of many frames a single one
/// adds less to the sum than chance does. Each of the two has half of `moved_probability`, whatever the number of frames. A
/// single frame that moves the mean by less than half of its standard deviation does no harm and is let pass.
///
/// Pixels without a value or a sigma in two frames are not tested. Saturated values do not count where there are others.
pub fn check_rest(frames: &[ComplexFrame], options: &RestOptions) -> Result<Rest> {
    require_alike(frames)?;
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "test of rest" }) };
    let flags = MeanFlags::of(frames.iter().map(|frame| &frame.flags).collect());
    check(&flags, frames.len(), options, ["phase", "amplitude"], |pixel, test| {
        for index in 0..first.channels.len() {
            let values = frames.iter().map(|frame| {
                let channel = &frame.channels[index];
                let parts = [channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]];
                (parts.map(f64::from), f64::from(channel.sigma.as_slice()[pixel]))
            });
            test.add(values, |frame| flags.counts(pixel, frame), 2, |mean| mean);
        }
    })
}

/// Tests range frames in the same way, with `n − 1` degrees of freedom, and one for a single frame.
pub fn check_rest_of_ranges(frames: &[RangeFrame], options: &RestOptions) -> Result<Rest> {
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "test of rest" }) };
    for (index, frame) in frames.iter().enumerate() {
        frame.validate()?;
        if (frame.width(), frame.height()) != (first.width(), first.height()) {
            return Err(Error::Inconsistent { index, what: "the size" });
        }
    }
    let flags = MeanFlags::of(frames.iter().map(|frame| &frame.flags).collect());
    check(&flags, frames.len(), options, ["range", "amplitude"], |pixel, test| {
        let values = frames.iter().map(|frame| {
            let range = f64::from(frame.range.as_slice()[pixel]);
            ([0.0, range], f64::from(frame.sigma.as_slice()[pixel]))
        });
        // What ranges have in common is counted in metre, not relative to them.
        test.add(values, |frame| flags.counts(pixel, frame), 1, |_| [1.0, 0.0]);
    })
}

/// Sums over some pixels.
struct Part {
    moved: Vec<bool>,
    samples: Vec<Option<Flags>>,
    tested: usize,
    common: Vec<[f64; 2]>,
    weight: f64,
    weighted: usize,
}

fn check(
    flags: &MeanFlags<'_>,
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
    let (width, height) = (flags.most.width(), flags.most.height());
    let limits = Limits::new(options.moved_probability);
    let sum = |start: usize| {
        let end = (width * height).min(start + PIXELS_PER_TASK);
        let (moved, samples) = (vec![false; end - start], vec![None; end - start]);
        let mut part = Part { moved, samples, tested: 0, common: vec![[0.0; 2]; frames], weight: 0.0, weighted: 0 };
        let mut known = limits.clone();
        let mut test = PixelTest::new(frames);
        for pixel in start..end {
            test.clear();
            add(pixel, &mut test);
            if test.degrees == 0 {
                continue;
            }
            part.tested += 1;
            part.samples[pixel - start] = Some(flags.most.as_slice()[pixel] & OF_SAMPLES);
            part.moved[pixel - start] = known.are_exceeded(&test);
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
    let (mut moved, mut samples) = (Vec::with_capacity(width * height), Vec::with_capacity(width * height));
    let (mut tested, mut weight, mut weighted, mut common) = (0, 0.0, 0, vec![[0.0; 2]; frames]);
    for part in parts {
        moved.extend(part.moved);
        samples.extend(part.samples);
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
        samples,
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
    /// Degrees of freedom and values of a pixel, with the limits of their sum and of the largest.
    known: Vec<([usize; 2], [f64; 2])>,
}

impl Limits {
    fn new(probability: f64) -> Self {
        Self { probability, known: Vec::new() }
    }

    fn are_exceeded(&mut self, test: &PixelTest) -> bool {
        let [sum, largest] = self.of(test.degrees, test.values);
        test.square > sum || test.largest() > largest
    }

    fn of(&mut self, degrees: usize, values: usize) -> [f64; 2] {
        if let Some((_, limits)) = self.known.iter().find(|(known, _)| *known == [degrees, values]) {
            return *limits;
        }
        let limits = if values < 3 {
            // Two values deviate from their mean alike.
            [chi_squared_limit(degrees as f64, self.probability), f64::INFINITY]
        } else {
            let (half, count) = (self.probability / 2.0, values as f64);
            let largest = chi_squared_limit(degrees as f64 / (count - 1.0), bonferroni(half, values));
            [chi_squared_limit(degrees as f64, half), largest.max(LEAST_BIAS * LEAST_BIAS * count)]
        };
        self.known.push(([degrees, values], limits));
        limits
    }
}
