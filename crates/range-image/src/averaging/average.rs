//! Averaging of repeated frames of a scene that stands still.

use rayon::prelude::*;

use crate::averaging::mean_flags::MeanFlags;
use crate::{ComplexChannel, ComplexFrame, Error, Flags, RangeFrame, Raster, Result};

/// Pixels that one task takes at least; smaller tasks cost more to hand out than to do.
const PIXELS_PER_TASK: usize = 4096;

/// Pixels whose sums are kept at a time, within the first-level cache.
const BLOCK: usize = 512;

/// Values that scatter by so many times their sigma are not explained by noise. A normal value does so once in two
/// million; a smaller factor flags the tails of real noise.
const BEYOND_NOISE: f64 = 5.0;

/// Number and mean of the values that a pixel had in repeated frames.
#[derive(Clone, Copy)]
struct Mean {
    count: f64,
    value: [f64; 2],
}

/// The mean is NaN if there are no values.
fn mean_of(values: impl Iterator<Item = [f64; 2]>) -> Mean {
    let (count, [first, second]) =
        values.fold((0.0, [0.0; 2]), |(count, [a, b]), [x, y]| (count + 1.0, [a + x, b + y]));
    Mean { count, value: [first / count, second / count] }
}

/// Standard deviation of a single value in each of `parts` parts that share it; NaN below two values.
fn scatter_of(values: impl Iterator<Item = [f64; 2]>, mean: Mean, parts: f64) -> f64 {
    if mean.count < 2.0 {
        return f64::NAN;
    }
    let squares: f64 = values.map(|[x, y]| (x - mean.value[0]).powi(2) + (y - mean.value[1]).powi(2)).sum();
    (squares / (parts * (mean.count - 1.0))).sqrt()
}

/// What a single frame says of itself, and [`check_rest`](crate::check_rest) of several: kept where any frame says it.
const OF_ANY: Flags = Flags::MOTION.union(Flags::INTERFERENCE);

/// Averages frames of a scene and a camera at rest: the mean of `z`, never of the phase.
///
/// Pixel by pixel and frequency by frequency, values that are NaN are left out, and so are those of frames in which the
/// pixel is saturated, unless it is in all. Sigma of the mean comes from the frames' own sigmas, `sqrt(sum sigma^2) / n`;
/// where one of them is NaN, from the scatter of the values, if there are two. The offset is averaged where all frames have
/// one.
///
/// Flags are those of the mean, not of all frames together, which would add up what chance does to each:
/// - [`Flags::NO_DATA`] where no frame has a value at some frequency;
/// - [`Flags::SATURATED`] where all values are saturated, or so many were left out that the mean of the others may be off by
///   its standard deviation: more than 1 of 4 frames, 1 of 16, 3 of 64, 10 of 1000;
/// - [`Flags::MOTION`] and [`Flags::INTERFERENCE`] where any frame has them: [`Rest::flag`](crate::Rest::flag) judges these
///   by what the values of all frames show;
/// - all others, such as [`Flags::LOW_AMPLITUDE`], where more than half of the frames that count have them.
///
/// # Errors
/// No frame, or frames of different sizes or modulations.
///
/// ```
/// use range_image::{ComplexFrame, Modulation, PhaseConvention, Raster, average};
///
/// let frame = |phase: f32| {
///     let planes = [phase, 100.0].map(|value| vec![Raster::filled(4, 3, value)]);
///     let [phase, amplitude] = planes;
///     ComplexFrame::from_phase(vec![Modulation::new(20e6)?], phase, amplitude, &PhaseConvention::default())
/// };
/// // The mean of phases about zero is zero, not pi.
/// let mean = average(&[frame(0.1)?, frame(6.183_185)?])?;
/// assert!(((mean.channels[0].phase()[(0, 0)] + 3.0).rem_euclid(6.283_185) - 3.0).abs() < 1e-5);
/// # Ok::<(), range_image::Error>(())
/// ```
pub fn average(frames: &[ComplexFrame]) -> Result<ComplexFrame> {
    require_alike(frames)?;
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "average" }) };
    let flags = MeanFlags::of(frames.iter().map(|frame| &frame.flags).collect());
    let mut channels_of_mean = Vec::with_capacity(first.channels.len());
    for index in 0..first.channels.len() {
        let channels: Vec<_> = frames.iter().map(|frame| &frame.channels[index]).collect();
        channels_of_mean.push(average_channels(&channels, &first.channels[index], &flags));
    }
    let mut out = ComplexFrame { channels: channels_of_mean, flags: together(flags) };
    for channel in &out.channels {
        flag_missing(&mut out.flags, &channel.real);
    }
    Ok(out)
}

fn average_channels(channels: &[&ComplexChannel], first: &ComplexChannel, flags: &MeanFlags<'_>) -> ComplexChannel {
    let mut out = first.clone();
    let planes = out.real.as_mut_slice().par_chunks_mut(BLOCK).zip(out.imaginary.as_mut_slice().par_chunks_mut(BLOCK));
    let planes = planes.zip(out.sigma.as_mut_slice().par_chunks_mut(BLOCK));
    planes.enumerate().for_each(|(block, ((re, im), sigma))| {
        let start = block * BLOCK;
        let mut sums = Sums::default();
        for channel in channels {
            sums.add(channel, start, re.len());
        }
        for (index, ((re, im), sigma)) in re.iter_mut().zip(im).zip(sigma).enumerate() {
            let values = || values_at(channels, start + index, |frame| flags.counts(start + index, frame));
            if flags.leaves_out(start + index) {
                sums.replace(index, values());
            }
            let count = sums.count[index];
            let value = [sums.real[index] / count, sums.imaginary[index] / count];
            (*re, *im) = (value[0] as f32, value[1] as f32);
            // A mean over nothing has no sigma: 0 / 0.
            let predicted = sums.variance[index].sqrt() / count;
            *sigma = predicted as f32;
            if predicted.is_nan() {
                let scatter = scatter_of(values().map(|(value, _)| value), Mean { count, value }, 2.0);
                *sigma = (scatter / count.sqrt()) as f32;
            }
        }
    });
    out.offset = average_offsets(channels, flags);
    out
}

/// Sums over the frames for a block of pixels, plane by plane so that the compiler can vectorise them.
struct Sums {
    count: [f64; BLOCK],
    real: [f64; BLOCK],
    imaginary: [f64; BLOCK],
    variance: [f64; BLOCK],
}

impl Default for Sums {
    fn default() -> Self {
        Self { count: [0.0; BLOCK], real: [0.0; BLOCK], imaginary: [0.0; BLOCK], variance: [0.0; BLOCK] }
    }
}

impl Sums {
    /// Adds the pixels of a channel that have a value.
    fn add(&mut self, channel: &ComplexChannel, start: usize, length: usize) {
        let [re, im, sigma] =
            [&channel.real, &channel.imaginary, &channel.sigma].map(|plane| &plane.as_slice()[start..start + length]);
        let sums = self.count.iter_mut().zip(&mut self.real).zip(&mut self.imaginary).zip(&mut self.variance);
        for ((((count, real), imaginary), variance), ((re, im), sigma)) in sums.zip(re.iter().zip(im).zip(sigma)) {
            let finite = re.is_finite() & im.is_finite();
            *count += if finite { 1.0 } else { 0.0 };
            *real += if finite { f64::from(*re) } else { 0.0 };
            *imaginary += if finite { f64::from(*im) } else { 0.0 };
            *variance += if finite { f64::from(*sigma) * f64::from(*sigma) } else { 0.0 };
        }
    }

    /// Takes other values of one pixel, each with its sigma.
    fn replace(&mut self, index: usize, values: impl Iterator<Item = ([f64; 2], f64)>) {
        let nothing = (0.0, [0.0; 2], 0.0);
        let (count, [real, imaginary], variance) = values
            .fold(nothing, |(count, [a, b], variance), ([x, y], sigma)| {
                (count + 1.0, [a + x, b + y], variance + sigma * sigma)
            });
        (self.count[index], self.real[index]) = (count, real);
        (self.imaginary[index], self.variance[index]) = (imaginary, variance);
    }
}

fn average_offsets(channels: &[&ComplexChannel], flags: &MeanFlags<'_>) -> Option<Raster<f32>> {
    let planes: Vec<&Raster<f32>> = channels.iter().map(|channel| channel.offset.as_ref()).collect::<Option<_>>()?;
    let mut out = (*planes.first()?).clone();
    let pixels = out.as_mut_slice().par_iter_mut().with_min_len(PIXELS_PER_TASK);
    pixels.enumerate().for_each(|(pixel, offset)| {
        let value = |plane: &&Raster<f32>| [f64::from(plane.as_slice()[pixel]), 0.0];
        let finite = |value: &[f64; 2]| value[0].is_finite();
        let mean = if flags.leaves_out(pixel) {
            let counting = planes.iter().enumerate().filter(|(frame, _)| flags.counts(pixel, *frame));
            mean_of(counting.map(|(_, plane)| value(plane)).filter(finite))
        } else {
            mean_of(planes.iter().map(value).filter(finite))
        };
        *offset = mean.value[0] as f32;
    });
    Some(out)
}

/// The finite values of a pixel in the frames that count, with their sigmas.
fn values_at(
    channels: &[&ComplexChannel],
    pixel: usize,
    counts: impl Fn(usize) -> bool,
) -> impl Iterator<Item = ([f64; 2], f64)> {
    let counting = channels.iter().enumerate().filter(move |(frame, _)| counts(*frame));
    counting
        .filter_map(move |(_, channel)| Some((value_at(channel, pixel)?, f64::from(channel.sigma.as_slice()[pixel]))))
}

fn value_at(channel: &ComplexChannel, pixel: usize) -> Option<[f64; 2]> {
    let (re, im) = (channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]);
    (re.is_finite() && im.is_finite()).then(|| [f64::from(re), f64::from(im)])
}

/// Standard deviation of each part of `z` of a single frame, from the scatter of repeated frames, pixel by pixel.
///
/// `sqrt(sum |z - mean|^2 / 2 (n - 1))` over the n frames with a value; NaN where there are fewer than two. With few
/// frames this is rough: its own relative standard deviation is `1 / sqrt(4 (n - 1))`.
pub fn sigma_from_repeats(frames: &[ComplexFrame], channel: usize) -> Result<Raster<f32>> {
    require_alike(frames)?;
    let name = "frames";
    match frames {
        [] => return Err(Error::NoFrames { what: "sigma from repeats" }),
        [_] => return Err(Error::OutOfDomain { name, value: 1.0, expected: "a scatter needs at least two frames" }),
        _ => {}
    }
    let channels: Option<Vec<_>> = frames.iter().map(|frame| frame.channels.get(channel)).collect();
    let Some(channels) = channels else {
        let expected = "a channel that the frames have, counted from 0";
        return Err(Error::OutOfDomain { name: "channel", value: channel as f64, expected });
    };
    let mut out = channels.first().map(|channel| channel.sigma.clone()).unwrap_or_default();
    let pixels = out.as_mut_slice().par_iter_mut().with_min_len(PIXELS_PER_TASK);
    pixels.enumerate().for_each(|(pixel, sigma)| {
        let values = || values_at(&channels, pixel, |_| true).map(|(value, _)| value);
        *sigma = scatter_of(values(), mean_of(values()), 2.0) as f32;
    });
    Ok(out)
}

/// Averages range frames of a scene and a camera at rest, for cameras that give no phase.
///
/// Pixel by pixel, values that are NaN are left out. Sigma of the mean comes from the frames' own sigmas,
/// `sqrt(sum sigma^2) / n`, and from the scatter, `s / sqrt(n)`, where one of them is NaN or where the values scatter
/// five times as much as they should. A pixel with one value keeps that frame's sigma. Saturated values are left out, and
/// flags are judged, as with [`average`].
/// Near the ends of the ambiguity interval ranges jump by U and their mean means nothing: the sigma shows it, and
/// averaging `z` avoids it.
pub fn average_ranges(frames: &[RangeFrame]) -> Result<RangeFrame> {
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "average of ranges" }) };
    for (index, frame) in frames.iter().enumerate() {
        frame.validate()?;
        if (frame.width(), frame.height()) != (first.width(), first.height()) {
            return Err(Error::Inconsistent { index, what: "the size" });
        }
    }
    let flags = MeanFlags::of(frames.iter().map(|frame| &frame.flags).collect());
    let mut out = first.clone();
    let planes = out.range.as_mut_slice().par_iter_mut().zip(out.sigma.as_mut_slice());
    let planes = planes.zip(out.amplitude.as_mut_slice()).with_min_len(PIXELS_PER_TASK);
    planes.enumerate().for_each(|(pixel, ((range, sigma), amplitude))| {
        let counting = || frames.iter().enumerate().filter(|(frame, _)| flags.counts(pixel, *frame));
        let with_value =
            || counting().map(|(_, frame)| frame).filter(|frame| frame.range.as_slice()[pixel].is_finite());
        let ranges = || with_value().map(move |frame| [f64::from(frame.range.as_slice()[pixel]), 0.0]);
        let amplitudes = with_value().map(|frame| frame.amplitude.as_slice()[pixel]).filter(|value| value.is_finite());
        let mean = mean_of(ranges());
        *range = mean.value[0] as f32;
        *amplitude = mean_of(amplitudes.map(|value| [f64::from(value), 0.0])).value[0] as f32;
        *sigma = match with_value().next() {
            Some(only) if mean.count < 2.0 => only.sigma.as_slice()[pixel],
            _ => {
                let squares = with_value().map(|frame| f64::from(frame.sigma.as_slice()[pixel]).powi(2)).sum::<f64>();
                let (predicted, scatter) = (squares.sqrt(), scatter_of(ranges(), mean, 1.0) * mean.count.sqrt());
                let own = scatter <= BEYOND_NOISE * predicted;
                (if own { predicted } else { scatter } / mean.count) as f32
            }
        };
    });
    out.flags = together(flags);
    flag_missing(&mut out.flags, &out.range);
    Ok(out)
}

pub(crate) fn require_alike(frames: &[ComplexFrame]) -> Result<()> {
    let Some(first) = frames.first() else { return Ok(()) };
    for (index, frame) in frames.iter().enumerate() {
        frame.validate()?;
        if (frame.width(), frame.height()) != (first.width(), first.height()) {
            return Err(Error::Inconsistent { index, what: "the size" });
        }
        let modulations = |frame: &ComplexFrame| frame.channels.iter().map(|c| c.modulation).collect::<Vec<_>>();
        if modulations(frame) != modulations(first) {
            return Err(Error::Inconsistent { index, what: "the set of modulation frequencies" });
        }
    }
    Ok(())
}

/// The flags of a mean but `NO_DATA`, which the result decides anew.
fn together(MeanFlags { any, most, .. }: MeanFlags<'_>) -> Raster<Flags> {
    let mut out = most;
    for (flags, any) in out.as_mut_slice().iter_mut().zip(any.as_slice()) {
        *flags |= *any & OF_ANY;
        flags.remove(Flags::NO_DATA);
    }
    out
}

fn flag_missing(flags: &mut Raster<Flags>, values: &Raster<f32>) {
    for (flags, value) in flags.as_mut_slice().iter_mut().zip(values.as_slice()) {
        if value.is_nan() {
            flags.insert(Flags::NO_DATA);
        }
    }
}
