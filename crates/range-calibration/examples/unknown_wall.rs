//! Calibrates the range terms of a simulated camera from captures of a wall whose place nobody measured.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::{RangeErrorModel, RangeTerms, distort_frame};
use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_calibration::{
    DifferenceOptions, Error, Plane, PlaneCalibrationOptions, PlaneCapture, Scale, calibrate_planes,
};
use range_image::{Flags, ImageFormat, Modulation, RangeFrame, Raster};

const SIGMA: f32 = 0.004;
const STATIONS: usize = 12;

/// `unknown_wall [COLUMNS ROWS STEP]`, 176 144 4 where nothing is given.
fn main() -> Result<(), Error> {
    let given: Vec<usize> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let [width, height, step] = given[..] else { return calibrate(176, 144, 4) };
    calibrate(width, height, step)
}

fn calibrate(width: usize, height: usize, step: usize) -> Result<(), Error> {
    let format = ImageFormat::new(width, height, [7.04 / width as f64, 5.76 / height as f64])?;
    let interior = InteriorOrientation { principal_point_mm: [0.05, -0.03], principal_distance_mm: 4.0 };
    let camera = Camera::new(format, interior, LensDistortion::default())?;
    let interval = Modulation::new(30e6)?.ambiguity_interval_m();
    let terms = RangeTerms { d0: 0.024, periodic: [0.004, 0.0, 0.0, 0.003, 0.008, -0.004], e1: 1e-3, e2: 0.0 };
    let truth = RangeErrorModel { terms, ..RangeErrorModel::error_free(interval) };
    let wall = Plane::new(&Vector3::new(0.1, 0.05, 1.0), &Point3::new(0.0, 0.0, -5.5))?;

    // Stations on the way to the wall, their poses known from targets; a box stands before the wall in each picture.
    let poses: Vec<_> = (0..STATIONS).map(station).collect();
    let shown = |(seed, pose)| shown(&camera, pose, &wall, &truth, seed);
    let frames = (0..).zip(&poses).map(shown).collect::<Result<Vec<_>, Error>>()?;
    let captures: Vec<_> = (0..STATIONS).map(|index| capture(index, &frames[index], Some(poses[index]))).collect();
    let mut options = PlaneCalibrationOptions::default();
    options.pixels = DifferenceOptions { step, ..options.pixels };
    let start = Instant::now();
    let calibration = calibrate_planes(&captures, &[None], &camera, interval, &options)?;
    let seconds = start.elapsed().as_secs_f64();

    println!("{STATIONS} captures of {width} x {height}, every {step}. pixel, in {seconds:.2} s");
    let quality = calibration.captures();
    let [used, rejected] = [quality.iter().map(|c| c.used).sum(), quality.iter().map(|c| c.rejected).sum::<usize>()];
    println!("{used} pixels used, {rejected} left out, sigma0 {:.3}", calibration.sigma0());
    for (parameter, truth) in calibration.parameters(Scale::Posterior)?.iter().zip(terms.to_array()) {
        let (name, unit) = (&parameter.name, &parameter.unit);
        println!("{name} {:9.6} ± {:.6} {unit}   (truth {truth:9.6})", parameter.value, parameter.sigma);
    }
    let found = &calibration.planes()[0];
    let (distance, truth) = (found.plane.distance_m().abs(), wall.distance_m().abs());
    println!("{}: {distance:.5} ± {:.5} m from the origin (truth {truth:.5})", found.name, found.distance_sigma_m);
    let diagnosis = calibration.diagnosis(0.5);
    println!("weakest combination: {} (deviation {:.1} times larger)", diagnosis.weakest, diagnosis.weakest_inflation);

    // Without poses each capture has a wall of its own: three unknowns for each instead of three in all.
    let lonely: Vec<_> = (0..STATIONS).map(|index| capture(index, &frames[index], None)).collect();
    match calibrate_planes(&lonely, &[], &camera, interval, &options) {
        Err(refusal @ Error::PlanesNotDetermined { .. }) => println!("without poses: {refusal}"),
        Err(error) => return Err(error),
        Ok(calibration) => {
            let d0 = &calibration.parameters(Scale::Posterior)?[0];
            println!("without poses: d0 {:.6} ± {:.6} m", d0.value, d0.sigma);
        }
    }
    Ok(())
}

fn station(index: usize) -> Isometry3<f64> {
    let t = index as f64;
    let turn = Vector3::new(0.2 * (1.3 * t).sin(), 0.25 * (0.7 * t).cos(), 0.1 * t);
    Isometry3::new(Vector3::new(0.1 * t.sin(), 0.1, -4.6 * t / STATIONS as f64), turn)
}

fn capture(index: usize, frame: &RangeFrame, world_from_camera: Option<Isometry3<f64>>) -> PlaneCapture<'_> {
    PlaneCapture { name: format!("S{index}"), frame, world_from_camera, covariance: None, drift_m: 0.0, plane: 0 }
}

/// What the camera shows of the wall and of a box before it, with seeded noise.
fn shown(
    camera: &Camera,
    pose: &Isometry3<f64>,
    wall: &Plane,
    truth: &RangeErrorModel,
    seed: u64,
) -> Result<RangeFrame, Error> {
    let (width, height) = (camera.format.width, camera.format.height);
    let reference = |col: usize, row: usize| wall.reference_range(camera, pose, [col as f64, row as f64]);
    let mut frame = RangeFrame {
        range: Raster::from_fn(width, height, |col, row| {
            reference(col, row).map_or(f32::NAN, |(range, _)| range as f32)
        }),
        sigma: Raster::filled(width, height, SIGMA),
        amplitude: Raster::filled(width, height, 200.0),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    distort_frame(&mut frame, truth, &camera.format, camera.interior.principal_point_mm, None)?;
    let mut random = Pcg64::seed_from_u64(seed);
    for (pixel, range) in frame.range.as_mut_slice().iter_mut().enumerate() {
        let noise: f32 = StandardNormal.sample(&mut random);
        *range += SIGMA * noise;
        let [col, row] = [pixel % width, pixel / width];
        if (width / 8..width / 3).contains(&col) && row > 2 * height / 3 {
            *range -= 0.3;
        }
    }
    Ok(frame)
}
