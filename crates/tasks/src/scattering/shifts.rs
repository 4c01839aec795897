//! What scattering does to the ranges of a background, and what is left of it after restoration.

use pipeline::{Error, Result};
use range_image::{ComplexFrame, Flags, Modulation};
use scattering_deconvolution::{EstimationOptions, ForegroundCapture, Psf, RestorationOptions, object_mask, restore};

/// Change of the background's ranges when the object comes into the scene, of one station at the first frequency.
#[derive(Debug, Clone)]
pub(crate) struct Shift {
    pub(crate) station: String,
    pub(crate) width: usize,
    /// As observed, millimetre, row by row; NaN on the object, at its rim, and where there is too little light.
    pub(crate) observed_mm: Vec<f64>,
    /// After both frames were restored.
    pub(crate) restored_mm: Vec<f64>,
}

/// Pixels whose amplitude is below this many standard deviations say nothing about the range.
const FEWEST_SIGMAS: f32 = 20.0;

pub(crate) fn shifts_of(
    station: &str,
    pair: &ForegroundCapture<'_>,
    psf: &Psf,
    options: &EstimationOptions,
) -> Result<Shift> {
    let fail = |error| Error::stage("scattering", station)(error);
    let object = object_mask(pair.with_object, pair.without_object, options).map_err(fail)?;
    let [mut with_object, mut without_object] = [pair.with_object.clone(), pair.without_object.clone()];
    let observed_mm = differences(&with_object, &without_object, object.as_slice());
    for frame in [&mut with_object, &mut without_object] {
        restore(frame, psf, &RestorationOptions::default()).map_err(fail)?;
    }
    let restored_mm = differences(&with_object, &without_object, object.as_slice());
    Ok(Shift { station: station.to_owned(), width: object.width(), observed_mm, restored_mm })
}

/// Range of the one frame less that of the other, modulo the ambiguity interval, millimetre.
fn differences(with_object: &ComplexFrame, without_object: &ComplexFrame, object: &[bool]) -> Vec<f64> {
    let (Some(a), Some(b)) = (with_object.channels.first(), without_object.channels.first()) else {
        return Vec::new();
    };
    let (re, im) =
        (a.real.as_slice().iter().zip(a.imaginary.as_slice()), b.real.as_slice().iter().zip(b.imaginary.as_slice()));
    let mut out: Vec<f64> =
        re.zip(im).map(|((ar, ai), (br, bi))| range_mm(a.modulation, [*ar, *ai], [*br, *bi])).collect();
    let flags = with_object.flags.as_slice().iter().zip(without_object.flags.as_slice());
    let untrusted = Flags::NO_DATA | Flags::SATURATED;
    for (index, (value, (one, other))) in out.iter_mut().zip(flags).enumerate() {
        let modulus = b.real.as_slice()[index].hypot(b.imaginary.as_slice()[index]);
        let dark = modulus < FEWEST_SIGMAS * b.sigma.as_slice()[index];
        if object[index] || dark || (*one | *other).intersects(untrusted) {
            *value = f64::NAN;
        }
    }
    out
}

fn range_mm(modulation: Modulation, [ar, ai]: [f32; 2], [br, bi]: [f32; 2]) -> f64 {
    let [ar, ai, br, bi] = [ar, ai, br, bi].map(f64::from);
    let angle = (ai * br - ar * bi).atan2(ar * br + ai * bi);
    1e3 * modulation.range_from_phase(angle)
}
