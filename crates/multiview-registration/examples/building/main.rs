//! A building of many rooms, registered station by station at once: what it costs and how far the poses are off.
//!
//! ```text
//! cargo run --release -p multiview-registration --example building -- STATIONS [poses|order] [first seed] [width of a frame, pixels]
//! cargo run --release -p multiview-registration --example building -- STATIONS scene > building.ron
//! ```
#![allow(clippy::print_stdout)]

mod plan;

use std::error::Error;

use multiview_registration::nalgebra::{Isometry3, Matrix6};
use multiview_registration::point_cloud::Cloud;
use multiview_registration::rigid_pose::pose_difference;
use multiview_registration::{Datum, Start, StationRegistration, StationRegistrationOptions, register_stations};
use plan::{Building, Camera};
use rayon::prelude::*;

/// How far coarse poses are off.
const OFF_M: f64 = 0.1;
const OFF_DEG: f64 = 3.0;

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |k: usize| std::env::args().nth(k);
    let count = argument(1).map_or(Ok(50), |text| text.parse::<usize>())?;
    let start = argument(2).unwrap_or_else(|| "poses".to_owned());
    let seed = argument(3).map_or(Ok(1), |text| text.parse::<u64>())?;
    let width = argument(4).map_or(Ok(160), |text| text.parse::<usize>())?;
    let camera = Camera { width, height: 3 * width / 4 };
    let building = Building::new(count, seed);
    if start == "scene" {
        print!("{}", building.description(camera));
        return Ok(());
    }
    let clouds: Vec<Cloud> = (0..count).into_par_iter().map(|station| building.cloud(station, camera, seed)).collect();
    let points: usize = clouds.iter().map(Cloud::len).sum();
    let simulated_mb = peak_memory_mb();
    let approximate = building.approximate(OFF_M, OFF_DEG, seed);
    let start = if start == "order" { Start::Order } else { Start::Poses(&approximate) };
    let before = cpu_seconds();
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, start, Datum::Station(0), &options, &|_, _| {})?;
    let seconds = cpu_seconds() - before;
    println!(
        "{count} stations, {:.1} million points: {seconds:.1} s of processor time, {:.3} s a station; at most {:.0} MB in memory, {simulated_mb:.0} MB before",
        points as f64 / 1e6,
        seconds / count as f64,
        peak_memory_mb()
    );
    report(&found, &building.stations);
    Ok(())
}

/// Errors against the truth.
fn report(found: &StationRegistration, truth: &[Isometry3<f64>]) {
    let world = truth[0] * found.world_from_station[0].inverse();
    let off: Vec<f64> = found
        .world_from_station
        .iter()
        .zip(truth)
        .map(|(pose, truth)| 1e3 * ((world * pose).translation.vector - truth.translation.vector).norm())
        .collect();
    let sigma = |covariance: &Matrix6<f64>| 1e3 * covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
    let (next, datum) = (errors(found, truth, &|k| k - 1), errors(found, truth, &|_| 0));
    println!(
        "  positions against the first station: {:.2} mm rms, {:.2} mm at most (known to {:.2} mm at least); between stations that follow each other {:.2} mm rms",
        rms(&off[1..]),
        off.iter().copied().fold(0.0, f64::max),
        found.covariance.iter().map(sigma).fold(0.0, f64::max),
        rms(&next.0)
    );
    println!(
        "  normalised squared errors (6 expected): {:.2} between stations that follow each other, {:.2} against the first; \
         sigma0 {:.3}, redundancy {}",
        mean(&next.1),
        mean(&datum.1),
        found.sigma0.unwrap_or(f64::NAN),
        found.redundancy
    );
    let mut worst: Vec<usize> = (0..truth.len()).collect();
    worst.sort_by(|&a, &b| sigma(&found.covariance[b]).total_cmp(&sigma(&found.covariance[a])));
    let words = worst.iter().take(5).map(|&k| format!("{k}: {:.1} ± {:.1} mm", off[k], sigma(&found.covariance[k])));
    println!("  least known: {}", words.collect::<Vec<_>>().join(", "));
    println!(
        "  {} pairs of surfaces, {} pairs alone, {} refused, {} loops; {} rounds{}; undetermined {}, doubtful {:?}",
        found.surfaces.len(),
        found.pairs.len(),
        found.refused.len(),
        found.loops.len(),
        found.rounds,
        if found.settled { "" } else { " (not settled)" },
        found.undetermined.len(),
        found.placements.doubtful().collect::<Vec<_>>()
    );
}

/// Errors of the positions relative to another station, millimetre, and the normalised squares of the poses.
fn errors(
    found: &StationRegistration,
    truth: &[Isometry3<f64>],
    other: &dyn Fn(usize) -> usize,
) -> (Vec<f64>, Vec<f64>) {
    let of = |k: usize| {
        let target = other(k);
        let (pose, covariance) = found.relative_pose(target, k).ok()?;
        let off = pose_difference(&pose, &(truth[target].inverse() * truth[k]));
        let square = off.dot(&covariance.cholesky()?.solve(&off));
        Some((1e3 * off.fixed_rows::<3>(0).norm(), square))
    };
    (1..truth.len()).filter_map(of).unzip()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|value| value * value).collect::<Vec<f64>>()).sqrt()
}

/// Processor time of all threads of this process, second; NaN where the system does not say.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name in brackets: the 12th and 13th word are hundredths of a second in the program and in the system.
    let words = text.rsplit(')').next().unwrap_or_default().split_whitespace();
    let ticks: Vec<f64> = words.skip(11).take(2).filter_map(|word| word.parse().ok()).collect();
    if ticks.len() == 2 { ticks.iter().sum::<f64>() / 100.0 } else { f64::NAN }
}

/// The most memory that this process has had, megabyte; 0 where the system does not say.
fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<f64>().ok()).unwrap_or(0.0) / 1e3
}
