//! Averaging of repeated frames of a scene that stands still.

use crate::{ComplexChannel, ComplexFrame, Error, Flags, RangeFrame, Raster, Result};

/// Sums over repeated values of one pixel, by Welford's recursion: steady where the mean is large against the scatter.
#[derive(Debug, Clone, Copy, Default)]
struct Repeats {
    count: f64,
    mean: [f64; 2],
    squares: f64,
}

impl Repeats {
    fn add(&mut self, value: [f64; 2]) {
        self.count += 1.0;
        for (mean, value) in self.mean.iter_mut().zip(value) {
            let before = value - *mean;
            *mean += before / self.count;
            self.squares += before * (value - *mean);
        }
    }

    /// Mean, NaN without values.
    fn mean(&self) -> [f64; 2] {
        if self.count > 0.0 { self.mean } else { [f64::NAN; 2] }
    }

    /// Standard deviation of a single value per part, from `parts` parts that share it; NaN below two values.
    fn sigma(&self, parts: f64) -> f64 {
        if self.count < 2.0 { f64::NAN } else { (self.squares / (parts * (self.count - 1.0))).sqrt() }
    }
}

/// Averages frames of a scene and a camera at rest: the mean of `z`, never of the phase.
///
/// Pixel by pixel and frequency by frequency, values that are NaN are left out. Sigma of the mean comes from the
/// frames' own sigmas, `sqrt(sum sigma^2) / n`; where one of them is NaN, from the scatter of the values, if there are
/// two. Flags are those of all frames together; [`Flags::NO_DATA`] stays only where no frame has a value at some
/// frequency. The offset is averaged where all frames have one.
pub fn average(frames: &[ComplexFrame]) -> Result<ComplexFrame> {
    require_alike(frames)?;
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "average" }) };
    let planes: Vec<_> = frames.iter().map(|frame| &frame.flags).collect();
    let mut out = ComplexFrame { channels: Vec::with_capacity(first.channels.len()), flags: union(&planes) };
    for index in 0..first.channels.len() {
        let channels: Vec<_> = frames.iter().map(|frame| &frame.channels[index]).collect();
        let mean = average_channels(&channels, &first.channels[index]);
        flag_missing(&mut out.flags, &mean.real);
        out.channels.push(mean);
    }
    Ok(out)
}

fn average_channels(channels: &[&ComplexChannel], first: &ComplexChannel) -> ComplexChannel {
    let mut out = first.clone();
    let mut offsets: Option<Vec<&[f32]>> = channels.iter().map(|c| c.offset.as_ref().map(Raster::as_slice)).collect();
    if offsets.is_none() {
        out.offset = None;
    }
    for pixel in 0..first.real.len() {
        let repeats = repeats_of(channels, pixel);
        let [re, im] = repeats.mean();
        out.real.as_mut_slice()[pixel] = re as f32;
        out.imaginary.as_mut_slice()[pixel] = im as f32;
        out.sigma.as_mut_slice()[pixel] = sigma_of_mean(channels, pixel, &repeats) as f32;
        if let (Some(planes), Some(offset)) = (&mut offsets, &mut out.offset) {
            let mut values = Repeats::default();
            planes
                .iter()
                .map(|plane| plane[pixel])
                .filter(|b| b.is_finite())
                .for_each(|b| values.add([f64::from(b), 0.0]));
            offset.as_mut_slice()[pixel] = values.mean()[0] as f32;
        }
    }
    out
}

fn repeats_of(channels: &[&ComplexChannel], pixel: usize) -> Repeats {
    let mut repeats = Repeats::default();
    for channel in channels {
        if let Some(value) = value_at(channel, pixel) {
            repeats.add(value);
        }
    }
    repeats
}

fn value_at(channel: &ComplexChannel, pixel: usize) -> Option<[f64; 2]> {
    let (re, im) = (channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]);
    (re.is_finite() && im.is_finite()).then(|| [f64::from(re), f64::from(im)])
}

fn sigma_of_mean(channels: &[&ComplexChannel], pixel: usize, repeats: &Repeats) -> f64 {
    let variance: f64 = channels
        .iter()
        .filter(|channel| value_at(channel, pixel).is_some())
        .map(|channel| f64::from(channel.sigma.as_slice()[pixel]).powi(2))
        .sum();
    // A mean over nothing has no sigma: 0 / 0.
    let predicted = variance.sqrt() / repeats.count;
    if predicted.is_nan() { repeats.sigma(2.0) / repeats.count.sqrt() } else { predicted }
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
    let values = (0..frames[0].flags.len()).map(|pixel| repeats_of(&channels, pixel).sigma(2.0) as f32);
    Raster::from_vec(frames[0].width(), frames[0].height(), values.collect())
}

/// Averages range frames of a scene and a camera at rest, for cameras that give no phase.
///
/// Pixel by pixel, values that are NaN are left out. Sigma of the mean comes from the scatter, `s / sqrt(n)`; a pixel
/// with one value keeps that frame's sigma. Flags are as with [`average`]. Near the ends of the ambiguity interval
/// ranges jump by U and their mean means nothing: the sigma shows it, and averaging `z` avoids it.
pub fn average_ranges(frames: &[RangeFrame]) -> Result<RangeFrame> {
    let Some(first) = frames.first() else { return Err(Error::NoFrames { what: "average of ranges" }) };
    for (index, frame) in frames.iter().enumerate() {
        frame.validate()?;
        if (frame.width(), frame.height()) != (first.width(), first.height()) {
            return Err(Error::Inconsistent { index, what: "the size" });
        }
    }
    let planes: Vec<_> = frames.iter().map(|frame| &frame.flags).collect();
    let mut out = RangeFrame { flags: union(&planes), ..first.clone() };
    for pixel in 0..first.range.len() {
        let (mut range, mut amplitude, mut sigma) = (Repeats::default(), Repeats::default(), f32::NAN);
        for frame in frames.iter().filter(|frame| frame.range.as_slice()[pixel].is_finite()) {
            range.add([f64::from(frame.range.as_slice()[pixel]), 0.0]);
            sigma = frame.sigma.as_slice()[pixel];
            let value = frame.amplitude.as_slice()[pixel];
            if value.is_finite() {
                amplitude.add([f64::from(value), 0.0]);
            }
        }
        out.range.as_mut_slice()[pixel] = range.mean()[0] as f32;
        out.amplitude.as_mut_slice()[pixel] = amplitude.mean()[0] as f32;
        let scatter = (range.sigma(1.0) / range.count.sqrt()) as f32;
        out.sigma.as_mut_slice()[pixel] = if range.count < 2.0 { sigma } else { scatter };
    }
    flag_missing(&mut out.flags, &out.range);
    Ok(out)
}

fn require_alike(frames: &[ComplexFrame]) -> Result<()> {
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

/// All flags that any plane carries, but `NO_DATA`, which the result decides anew.
fn union(planes: &[&Raster<Flags>]) -> Raster<Flags> {
    let mut out = planes[0].clone();
    for plane in planes {
        for (all, flags) in out.as_mut_slice().iter_mut().zip(plane.as_slice()) {
            *all |= *flags;
        }
    }
    out.as_mut_slice().iter_mut().for_each(|flags| flags.remove(Flags::NO_DATA));
    out
}

fn flag_missing(flags: &mut Raster<Flags>, values: &Raster<f32>) {
    for (flags, value) in flags.as_mut_slice().iter_mut().zip(values.as_slice()) {
        if value.is_nan() {
            flags.insert(Flags::NO_DATA);
        }
    }
}
