//! Tree, cuts, filter and the choice between them on noisy fringes: share of the counts that are right, and time.
//!
//! `cargo run --release -p phase-unwrap --example noisy_methods` prints tables in Markdown for scenes, slopes, directions
//! and seeds that the method was not chosen on; `-- tuned` for those that it was. Images of 320 x 240 pixels, noise
//! unknown to the method; *right* is the count of truth plus noise, so that noise beyond half a cycle is always wrong.
#![allow(clippy::print_stdout)]

#[path = "../tests/common/fringes.rs"]
mod fringes;

use std::error::Error;
use std::time::Instant;

use fringes::{Fringes, Which, scenes};
use phase_unwrap::{FilterVerdict, NoisyMethod, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, PhaseNoise};

const METHODS: [NoisyMethod; 4] = [NoisyMethod::Tree, NoisyMethod::Cuts, NoisyMethod::Filter, NoisyMethod::Auto];
/// Index of the choice among the methods.
const AUTO: usize = 3;
const FILTER: usize = 2;

/// What one image gave: share right and milliseconds of each method.
struct Run {
    scene: &'static str,
    right: [f64; 4],
    milliseconds: [f64; 4],
    chosen: NoisyMethod,
    verdict: FilterVerdict,
}

impl Run {
    fn best(&self) -> f64 {
        self.right[..AUTO].iter().copied().fold(0.0, f64::max)
    }

    /// Time of the fastest method that is right within 0.002 of the best.
    fn best_time(&self) -> f64 {
        let good = (0..AUTO).filter(|&method| self.right[method] >= self.best() - 0.002);
        good.map(|method| self.milliseconds[method]).fold(f64::INFINITY, f64::min)
    }
}

fn run(which: Which, sigma: f64, seeds: &[u64]) -> Result<Vec<Run>, Box<dyn Error>> {
    let mut runs = Vec::new();
    for (scene, surface) in scenes(which) {
        for &seed in seeds {
            let fringes = Fringes::new([320, 240], &surface, sigma, seed);
            let (mut right, mut milliseconds, mut out) = ([0.0; 4], [f64::INFINITY; 4], NoisyUnwrapped::default());
            let mut verdict = FilterVerdict::NotNeeded;
            for (index, method) in METHODS.into_iter().enumerate() {
                let mut unwrapper = NoisyUnwrapper::new(NoisyOptions { method, ..NoisyOptions::default() })?;
                for _ in 0..3 {
                    let start = Instant::now();
                    unwrapper.unwrap_into(&fringes.phase, PhaseNoise::Unknown, None, &mut out)?;
                    milliseconds[index] = 1e3 * start.elapsed().as_secs_f64().min(1e-3 * milliseconds[index]);
                }
                right[index] = fringes.right(&out.unwrapped.wraps);
                if method == NoisyMethod::Filter {
                    verdict = out.filtered.verdict;
                }
            }
            runs.push(Run { scene, right, milliseconds, chosen: out.method, verdict });
        }
    }
    Ok(runs)
}

fn main() -> Result<(), Box<dyn Error>> {
    let tuned = std::env::args().nth(1).is_some_and(|argument| argument == "tuned");
    let (which, seeds, sigmas) = if tuned {
        (Which::Tuned, [1, 2], [0.05, 0.3, 0.5, 0.7, 1.0, 1.2, 1.4])
    } else {
        (Which::HeldOut, [101, 102], [0.1, 0.4, 0.6, 0.8, 1.0, 1.1, 1.3])
    };
    println!(
        "| noise, rad | can be right | tree | cuts | filter | auto | most below the best of the three | ms: tree, cuts, filter, auto | auto's time over the best's |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut all = Vec::new();
    for sigma in sigmas {
        let runs = run(which, sigma, &seeds)?;
        let mean = |of: &dyn Fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / runs.len() as f64;
        let right: Vec<String> = (0..4).map(|m| format!("{:.4}", mean(&|run| run.right[m]))).collect();
        let times: Vec<String> = (0..4).map(|m| format!("{:.0}", mean(&|run| run.milliseconds[m]))).collect();
        let lost = runs.iter().map(|run| run.best() - run.right[AUTO]).fold(0.0, f64::max);
        let slower = runs.iter().map(|run| run.milliseconds[AUTO] / run.best_time());
        let (middle, most) = (mean(&|run| run.milliseconds[AUTO] / run.best_time()), slower.fold(0.0, f64::max));
        let can = 1.0 - beyond_half_a_cycle(sigma);
        println!(
            "| {sigma} | {can:.4} | {} | {lost:.4} | {} | {middle:.1}, at most {most:.1} |",
            right.join(" | "),
            times.join(", ")
        );
        all.extend(runs.into_iter().map(|run| (sigma, can, run)));
    }
    println!("\n| scene, noise of 1 rad | tree | cuts | filter | auto | auto takes |\n|---|---|---|---|---|---|");
    for (_, _, run) in all.iter().filter(|(sigma, _, _)| (sigma - 1.0).abs() < 1e-9).step_by(seeds.len()) {
        let right: Vec<String> = run.right.iter().map(|right| format!("{right:.4}")).collect();
        println!("| {} | {} | {:?} |", run.scene, right.join(" | "), run.chosen);
    }
    // Right is what loses at most 0.005 to noise beyond half a cycle.
    let refused = |run: &Run| matches!(run.verdict, FilterVerdict::NotFollowed { .. });
    let good = |can: f64, run: &Run| run.right[FILTER] >= can - 0.005;
    let count = |keep: &dyn Fn(f64, &Run) -> bool| all.iter().filter(|(_, can, run)| keep(*can, run)).count();
    println!("\nOf {} images the filter is right on {}.", all.len(), count(&|can, run| good(can, run)));
    println!("Right and refused: {}.", count(&|can, run| good(can, run) && refused(run)));
    println!("Wrong and refused: {}.", count(&|can, run| !good(can, run) && refused(run)));
    println!("Wrong and not refused: {}.", count(&|can, run| !good(can, run) && !refused(run)));
    for (sigma, _, run) in all.iter().filter(|(_, can, run)| !good(*can, run) && !refused(run)) {
        println!("- {} at {sigma}: {:.4?}", run.scene, run.right);
    }
    Ok(())
}

/// Probability that normal noise lies beyond half a cycle, by the trapezoidal rule.
fn beyond_half_a_cycle(sigma: f64) -> f64 {
    let limit = std::f64::consts::PI / sigma;
    let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
    let inside: f64 = (-500..500).map(|n| density((f64::from(n) + 0.5) * limit / 500.0) * limit / 500.0).sum();
    1.0 - inside
}
