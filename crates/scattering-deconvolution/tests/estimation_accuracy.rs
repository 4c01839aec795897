//! How good estimated point spread functions are: covariance by simulation, and the range errors of another scene.
#![cfg(feature = "estimate")]

use crate::captures::{Object, Scene, estimate, mean_wall_error, round};
use range_image::{ComplexFrame, Raster};
use rayon::prelude::*;
use scattering_deconvolution::{
    EstimationOptions, Psf, PsfEstimate, RestorationOptions, TermCount, TwoPlaneCapture, Verdict, estimate_psf, restore,
};

const SMALL: [Object; 2] = [
    Object { columns: [0, 12], rows: [18, 32], range_m: 0.8, amplitude: 2000.0 },
    Object { columns: [24, 34], rows: [6, 16], range_m: 0.9, amplitude: 2200.0 },
];

fn small() -> Scene {
    Scene { size: [40, 32], noise: 0.25, ..Scene::small() }
}

/// Root mean square of errors over standard deviations of each parameter, and the mean sigma0, of seeded captures.
fn normalised_errors(truth: &[f64], trials: u64, find: impl Fn(u64) -> PsfEstimate + Sync + Send) -> (Vec<f64>, f64) {
    let found: Vec<PsfEstimate> = (0..trials).into_par_iter().map(find).collect();
    let (mut squares, mut sigma0) = (vec![0.0; truth.len()], 0.0);
    for found in &found {
        assert_eq!(found.verdict, Verdict::Determined, "{found:#?}");
        sigma0 += found.sigma0 / trials as f64;
        // Prior-scaled: the simulated noise is what the frames say.
        let inflation = found.sigma0.max(1.0);
        for ((square, parameter), truth) in squares.iter_mut().zip(&found.parameters).zip(truth) {
            *square += ((parameter.value - truth) / parameter.sigma * inflation).powi(2) / trials as f64;
        }
    }
    (squares.into_iter().map(f64::sqrt).collect(), sigma0)
}

fn assert_honest((errors, sigma0): (Vec<f64>, f64), trials: u64) {
    println!("normalised errors {errors:.3?}, sigma0 {sigma0:.4}");
    // The root mean square of n normal errors has a standard deviation of 1 / sqrt(2 n); three of these. The example
    // `estimate_scatter` does the same with 2000.
    let bound = 3.0 / (2.0 * trials as f64).sqrt();
    assert!(errors.iter().all(|error| (error - 1.0).abs() < bound), "{errors:?}, {bound}");
    // Some hundred numbers each: sigma0 is known to 0.04 once, to 0.004 on average.
    assert!((sigma0 - 1.0).abs() < 0.02, "{sigma0}");
}

#[test]
fn standard_deviations_are_those_of_repeated_captures() {
    let psf = round(&[(0.03, 3.0), (0.05, 11.0)]);
    let options = EstimationOptions { terms: TermCount::Exactly(2), ..EstimationOptions::default() };
    let find = |trial: u64| {
        let pairs: Vec<_> = SMALL.iter().zip(2 * trial..).map(|(o, seed)| small().pair(o, &psf, seed)).collect();
        estimate(&pairs, &options)
    };
    assert_honest(normalised_errors(&[0.03, 3.0, 0.05, 11.0], 120, find), 120);
}

#[test]
fn standard_deviations_of_two_planes_are_those_of_repeated_captures() {
    let psf = round(&[(0.05, 7.0)]);
    let options = EstimationOptions { terms: TermCount::Exactly(1), ..EstimationOptions::default() };
    let phase = Raster::from_fn(40, 32, |col, row| {
        let near = col < 12 + 3 && row >= 18 - 3;
        if near { f32::NAN } else { small().modulation().phase_from_range(small().light(None, col, row).1) as f32 }
    });
    let find = |trial: u64| {
        let observed = small().frame(Some(&SMALL[0]), &psf, trial);
        let capture = TwoPlaneCapture { observed: &observed, true_phase: std::slice::from_ref(&phase) };
        estimate_psf(&[capture], &options).unwrap()
    };
    assert_honest(normalised_errors(&[0.05, 7.0], 120, find), 120);
}

/// Mean range error of a wall behind a hand, none of which was in the captures.
fn other_scene(scene: &Scene, psf: &Psf) -> (Object, ComplexFrame) {
    let hand = Object {
        columns: [scene.size[0] / 3, scene.size[0] * 3 / 5],
        rows: [scene.size[1] / 2, scene.size[1]],
        range_m: 0.5,
        amplitude: 3000.0,
    };
    let view = Scene { wall_m: 2.7, wall_amplitude: 100.0, noise: 1e-3, ..*scene };
    (hand, view.frame(Some(&hand), psf, 77))
}

#[test]
fn another_scene_is_restored() {
    let scene = Scene::small();
    let objects = [
        Object { columns: [0, 18], rows: [26, 48], range_m: 0.8, amplitude: 2000.0 },
        Object { columns: [25, 40], rows: [12, 30], range_m: 1.0, amplitude: 1500.0 },
        Object { columns: [48, 64], rows: [0, 20], range_m: 0.6, amplitude: 2500.0 },
    ];
    for share in [0.0, 0.01, 0.05, 0.15] {
        let psf = round(&[(0.35 * share, 4.0), (0.65 * share, 16.0)]);
        let pairs: Vec<_> = objects.iter().zip(0..).map(|(o, seed)| scene.pair(o, &psf, seed)).collect();
        let found = estimate(&pairs, &EstimationOptions::default());
        let (hand, mut frame) = other_scene(&scene, &psf);
        let truth = other_scene(&scene, &round(&[])).1;
        let before = mean_wall_error(&frame, &truth, &hand);
        restore(&mut frame, found.psf.as_ref().unwrap(), &RestorationOptions::default()).unwrap();
        let after = mean_wall_error(&frame, &truth, &hand);
        println!("share {share}: {before:.5} m before, {after:.5} m after, {}", found.verdict);
        if share > 0.0 {
            assert!(after < 0.1 * before, "{share}: {after} m of {before} m, {found:#?}");
        } else {
            // Nothing made worse: the empty point spread function leaves every bit.
            assert!((after - before).abs() < f64::EPSILON);
        }
    }
}
