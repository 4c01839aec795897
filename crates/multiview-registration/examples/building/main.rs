//! A building of many rooms, registered station by station at once: what it costs and how far the poses are off.
//!
//! ```text
//! cargo run --release -p multiview-registration --example building
//! cargo run --release -p multiview-registration --example building -- STATIONS [poses|scene] [seed] [width of a frame, pixels] [first..end]
//! ```
#![allow(clippy::print_stdout)]

mod plan;
mod statistic;

use std::error::Error;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use multiview_registration::nalgebra::{Isometry3, Matrix6};
use multiview_registration::point_cloud::Cloud;
use multiview_registration::rigid_pose::pose_difference;
use multiview_registration::{
    Datum, Effort, Start, StationRegistration, StationRegistrationOptions, register_stations,
};
use plan::{Building, Camera};
use rayon::prelude::*;

/// How far coarse poses are off.
const OFF_M: f64 = 0.1;
const OFF_DEG: f64 = 3.0;
/// A position that is off that of the first station or of the one before by more than this many standard deviations and by more than this
/// length is wrong, millimetre.
const WRONG_SIGMAS: f64 = 4.0;
const WRONG_MM: f64 = 5.0;

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |k: usize| std::env::args().nth(k);
    let Some(count) = argument(1) else { return statistic::run() };
    let count = count.parse::<usize>()?;
    let start = argument(2).unwrap_or_else(|| "poses".to_owned());
    let seed = argument(3).map_or(Ok(1), |text| text.parse::<u64>())?;
    let width = argument(4).map_or(Ok(160), |text| text.parse::<usize>())?;
    let camera = Camera { width, height: 3 * width / 4 };
    if start == "scene" {
        print!("{}", Building::new(count, seed).description(camera));
        return Ok(());
    }
    let part = argument(5).map(|text| part(&text)).transpose()?.unwrap_or(0..count);
    registered(count, seed, camera, part).map(|_| ())
}

/// The stations of a part of the building: what goes wrong among many shows the same way, and sooner, among those about it.
fn part(text: &str) -> Result<Range<usize>, Box<dyn Error>> {
    let (first, end) = text.split_once("..").ok_or("a part is first..end")?;
    Ok(first.parse()?..end.parse()?)
}

/// What a registration took, and how honest it is.
struct Figures {
    seconds: f64,
    most_mb: f64,
    pairs_tried: usize,
    filled_blocks: usize,
    /// Mean normalised squared error against the station before.
    squares_of_next: f64,
}

fn registered(all: usize, seed: u64, camera: Camera, part: Range<usize>) -> Result<Figures, Box<dyn Error>> {
    let building = Building::new(all, seed);
    let truth = &building.stations[part.clone()];
    let count = truth.len();
    let clouds: Vec<Cloud> =
        part.clone().into_par_iter().map(|station| building.cloud(station, camera, seed)).collect();
    let points: usize = clouds.iter().map(Cloud::len).sum();
    let simulated_mb = peak_memory_mb();
    let approximate = &building.approximate(OFF_M, OFF_DEG, seed)[part.clone()];
    let before = cpu_seconds();
    let options = StationRegistrationOptions::default();
    let (in_rounds, hundredths) = (AtomicU64::new(0), AtomicU64::new(0));
    let progress = |_, _| {
        in_rounds.fetch_max(peak_memory_mb() as u64, Ordering::Relaxed);
        hundredths.fetch_max((100.0 * (cpu_seconds() - before)) as u64, Ordering::Relaxed);
    };
    let found = register_stations(&clouds, Start::Poses(approximate), Datum::Station(0), &options, &progress)?;
    let (seconds, most_mb) = (cpu_seconds() - before, peak_memory_mb());
    println!(
        "{count} stations, {:.1} million points: {seconds:.1} s of processor time, {:.3} s a station, {:.1} s of it until the last round; at \
         most {most_mb:.0} MB in memory, {} MB until the last round, {simulated_mb:.0} MB before",
        points as f64 / 1e6,
        seconds / count as f64,
        hundredths.load(Ordering::Relaxed) as f64 / 100.0,
        in_rounds.load(Ordering::Relaxed)
    );
    report(&found, truth, part.start);
    let Effort { pairs_tried, filled_blocks } = found.effort;
    let squares_of_next = mean(&errors(&found, truth, &|k| k - 1).1);
    Ok(Figures { seconds, most_mb, pairs_tried, filled_blocks, squares_of_next })
}

/// Errors against the truth; the stations are counted from `begin`.
fn report(found: &StationRegistration, truth: &[Isometry3<f64>], begin: usize) {
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
    let words =
        worst.iter().take(5).map(|&k| format!("{}: {:.1} ± {:.1} mm", begin + k, off[k], sigma(&found.covariance[k])));
    println!("  least known: {}", words.collect::<Vec<_>>().join(", "));
    let mut times: Vec<f64> =
        found.placements.stations.iter().map(|station| station.times_usual.unwrap_or(f64::NAN)).collect();
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "  contradicted as usual times {:.2} (median), {:.2} (80 %), {:.2} (95 %), {:.2} (most)",
        at(0.5),
        at(0.8),
        at(0.95),
        at(1.0)
    );
    println!(
        "  {} pairs of stations tried, {} blocks filled; {} pairs of surfaces, {} pairs alone, {} loops; {} rounds{}; undetermined {}, doubtful {:?}",
        found.effort.pairs_tried,
        found.effort.filled_blocks,
        found.surfaces.len(),
        found.pairs.len(),
        found.loops.len(),
        found.rounds,
        if found.settled { "" } else { " (not settled)" },
        found.undetermined.len(),
        found.placements.doubtful().map(|k| begin + k).collect::<Vec<_>>()
    );
    let named = |k: usize| {
        found.placements.doubtful().any(|other| other == k) || found.undetermined.iter().any(|other| other.station == k)
    };
    let is_off =
        |other: usize, k: usize, off_mm: f64| off_mm > WRONG_MM && deviations(found, truth, other, k) > WRONG_SIGMAS;
    let wrong = (1..truth.len()).filter(|&k| {
        is_off(0, k, off[k]) || next.0.get(k - 1).is_some_and(|off_mm| !named(k - 1) && is_off(k - 1, k, *off_mm))
    });
    for k in wrong {
        println!(
            "  wrong: {}, {:.1} mm, {:.1} deviations off the first, {:.1} off the one before{}",
            begin + k,
            off[k],
            deviations(found, truth, 0, k),
            deviations(found, truth, k - 1, k),
            if named(k) { "" } else { ", and NOT named" }
        );
    }
}

/// How far a position is off that of another station, in standard deviations.
fn deviations(found: &StationRegistration, truth: &[Isometry3<f64>], other: usize, station: usize) -> f64 {
    let Ok((pose, covariance)) = found.relative_pose(other, station) else { return f64::NAN };
    let off = (truth[other].inverse() * truth[station]).translation.vector - pose.translation.vector;
    let factor = covariance.fixed_view::<3, 3>(0, 0).into_owned().cholesky();
    factor.map_or(f64::NAN, |factor| off.dot(&factor.solve(&off)).sqrt())
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
