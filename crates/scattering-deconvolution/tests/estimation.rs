//! Point spread functions from simulated captures.
#![cfg(feature = "estimate")]

use crate::captures::{Object, Scene, elliptic, estimate, round};
use scattering_deconvolution::{
    Ambiguity, EstimationOptions, Nuisance, Psf, TermCount, TermShape, Verdict, estimate_psf,
};

const OBJECTS: [Object; 3] = [
    Object { columns: [0, 18], rows: [26, 48], range_m: 0.8, amplitude: 2000.0 },
    Object { columns: [25, 40], rows: [12, 30], range_m: 1.0, amplitude: 1500.0 },
    Object { columns: [48, 64], rows: [0, 20], range_m: 0.6, amplitude: 2500.0 },
];

fn undetermined(what: Ambiguity) -> Verdict {
    Verdict::Undetermined { what, advice: what.advice() }
}

#[test]
fn two_gaussians_come_back() {
    let psf = round(&[(0.02, 4.0), (0.04, 15.0)]);
    let scene = Scene::small();
    let pairs: Vec<_> = OBJECTS.iter().zip(0..).map(|(object, seed)| scene.pair(object, &psf, seed)).collect();
    let found = estimate(&pairs, &EstimationOptions::default());
    assert_eq!(found.verdict, Verdict::Determined, "{found:#?}");
    assert_eq!(found.parameters.len(), 4);
    for (parameter, truth) in found.parameters.iter().zip([0.02, 4.0, 0.04, 15.0]) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{parameter:?} {truth}");
        assert!(parameter.sigma < 0.05 * truth, "{parameter:?}");
    }
    assert!((found.sigma0 - 1.0).abs() < 0.05 && found.outlier_share < 0.01);
    for report in &found.captures {
        let held_out = report.rms_held_out.unwrap();
        assert!(report.rms_after < 0.3 * report.rms_before, "{report:?}");
        assert!(held_out < 1.05 * report.rms_after, "{report:?}");
    }
}

#[test]
fn elliptic_gaussians_come_back() {
    let psf = elliptic(0.05, [14.0, 7.0]);
    let scene = Scene::small();
    let pairs: Vec<_> = OBJECTS.iter().zip(0..).map(|(object, seed)| scene.pair(object, &psf, seed)).collect();
    let options = EstimationOptions { shape: TermShape::Elliptic, ..EstimationOptions::default() };
    let found = estimate(&pairs, &options);
    assert_eq!(found.verdict, Verdict::Determined, "{found:#?}");
    for (parameter, truth) in found.parameters.iter().zip([0.05, 14.0, 7.0]) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{parameter:?} {truth}");
    }
}

#[test]
fn without_scatter_there_is_nothing_to_correct() {
    let scene = Scene::small();
    for seed in 0..5 {
        let pairs: Vec<_> = OBJECTS.iter().zip(10 * seed..).map(|(o, seed)| scene.pair(o, &round(&[]), seed)).collect();
        let found = estimate(&pairs, &EstimationOptions::default());
        assert_eq!(found.verdict, Verdict::NothingToCorrect, "{found:#?}");
        assert_eq!(found.psf, Some(Psf::Gaussians(Vec::new())));
        assert!(found.detection_limit < 0.005);
    }
}

#[test]
fn a_dim_object_tells_nothing() {
    let scene = Scene::small();
    let object = Object { amplitude: 50.0, ..OBJECTS[1] };
    for psf in [round(&[]), round(&[(0.005, 10.0)])] {
        let found = estimate(&[scene.pair(&object, &psf, 3)], &EstimationOptions::default());
        assert_eq!(found.verdict, undetermined(Ambiguity::SignalBelowNoise), "{found:#?}");
        assert_eq!(found.psf, None);
    }
}

#[test]
fn two_equal_frames_show_no_object() {
    let scene = Scene::small();
    let psf = round(&[(0.05, 10.0)]);
    let pair = (scene.frame(None, &psf, 1), scene.frame(None, &psf, 2));
    let found = estimate(&[pair], &EstimationOptions::default());
    assert_eq!(found.verdict, undetermined(Ambiguity::NoObjectLight), "{found:#?}");
}

#[test]
fn an_object_that_fills_the_image_leaves_no_background() {
    let scene = Scene::small();
    let object = Object { columns: [0, 64], rows: [0, 46], ..OBJECTS[0] };
    let found = estimate(&[scene.pair(&object, &round(&[(0.05, 10.0)]), 1)], &EstimationOptions::default());
    assert_eq!(found.verdict, undetermined(Ambiguity::NoBackground), "{found:#?}");
}

#[test]
fn gaussians_that_are_not_there_are_refused() {
    let scene = Scene::small();
    let pair = scene.pair(&OBJECTS[0], &round(&[(0.05, 10.0)]), 1);
    let options = EstimationOptions { terms: TermCount::Exactly(3), ..EstimationOptions::default() };
    let found = estimate(&[pair], &options);
    assert!(matches!(found.verdict, Verdict::Undetermined { .. }), "{found:#?}");
    assert_eq!(found.psf, None);
}

#[test]
fn a_veil_gives_a_reduced_answer() {
    let scene = Scene::small();
    // Over an image of 64 x 48 pixels a width of 400 is a constant: 0.3 % at the farthest corner.
    let pair = scene.pair(&OBJECTS[1], &round(&[(6.0, 400.0)]), 1);
    let found = estimate(&[pair], &EstimationOptions::default());
    assert_eq!(found.verdict, undetermined(Ambiguity::WidthBeyondImage), "{found:#?}");
    assert!(found.psf.is_some());
}

#[test]
fn drift_and_crosstalk_are_told_from_scatter() {
    let psf = round(&[(0.05, 10.0)]);
    let scene = Scene::small();
    let drift = 0.01;
    let crosstalk = 2.0;
    let pairs: Vec<_> = OBJECTS
        .iter()
        .zip(0..)
        .map(|(object, seed)| {
            let (mut with, without) = scene.pair(object, &psf, seed);
            let channel = &mut with.channels[0];
            channel.real.as_mut_slice().iter_mut().for_each(|value| *value = *value * (1.0 + drift) + crosstalk);
            channel.imaginary.as_mut_slice().iter_mut().for_each(|value| *value *= 1.0 + drift);
            (with, without)
        })
        .collect();
    let nuisances = vec![Nuisance::Drift, Nuisance::Constant];
    let found = estimate(&pairs, &EstimationOptions { nuisances, ..EstimationOptions::default() });
    assert_eq!(found.verdict, Verdict::Determined, "{found:#?}");
    for (parameter, truth) in found.parameters.iter().zip([0.05, 10.0]) {
        // The object's light drifts as well: 1 % of the weight.
        assert!((parameter.value / truth - 1.0).abs() < 0.012, "{parameter:?} {truth}");
    }
    for report in &found.captures {
        let (drift_found, constant) = (report.nuisances.drift.unwrap(), report.nuisances.constant.unwrap());
        let truth = [f64::from(drift), 0.0, f64::from(crosstalk), 0.0];
        for (estimated, truth) in drift_found.iter().chain(&constant).zip(truth) {
            assert!((estimated.value - truth).abs() < 4.0 * estimated.sigma, "{report:?}");
        }
    }
}

#[test]
fn the_same_bits_come_from_any_number_of_threads() {
    let scene = Scene::small();
    let pair = scene.pair(&OBJECTS[0], &round(&[(0.03, 5.0), (0.05, 16.0)]), 1);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| estimate_psf(&[(&pair.0, &pair.1)], &EstimationOptions::default()).unwrap())
    };
    assert_eq!(format!("{:?}", run(1)), format!("{:?}", run(4)));
}
