//! Range terms and poses from eight stations in a furnished room, over many draws of the noise.
//!
//! `cargo run --release -p self-calibration --example surface_calibration [DRAWS]`
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

#[path = "../tests/support/round.rs"]
mod round;

use multiview_registration::Datum;
use range_calibration::{SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces};

const TRUTH: [(&str, f64); 3] = [("d0", 0.024), ("d4", 0.006), ("d5", -0.005)];

fn main() {
    let draws: u64 = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(20);
    let (poses, camera, known) = (round::poses(8), round::camera(), round::model(&[]));
    let (mut squares, mut inside) = (0.0, 0);
    for seed in 1..=draws {
        let frames = round::frames(&poses, &round::model(&TRUTH), seed);
        let captures: Vec<SurfaceCapture<'_>> = frames
            .iter()
            .zip(&poses)
            .map(|(frame, pose)| SurfaceCapture { name: "station", frame, world_from_camera: Some(*pose) })
            .collect();
        let terms = TRUTH.iter().map(|(name, _)| SurfaceTerm::free(name)).collect();
        let options = SurfaceCalibrationOptions { terms, ..SurfaceCalibrationOptions::default() };
        let result = calibrate_surfaces(&captures, &camera, &known, Datum::Station(0), &options, &|_, _| {}).unwrap();
        let errors: Vec<f64> =
            result.shared().values.iter().zip(TRUTH).map(|(value, (_, truth))| value - truth).collect();
        let error = nalgebra::DVector::from_vec(errors);
        let square = error.dot(&(result.covariance().try_inverse().unwrap() * &error));
        squares += square;
        // 95 % quantile of chi squared with three degrees of freedom.
        inside += u32::from(square < 7.815);
        let [before, after] = result.surface_rms_m();
        let sigma = result.shared().sigma();
        println!(
            "draw {seed}: errors {:.2} {:.2} {:.2} mm, sigma {:.2} {:.2} {:.2} mm; surfaces {:.2} to {:.2} mm",
            1e3 * error[0],
            1e3 * error[1],
            1e3 * error[2],
            1e3 * sigma[0],
            1e3 * sigma[1],
            1e3 * sigma[2],
            1e3 * before,
            1e3 * after
        );
    }
    let n = draws as f64;
    println!(
        "mean normalised squared error {:.2} (3 expected), {inside} of {draws} in the 95 % ellipsoid",
        squares / n
    );
}
