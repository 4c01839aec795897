//! Point spread functions from simulated captures.
#![cfg(feature = "estimate")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "common/captures.rs"]
mod captures;

use captures::{Object, Scene};
use range_image::ComplexFrame;
use scattering_deconvolution::{
    EstimationOptions, GaussianTerm, Psf, PsfEstimate, TermCount, Verdict, estimate_psf,
};

fn round(terms: &[(f64, f64)]) -> Psf {
    Psf::Gaussians(terms.iter().map(|&(weight, s)| GaussianTerm { weight, sigma_px: [s, s] }).collect())
}

fn estimate(pairs: &[(ComplexFrame, ComplexFrame)], options: &EstimationOptions) -> PsfEstimate {
    let captures: Vec<_> = pairs.iter().map(|(with, without)| (with, without)).collect();
    estimate_psf(&captures, options).unwrap()
}

const OBJECTS: [Object; 3] = [
    Object { columns: [0, 50], rows: [70, 144], range_m: 0.8, amplitude: 2000.0 },
    Object { columns: [70, 110], rows: [40, 90], range_m: 1.0, amplitude: 1500.0 },
    Object { columns: [130, 176], rows: [0, 60], range_m: 0.6, amplitude: 2500.0 },
];

#[test]
fn two_gaussians_come_back() {
    let psf = round(&[(0.02, 8.0), (0.04, 40.0)]);
    let scene = Scene::camera();
    let pairs: Vec<_> = OBJECTS.iter().zip(0..).map(|(object, seed)| scene.pair(object, &psf, seed)).collect();
    let start = std::time::Instant::now();
    let found = estimate(&pairs, &EstimationOptions::default());
    println!("{:?} {found:#?}", start.elapsed());
    assert_eq!(found.verdict, Verdict::Determined);
    for (parameter, truth) in found.parameters.iter().zip([0.02, 8.0, 0.04, 40.0]) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{parameter:?} {truth}");
    }
}
