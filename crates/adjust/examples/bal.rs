//! Bundle adjustment of a BAL problem: `bal PATH [full]`. Prints cost (half the sum of squares), iterations and
//! seconds. Descends until the relative decrease is below 1e-6, or, with `full`, adjusts a free network on all points with
//! covariances.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use std::time::Instant;

use adjust::{DatumDefect, Scale, SolveOptions};

#[allow(dead_code)]
#[path = "../tests/common/bal.rs"]
mod bal;

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
    let words: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| words.iter().any(|given| given == word);
    let Some(text) = words.first().and_then(|path| std::fs::read_to_string(path).ok()) else {
        println!("usage: bal PATH [full]");
        return;
    };
    let (wall, start) = (Instant::now(), cpu());
    let Some(mut bundle) = bal::bundle(&text) else {
        println!("this is no BAL problem");
        return;
    };
    println!("read: {:.3} s CPU", cpu() - start);
    let options = SolveOptions::default();
    let start = cpu();
    if !has("full") {
        let descent = bundle.adjustment.descend(&options, 1e-6).unwrap();
        println!("cpu_seconds {:.3}", cpu() - start);
        println!("wall_seconds_with_reading {:.3}", wall.elapsed().as_secs_f64());
        println!("cost {:.6e}", 0.5 * descent.objective());
        println!("iterations {}", descent.iterations());
        for entry in descent.trace() {
            println!(
                "  {:?} {:.8e} step {:.2e} damping {:.1e}",
                entry.kind,
                0.5 * entry.objective,
                entry.step,
                entry.damping
            );
        }
        return;
    }
    bundle.adjustment.add_inner_constraints(&bundle.points, DatumDefect::Seven).unwrap();
    match bundle.adjustment.solve(&options) {
        Err(error) => println!("{error}"),
        Ok(solution) => {
            println!("solution: {:.3} s CPU, {:.3} s wall with reading", cpu() - start, wall.elapsed().as_secs_f64());
            println!("cost {:.6e} after {} iterations", 0.5 * solution.vtpv(), solution.iterations());
            println!("sigma0 {:?}, redundancy {}", solution.sigma0(), solution.redundancy());
            let sigma = solution.standard_deviations(bundle.cameras[0], Scale::Posterior).unwrap();
            println!("deviations of the first camera {sigma:?}");
        }
    }
}
