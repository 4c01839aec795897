//! What a simulated survey holds, station by station: how far the raw ranges are off, how much lies beyond the ambiguity
//! interval, how noisy and how mixed it is, and how much of each station's view the next one shares.
//!
//! `cargo run -p simulation --example survey_figures -- fixtures/scenes/room.ron`
#![allow(clippy::print_stdout)]

use std::error::Error;

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use range_image::{ComplexFrame, Flags, average, demodulate};
use simulation::{FrameTruth, SimulatedFrame, SimulationSpec, Simulator};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "fixtures/scenes/room_small.ron".into());
    let spec = SimulationSpec::from_ron(&std::fs::read_to_string(&path)?)?;
    let simulator = Simulator::new(&spec)?;
    let mut truths = Vec::new();
    println!("station  raw error mm   beyond U  sigma mm     mixed  saturated  darkest  brightest");
    println!("         median    95%            median 95%                      5 %");
    for (index, station) in spec.stations.iter().enumerate() {
        let image = simulator.station(index)?;
        let frames: Vec<SimulatedFrame> = (0..spec.exposure.frames_per_station)
            .map(|frame| simulator.frame(&image, frame, 1))
            .collect::<Result<_, _>>()?;
        let options = spec.demodulation_options();
        let complex: Vec<ComplexFrame> =
            frames.iter().map(|frame| demodulate(&frame.raw, &options)).collect::<Result<_, _>>()?;
        let truth = frames[0].truth.clone();
        print_station(&station.name, &average(&complex)?, &truth);
        truths.push(truth);
    }
    println!("\nview shared with the next station");
    for (index, truth) in truths.iter().enumerate() {
        let next = &truths[(index + 1) % truths.len()];
        println!("{:8} {:.2}", spec.stations[index].name, overlap(&spec.camera.geometry, truth, next));
    }
    Ok(())
}

fn print_station(name: &str, frame: &ComplexFrame, truth: &FrameTruth) {
    let channel = &frame.channels[0];
    let interval = channel.modulation.ambiguity_interval_m();
    let (phase, sigma) = (channel.phase(), channel.sigma_phase());
    let seen: Vec<usize> = (0..truth.range.len()).filter(|i| truth.range.as_slice()[*i].is_finite()).collect();
    let error = |i: usize| {
        let shown = channel.modulation.range_from_phase(f64::from(phase.as_slice()[i]));
        let off = (shown - f64::from(truth.range.as_slice()[i])).rem_euclid(interval);
        1e3 * off.min(interval - off)
    };
    let errors = sorted(seen.iter().map(|i| error(*i)));
    let sigmas =
        sorted(seen.iter().map(|i| 1e3 * channel.modulation.range_from_phase(f64::from(sigma.as_slice()[*i]))));
    let amplitudes = sorted(seen.iter().map(|i| f64::from(truth.amplitude[0].as_slice()[*i])));
    let share = |count: usize| count as f64 / truth.range.len() as f64;
    let beyond = seen.iter().filter(|i| f64::from(truth.range.as_slice()[**i]) > interval).count();
    let mixed = truth.mixed.as_slice().iter().filter(|mixed| **mixed).count();
    let saturated = frame.flags.as_slice().iter().filter(|flags| flags.contains(Flags::SATURATED)).count();
    println!(
        "{name:8} {:6.1} {:7.1} {:9.3} {:8.2} {:5.1} {:8.3} {:9.4} {:8.1} {:8.0}",
        at(&errors, 0.5),
        at(&errors, 0.95),
        share(beyond),
        at(&sigmas, 0.5),
        at(&sigmas, 0.95),
        share(mixed),
        share(saturated),
        at(&amplitudes, 0.05),
        at(&amplitudes, 1.0),
    );
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn at(sorted: &[f64], fraction: f64) -> f64 {
    sorted.get(((sorted.len().max(1) - 1) as f64 * fraction).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Share of the pixels of one station whose points the other one sees too, at the same place within 5 cm.
fn overlap(camera: &Camera, from: &FrameTruth, to: &FrameTruth) -> f64 {
    let to_from_world: Isometry3<f64> = to.world_from_camera.inverse();
    let (width, height) = (from.range.width(), from.range.height());
    let shared = |i: usize| {
        let range = f64::from(from.range.as_slice()[i]);
        let pixel = [(i % width) as f64, (i / width) as f64];
        let point: Point3<f64> = to_from_world * (from.world_from_camera * camera.point(pixel, range));
        let Ok([col, row]) = camera.project(&point) else { return false };
        let seen = col > -0.5 && row > -0.5;
        let place = (col.round() as usize, row.round() as usize);
        let there = to.range.get(place.0, place.1).map_or(f64::NAN, |range| f64::from(*range));
        // A pixel of an edge may show the other side of it; 5 cm and a pixel of slope are allowed for.
        seen && (there - point.coords.norm()).abs() < 0.05 + 0.02 * there
    };
    (0..width * height).filter(|i| shared(*i)).count() as f64 / (width * height) as f64
}
