//! Estimates point spread functions from simulated captures and restores another scene with them: how much of its mean
//! range error is gone with the true and with the estimated point spread function. `estimate_scatter monte_carlo` checks
//! the standard deviations on many simulated captures instead.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, missing_docs)]

use std::time::Instant;

use captures::{Object, Scene, elliptic, estimate, mean_wall_error, round};
use range_image::ComplexFrame;
use scattering_deconvolution::{EstimationOptions, Psf, RestorationOptions, TermCount, TermShape, Verdict, restore};

#[path = "../tests/common/captures.rs"]
mod captures;

/// Six captures: three places, two distances; the image border cuts four of the objects.
fn objects() -> Vec<Object> {
    let places = [([0, 50], [70, 144]), ([70, 110], [40, 90]), ([130, 176], [0, 60])];
    let distances = [(0.8, 2000.0), (1.3, 900.0)];
    let object = |(columns, rows), (range_m, amplitude)| Object { columns, rows, range_m, amplitude };
    distances.iter().flat_map(|&distance| places.iter().map(move |&place| object(place, distance))).collect()
}

/// A hand before a wall, at distances that no capture had.
fn other_scene(psf: &Psf) -> (Object, ComplexFrame) {
    let hand = Object { columns: [60, 105], rows: [70, 144], range_m: 0.5, amplitude: 3000.0 };
    // Hardly any noise: the range error that is left is that of the point spread function.
    let view = Scene { wall_m: 2.7, wall_amplitude: 100.0, noise: 1e-3, ..Scene::camera() };
    (hand, view.frame(Some(&hand), psf, 77))
}

/// Share of the other scene's mean range error that is gone.
fn gone(truth: &Psf, used: &Psf) -> f64 {
    let (hand, mut frame) = other_scene(truth);
    let (_, clean) = other_scene(&round(&[]));
    let before = mean_wall_error(&frame, &clean, &hand);
    restore(&mut frame, used, &RestorationOptions::default()).unwrap();
    1.0 - mean_wall_error(&frame, &clean, &hand) / before
}

fn accuracy() {
    println!("scatter_share  shape     gone_known  gone_estimated  seconds  verdict");
    for share in [0.01, 0.02, 0.04, 0.06, 0.10, 0.15] {
        let mixed = round(&[(0.3 * share, 9.0), (0.7 * share, 42.0)]);
        for (name, psf, shape) in
            [("two", mixed, TermShape::Round), ("elliptic", elliptic(share, [35.0, 18.0]), TermShape::Elliptic)]
        {
            let pairs: Vec<_> =
                objects().iter().zip(0..).map(|(o, seed)| Scene::camera().pair(o, &psf, seed)).collect();
            let start = Instant::now();
            let found = estimate(&pairs, &EstimationOptions { shape, ..EstimationOptions::default() });
            let seconds = start.elapsed().as_secs_f64();
            let used = found.psf.clone().unwrap_or(Psf::Gaussians(Vec::new()));
            let [known, estimated] = [&psf, &used].map(|used| 100.0 * gone(&psf, used));
            let verdict = found.verdict;
            println!("{share:13.2}  {name:8}  {known:9.2}%  {estimated:13.2}%  {seconds:7.2}  {verdict}");
        }
    }
    let clean: Vec<_> = objects().iter().zip(0..).map(|(o, seed)| Scene::camera().pair(o, &round(&[]), seed)).collect();
    let found = estimate(&clean, &EstimationOptions::default());
    let limit = 100.0 * found.detection_limit;
    println!("without scatter: {}; {limit:.2} % would have been found; {:?}", found.verdict, found.psf);
}

/// Root mean square of errors over standard deviations, parameter by parameter.
fn monte_carlo(trials: u64) {
    for terms in [&[(0.05, 7.0)][..], &[(0.03, 3.0), (0.05, 12.0)][..]] {
        let psf = round(terms);
        let truth: Vec<f64> = terms.iter().flat_map(|&(weight, sigma)| [weight, sigma]).collect();
        let scene = Scene { size: [48, 40], noise: 0.25, ..Scene::small() };
        let objects = [
            Object { columns: [0, 14], rows: [22, 40], range_m: 0.8, amplitude: 2000.0 },
            Object { columns: [28, 40], rows: [6, 18], range_m: 0.9, amplitude: 2200.0 },
        ];
        let options = EstimationOptions { terms: TermCount::Exactly(terms.len()), ..EstimationOptions::default() };
        let (mut squares, mut used) = (vec![0.0; truth.len()], 0.0);
        for trial in 0..trials {
            let pairs: Vec<_> = objects.iter().zip(2 * trial..).map(|(o, seed)| scene.pair(o, &psf, seed)).collect();
            let found = estimate(&pairs, &options);
            if found.verdict != Verdict::Determined {
                continue;
            }
            used += 1.0;
            for ((square, parameter), truth) in squares.iter_mut().zip(&found.parameters).zip(&truth) {
                *square += ((parameter.value - truth) / parameter.sigma * found.sigma0.max(1.0)).powi(2);
            }
        }
        let errors: Vec<f64> = squares.iter().map(|square| (square / used).sqrt()).collect();
        println!("{terms:?}: normalised errors {errors:.3?} of {used} captures in {trials}");
    }
}

fn main() {
    if std::env::args().nth(1).is_some_and(|word| word == "monte_carlo") {
        monte_carlo(2000);
    } else {
        accuracy();
    }
}
