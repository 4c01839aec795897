//! Known harmonics that fall onto the fundamental, and how to take them off again.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::rasters::polar::angle;
use crate::rasters::wide::{Separate, task_length};
use crate::{ComplexChannel, Error, HarmonicRatio, PhaseConvention, PhaseSense, Result};

/// Knots of the table over the phase: between them the correction is linear to `e N^2 3e-7` rad for an error e.
const KNOTS: usize = 4096;

/// Takes the periodic error off that known harmonics cause with N samples.
///
/// With N samples a harmonic of order `m = k N + 1` is seen as `A r exp(i (m phi + psi))`, one of order `m = k N - 1` as its
/// conjugate, both on top of the fundamental. What they do to phase and amplitude depends on the phase alone; the
/// inverse is tabulated.
///
/// This holds for light that came by one way. It is not for data whose periodic range error (d2 to d7 of Eq. 14, or a
/// spline) was calibrated without it: the error would be taken off twice. Scattering is undone first: light that is
/// scattered adds up with the sensor's own harmonics before anything can be corrected, but the error of this order is a
/// product of two small numbers, so that either order of the two will do where scattering is weak.
#[derive(Debug, Clone, PartialEq)]
pub struct AliasCorrection {
    /// What `z` is multiplied by, at equidistant observed phases; the first knot again at the end.
    factors: Vec<[f32; 2]>,
}

impl AliasCorrection {
    /// The correction for `phase_steps` samples under a convention. Orders that do not fall onto the fundamental have no
    /// influence.
    ///
    /// Fails where a ratio means nothing, and where harmonics are so strong that two phases could look the same
    /// (`sum (m + 2) r` of those that fall onto the fundamental is 1 or more).
    pub fn new(phase_steps: usize, convention: &PhaseConvention, ratios: &[HarmonicRatio]) -> Result<Self> {
        convention.validate()?;
        if phase_steps < 3 {
            let expected = "offset, amplitude and phase need at least 3 phase steps";
            return Err(Error::OutOfDomain { name: "phase_steps", value: phase_steps as f64, expected });
        }
        ratios.iter().try_for_each(validate)?;
        let images = ratios.iter().filter_map(|ratio| Image::of(ratio, phase_steps, convention));
        let images: Vec<_> = images.collect();
        let strength = images.iter().map(|image| (image.order.abs() + 2.0) * image.ratio).sum::<f64>();
        if strength >= 1.0 {
            let expected = "sum (m + 2) r below 1: stronger harmonics make the phase ambiguous";
            return Err(Error::OutOfDomain { name: "ratio", value: strength, expected });
        }
        let knots = (0..=KNOTS).map(|knot| factor(TAU * (knot % KNOTS) as f64 / KNOTS as f64, &images, convention));
        Ok(Self { factors: knots.collect() })
    }

    /// Corrects `z` in place; its sigma stays. Nothing is allocated.
    pub fn correct(&self, channel: &mut ComplexChannel) -> Result<()> {
        channel.validate()?;
        let length = task_length(channel.real.len());
        let re = channel.real.as_mut_slice().par_chunks_mut(length);
        re.zip(channel.imaginary.as_mut_slice().par_chunks_mut(length)).for_each(|(re, im)| {
            for (re, im) in re.iter_mut().zip(im) {
                let [x, y] = self.factor_at(angle::<Separate>(*re, *im));
                (*re, *im) = (*re * x - *im * y, *re * y + *im * x);
            }
        });
        Ok(())
    }

    /// Interpolated at a phase in `[0, 2 pi)`; a phase that is NaN comes with a `z` that is.
    fn factor_at(&self, phase: f32) -> [f32; 2] {
        let position = phase * (KNOTS as f32 / std::f32::consts::TAU);
        let knot = (position as usize).min(KNOTS - 1);
        let within = position - knot as f32;
        match self.factors.get(knot..knot + 2) {
            Some([a, b]) => [a[0] + within * (b[0] - a[0]), a[1] + within * (b[1] - a[1])],
            _ => [1.0, 0.0],
        }
    }
}

fn validate(ratio: &HarmonicRatio) -> Result<()> {
    let require = |name, value: f64, good: bool, expected| {
        if good { Ok(()) } else { Err(Error::OutOfDomain { name, value, expected }) }
    };
    require("order", ratio.order as f64, ratio.order >= 2, "harmonics have orders from 2 on")?;
    let good = ratio.ratio >= 0.0 && ratio.ratio.is_finite();
    require("ratio", ratio.ratio, good, "a ratio of amplitudes, finite and not negative")?;
    require("phase_rad", ratio.phase_rad, ratio.phase_rad.is_finite(), "a phase is finite")
}

/// `r exp(i (order phi + psi))` beside `exp(i phi)`, phi being the camera's phase; the order of a conjugate is negative.
struct Image {
    order: f64,
    ratio: f64,
    phase: f64,
}

impl Image {
    /// `None` where the harmonic does not fall onto the fundamental.
    fn of(ratio: &HarmonicRatio, steps: usize, convention: &PhaseConvention) -> Option<Self> {
        // In the opposite sense the phase of the harmonic changes its sign too.
        let phase = match convention.phase_sense {
            PhaseSense::Positive => ratio.phase_rad,
            PhaseSense::Negative => -ratio.phase_rad,
        };
        let sign = match ratio.order % steps {
            1 => 1.0,
            rest if rest == steps - 1 => -1.0,
            _ => return None,
        };
        Some(Self { order: sign * ratio.order as f64, ratio: ratio.ratio, phase: sign * phase })
    }
}

/// What `z` has to be multiplied by where its phase, in the convention, is `observed`.
fn factor(observed: f64, images: &[Image], convention: &PhaseConvention) -> [f32; 2] {
    let sign = match convention.phase_sense {
        PhaseSense::Positive => 1.0,
        PhaseSense::Negative => -1.0,
    };
    let seen = sign * (observed - convention.phase_offset_rad);
    let (mut phase, mut gain) = (seen, 1.0);
    // The error of the phase changes by less than the phase itself: each round brings it nearer, the last to rounding.
    for _ in 0..200 {
        let (turn, size) = disturbance(phase, images);
        let next = seen - turn;
        let change = (next - phase).abs();
        (phase, gain) = (next, size);
        if change < 1e-15 {
            break;
        }
    }
    let (sin, cos) = (sign * (phase - seen)).sin_cos();
    [(cos / gain) as f32, (sin / gain) as f32]
}

/// Turn and gain of `1 + sum r exp(i ((order - 1) phi + psi))`.
fn disturbance(phase: f64, images: &[Image]) -> (f64, f64) {
    let (mut re, mut im) = (1.0, 0.0);
    for image in images {
        let (sin, cos) = ((image.order - 1.0) * phase + image.phase).sin_cos();
        re += image.ratio * cos;
        im += image.ratio * sin;
    }
    (im.atan2(re), re.hypot(im))
}
