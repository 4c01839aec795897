//! Several frequencies.

use std::error::Error;
use std::f64::consts::TAU;

use phase_unwrap::{KernelDensityOptions, MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, combined_interval_m};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, Raster};

use crate::measure::report;
use crate::room::{Patches, Room};
use crate::{Outcome, Size, files};

/// Part of the combined interval that the room fills: noise must not carry the farthest wall past the end.
const FILLED: f64 = 0.85;

fn modulations(hz: &[&str]) -> Result<Vec<Modulation>, Box<dyn Error + Send + Sync>> {
    hz.iter().map(|hz| Ok(Modulation::new(hz.parse()?)?)).collect()
}

/// The room, stretched to the combined interval. Sigma of the phase grows with the square of the range, to `far_sigma` at
/// the end of the interval, and is the same at all frequencies.
pub fn write(size: Size, folder: &str, far_sigma: f64, hz: &[&str]) -> Outcome {
    let modulations = modulations(hz)?;
    let room = Room::new(1, Patches::Plain, size);
    let range = Raster::from_fn(size[0], size[1], |col, row| room.look(col, row).0);
    let far = range.as_slice().iter().copied().fold(0.0, f64::max);
    let stretch = FILLED * combined_interval_m(&modulations)? / far;
    let sigma = range.map(|range| far_sigma * (FILLED * range / far).powi(2));
    let mut rng = Pcg64::seed_from_u64(3);
    for (index, modulation) in modulations.iter().enumerate() {
        let truth = range.map(|range| modulation.phase_from_range(stretch * range));
        let noisy = Raster::from_fn(size[0], size[1], |col, row| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            truth[(col, row)] + sigma[(col, row)] * noise
        });
        let phase = noisy.map(|phase| (phase.rem_euclid(TAU) as f32).min(std::f32::consts::TAU));
        files::write(folder, &format!("phase{index}.f32"), &phase)?;
        if index == 0 {
            files::write(folder, "phase.f32", &phase)?;
            files::write(folder, "truth.f32", &truth.map(|value| *value as f32))?;
            files::write(folder, "noisy.f32", &noisy.map(|value| *value as f32))?;
        }
    }
    files::write(folder, "sigma.f32", &sigma.map(|value| *value as f32))
}

/// Writes the counts of the first frequency: each pixel by itself, with its neighbours, and with more of them.
pub fn unwrap(size: Size, folder: &str, hz: &[&str]) -> Outcome {
    let modulations = modulations(hz)?;
    let plane = |index: usize| files::read(folder, &format!("phase{index}.f32"), size);
    let phases = (0..hz.len()).map(plane).collect::<Result<Vec<_>, _>>()?;
    let sigmas = vec![files::read(folder, "sigma.f32", size)?; hz.len()];
    let near = KernelDensityOptions::default();
    let wide = KernelDensityOptions { radius: 2 };
    for (name, kernel) in [("pixels", None), ("near", Some(near)), ("wide", Some(wide))] {
        let options = MultiFrequencyOptions { kernel, ..MultiFrequencyOptions::default() };
        let mut unwrapper = MultiUnwrapper::new(&modulations, options)?;
        let mut found = MultiUnwrapped::default();
        report(name, phases[0].len(), || unwrapper.unwrap_into(&phases, Some(&sigmas), None, &mut found))?;
        files::write_counts(folder, &format!("ours_{name}.i32"), &found.wraps[0])?;
    }
    Ok(())
}
