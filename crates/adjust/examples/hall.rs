//! Self-calibration of a range camera in a large network: times the solution, the covariances of all blocks and the
//! redundancy numbers of all observed values. `hall small` takes the laboratory's network instead.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use adjust::{Scale, SolveOptions};
use range_camera::{HALL, LABORATORY, range_camera_network};

#[allow(dead_code)]
#[path = "../tests/common/range_camera.rs"]
mod range_camera;

/// CPU seconds of this thread (Linux).
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).map_or(f64::NAN, |ns| ns * 1e-9)
}

fn main() {
    // One thread, so that its CPU time is all there is.
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run);
}

fn run() {
    let plan = if std::env::args().nth(1).is_some_and(|word| word == "small") { LABORATORY } else { HALL };
    let network = range_camera_network(&plan).free();
    // Small problems are repeated: the clock of the CPU is coarse.
    let repetitions = if plan.stations == LABORATORY.stations { 100 } else { 1 };
    let solve = || network.adjustment.solve(&SolveOptions::default()).unwrap();
    let blocks = || network.stations.iter().chain(&network.targets).chain([&network.parameters]);
    // The first run warms the caches.
    let solution = solve();
    let (mut times, mut trace, mut sum) = ([0.0; 3], 0.0, 0.0);
    for _ in 0..repetitions {
        let start = cpu();
        let solution = solve();
        let solved = cpu();
        trace = blocks().map(|&block| solution.covariance(block, Scale::Prior).unwrap().trace()).sum();
        let covariances = cpu();
        sum = solution.redundancy_numbers().iter().sum();
        let numbers = cpu();
        for (time, (end, start)) in
            times.iter_mut().zip([(solved, start), (covariances, solved), (numbers, covariances)])
        {
            *time += 1e3 * (end - start) / f64::from(repetitions);
        }
    }
    println!(
        "{} observed values, {} unknowns, redundancy {}",
        solution.observations(),
        solution.unknowns(),
        solution.redundancy()
    );
    for entry in solution.trace() {
        println!("  {entry:?}");
    }
    let [solved, covariances, numbers] = times;
    println!("CPU ms: solve {solved:.2}, covariances {covariances:.2}, redundancy numbers {numbers:.2}");
    println!("sigma0 {:.4}, trace {trace:.3e}, sum of redundancy numbers {sum:.6}", solution.sigma0().unwrap());
}
