//! Several frequencies.

use std::error::Error;
use std::f64::consts::TAU;

use phase_unwrap::{MultiFrequencyOptions, combined_interval_m, unwrap_multi_frequency};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, Raster};

use crate::measure::report;
use crate::room::{Patches, Room};
use crate::{Outcome, Size, files};

/// Part of the combined interval that the room fills: noise must not carry the farthest wall past the end.
const FILLED: f64 = 0.95;

fn modulations(hz: &[&str]) -> Result<Vec<Modulation>, Box<dyn Error>> {
    hz.iter().map(|hz| Ok(Modulation::new(hz.parse()?)?)).collect()
}

/// The room, stretched to the combined interval. Sigma of the phase grows with the square of the range, to `far_sigma` at
/// the farthest point, and is the same at all frequencies.
pub fn write(size: Size, folder: &str, far_sigma: f64, hz: &[&str]) -> Outcome {
    let modulations = modulations(hz)?;
    let room = Room::new(1, Patches::Plain, size);
    let range = Raster::from_fn(size[0], size[1], |col, row| room.look(col, row).0);
    let far = range.as_slice().iter().copied().fold(0.0, f64::max);
    let stretch = FILLED * combined_interval_m(&modulations)? / far;
    let sigma = range.map(|range| far_sigma * (range / far).powi(2));
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

/// Writes the counts of the first frequency.
pub fn unwrap(size: Size, folder: &str, hz: &[&str]) -> Outcome {
    let modulations = modulations(hz)?;
    let plane = |index: usize| files::read(folder, &format!("phase{index}.f32"), size);
    let phases = (0..hz.len()).map(plane).collect::<Result<Vec<_>, _>>()?;
    let sigmas = vec![files::read(folder, "sigma.f32", size)?; hz.len()];
    let options = MultiFrequencyOptions::default();
    let work = || unwrap_multi_frequency(&phases, &modulations, Some(&sigmas), None, &options);
    let found = report("pixels", phases[0].len(), work)?;
    files::write_counts(folder, "ours_pixels.i32", &found.wraps[0])
}
