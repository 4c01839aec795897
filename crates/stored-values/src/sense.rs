//! Whether the phase grows with range, told by the amplitudes.
//!
//! On a smooth surface the light that comes back falls with the square of the range, and more where the surface turns
//! away; a phase that runs the wrong way makes far what is near, and the amplitude rises with "range". The sense is
//! judged in windows of the image, from the slopes of phase and of the logarithm of amplitude along the surface, so that
//! whole ambiguity intervals and the brightness of surfaces do not matter. A window votes only where the phase changes by
//! much; a wall seen from the front casts none, and nothing is said.

use std::f64::consts::TAU;

use range_image::{ComplexChannel, ComplexFrame, Flags};

/// Windows in the shorter direction of the image.
const WINDOWS: usize = 12;
/// Pixels of a window in one direction, at least.
const SMALLEST_PX: usize = 6;
/// Samples of a window in one direction, at most.
const SAMPLES: usize = 10;
/// Part of a window's samples that must have a phase.
const USABLE: f64 = 0.8;
/// Radian by which the phase must change across a window: 3 % of the interval, several times what scattered light and
/// errors that go with amplitude do to it.
const CHANGE_RAD: f64 = 0.03 * TAU;
/// What the phase may deviate from a plane across the window, as a part of its change: edges deviate more.
const ROUGHNESS: f64 = 0.12;
/// Standard deviations of a fair coin by which windows must vote for the wrong sense: a probability of 1e-6 by chance.
const SIGMAS: f64 = 4.75;
/// Part of the windows that must vote for it: windows on one patterned surface do not vote independently.
const MAJORITY: f64 = 2.0 / 3.0;

/// Windows by what the amplitude does with range.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SenseVotes {
    /// It falls, as it should.
    falls: usize,
    /// It rises.
    rises: usize,
}

impl SenseVotes {
    /// The windows in which it falls, and in which it rises: to be added to those of other frames.
    pub fn windows(&mut self) -> [&mut usize; 2] {
        [&mut self.falls, &mut self.rises]
    }

    /// Lets the windows of a frame vote, by its lowest frequency.
    pub fn look_at(&mut self, frame: &ComplexFrame) {
        let lowest = frame.channels.iter().min_by(|a, b| {
            let [a, b] = [a, b].map(|channel| channel.modulation.frequency_hz());
            a.total_cmp(&b)
        });
        let Some(channel) = lowest else { return };
        let (width, height) = (frame.width(), frame.height());
        let side = (width.min(height) / WINDOWS).max(SMALLEST_PX);
        for row in 0..height / side {
            for col in 0..width / side {
                match falls(frame, channel, [col * side, row * side], side) {
                    Some(true) => self.falls += 1,
                    Some(false) => self.rises += 1,
                    None => {}
                }
            }
        }
    }

    /// How they voted; `None` where no window could.
    pub fn in_words(&self) -> Option<String> {
        let all = self.falls + self.rises;
        let seen = || format!("amplitudes fall with range on {} of {all} pieces of surface", self.falls);
        let sure = |votes: usize| votes as f64 - 0.5 * all as f64 > SIGMAS * 0.5 * (all as f64).sqrt();
        let verdict = if sure(self.falls) {
            "grows with range"
        } else if self.reversed().is_some() {
            "falls with range"
        } else {
            "whether it grows with range cannot be told"
        };
        (all > 0).then(|| format!("{verdict}: {}", seen()))
    }

    /// In words what speaks for the wrong sense, where the votes are sure of it at one in a million.
    pub fn reversed(&self) -> Option<String> {
        let (rises, all) = (self.rises as f64, (self.falls + self.rises) as f64);
        let reversed = rises - 0.5 * all > SIGMAS * 0.5 * all.sqrt() && rises > MAJORITY * all;
        reversed.then(|| {
            format!(
                "amplitudes rise with range on {} of {} pieces of surface, where light falls with the square of the range",
                self.rises,
                self.falls + self.rises
            )
        })
    }
}

/// Whether the amplitude falls along the phase in a window; `None` where it shows no slanted smooth surface.
fn falls(frame: &ComplexFrame, channel: &ComplexChannel, corner: [usize; 2], side: usize) -> Option<bool> {
    let step = side.div_ceil(SAMPLES).max(1);
    let places = (0..side).step_by(step).flat_map(|row| (0..side).step_by(step).map(move |col| [col, row]));
    let unusable = Flags::NO_DATA | Flags::SATURATED | Flags::LOW_AMPLITUDE | Flags::MOTION;
    let (mut samples, mut asked, mut mean) = (Vec::with_capacity(SAMPLES * SAMPLES), 0_usize, [0.0; 2]);
    for [col, row] in places {
        asked += 1;
        let index = (corner[1] + row) * frame.width() + corner[0] + col;
        let at = |plane: &[f32]| f64::from(plane[index]);
        let (re, im) = (at(channel.real.as_slice()), at(channel.imaginary.as_slice()));
        let (amplitude, sigma) = (re.hypot(im), at(channel.sigma.as_slice()));
        let lit = amplitude > 0.0;
        if frame.flags.as_slice()[index].intersects(unusable) || !lit || amplitude < 5.0 * sigma {
            continue;
        }
        mean = [mean[0] + re / amplitude, mean[1] + im / amplitude];
        let noise = if sigma > 0.0 { sigma / amplitude } else { 0.0 };
        samples.push(Sample { place: [col as f64, row as f64], re, im, log: amplitude.ln(), noise });
    }
    if (samples.len() as f64) < USABLE * asked as f64 || samples.len() < 9 {
        return None;
    }
    // Phases next to that of the mean: no interval is crossed on a smooth surface.
    let angle =
        |sample: &Sample| (sample.im * mean[0] - sample.re * mean[1]).atan2(sample.re * mean[0] + sample.im * mean[1]);
    let (phase, rest) = slope(&samples, angle)?;
    let change = phase[0].hypot(phase[1]) * side as f64;
    let noise = samples.iter().map(|sample| sample.noise.powi(2)).sum::<f64>() / samples.len() as f64;
    if change < CHANGE_RAD || (rest - noise).max(0.0).sqrt() > ROUGHNESS * change {
        return None;
    }
    let (brightness, _) = slope(&samples, |sample| sample.log)?;
    Some(phase[0] * brightness[0] + phase[1] * brightness[1] < 0.0)
}

/// One pixel of a window.
struct Sample {
    place: [f64; 2],
    re: f64,
    im: f64,
    log: f64,
    /// Standard deviation of the phase, radian; zero where it is not known.
    noise: f64,
}

/// Slope along columns and rows of the plane that fits best, and the mean square of what is left.
fn slope(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Option<([f64; 2], f64)> {
    let count = samples.len() as f64;
    let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / count;
    let (x0, y0, v0) = (mean(&|s| s.place[0]), mean(&|s| s.place[1]), mean(&|s| value(s)));
    let [mut xx, mut xy, mut yy, mut xv, mut yv, mut vv] = [0.0; 6];
    for sample in samples {
        let (x, y, v) = (sample.place[0] - x0, sample.place[1] - y0, value(sample) - v0);
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        (xv, yv, vv) = (xv + x * v, yv + y * v, vv + v * v);
    }
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-9 * xx * yy || xx <= 0.0 {
        return None;
    }
    let slope = [(yy * xv - xy * yv) / determinant, (xx * yv - xy * xv) / determinant];
    Some((slope, (vv - slope[0] * xv - slope[1] * yv).max(0.0) / (count - 3.0)))
}
