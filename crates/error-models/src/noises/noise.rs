//! The random error of a range (Sect. 4): from the noise of the samples to metres.

use std::f64::consts::TAU;

use range_image::{Modulation, NoiseModel};

/// Standard deviation of one range in metre: `σ_ρ = U / 2π · σ_z / A` (`[Lange2000]`), valid where the amplitude
/// is well above `σ_z`.
///
/// `offset` (mean sample B, which carries the shot noise) and `amplitude` are in the unit of the samples that
/// `noise` speaks of. NaN where the noise is not known or the amplitude not positive.
pub fn range_sigma_m(
    noise: &NoiseModel,
    modulation: &Modulation,
    phase_steps: usize,
    offset: f64,
    amplitude: f64,
) -> f64 {
    if amplitude > 0.0 { sigma_times_amplitude(noise, modulation, phase_steps, offset) / amplitude } else { f64::NAN }
}

/// The amplitude at which the standard deviation of a range reaches `sigma_range_m`: a reasoned threshold for
/// [`GrossErrorOptions::low_amplitude`](crate::GrossErrorOptions::low_amplitude).
///
/// NaN where the noise is not known or `sigma_range_m` not positive.
///
/// ```
/// use error_models::range_image::Modulation;
/// use error_models::{NoiseModel, lowest_amplitude, range_sigma_m};
///
/// // Four steps at 20 MHz, samples of 500 units on average.
/// let (noise, modulation) = (NoiseModel { shot_variance_per_unit: 0.2, dark_sigma: 3.0 }, Modulation::new(20e6)?);
/// let amplitude = lowest_amplitude(&noise, &modulation, 4, 500.0, 0.02);
/// assert!((range_sigma_m(&noise, &modulation, 4, 500.0, amplitude) - 0.02).abs() < 1e-12);
/// # Ok::<(), error_models::range_image::Error>(())
/// ```
pub fn lowest_amplitude(
    noise: &NoiseModel,
    modulation: &Modulation,
    phase_steps: usize,
    offset: f64,
    sigma_range_m: f64,
) -> f64 {
    if sigma_range_m > 0.0 {
        sigma_times_amplitude(noise, modulation, phase_steps, offset) / sigma_range_m
    } else {
        f64::NAN
    }
}

/// `σ_ρ A = U / 2π · σ_z`.
fn sigma_times_amplitude(noise: &NoiseModel, modulation: &Modulation, phase_steps: usize, offset: f64) -> f64 {
    modulation.ambiguity_interval_m() / TAU * noise.sigma_z(offset, phase_steps)
}
