//! Calibrates a simulated camera from frames of a wall at known distances.
#![allow(clippy::print_stdout)]

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::{RangeErrorModel, RangeTerms, correct_frame, distort_frame};
use nalgebra::Isometry3;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_calibration::{
    DifferenceOptions, Plane, RangeTermOptions, Scale, differences_to_plane, estimate_range_terms,
};
use range_image::{Flags, ImageFormat, Modulation, RangeFrame, Raster};

const SIGMA: f32 = 0.004;

fn main() -> Result<(), range_calibration::Error> {
    let format = ImageFormat::new(176, 144, [0.04, 0.04])?;
    let interior = InteriorOrientation { principal_point_mm: [0.05, -0.03], principal_distance_mm: 8.0 };
    let camera = Camera::new(format, interior, LensDistortion::default())?;
    let interval = Modulation::new(30e6)?.ambiguity_interval_m();
    let terms = RangeTerms { d0: 0.024, periodic: [0.004, 0.0, 0.0, 0.003, 0.008, -0.004], e1: 1e-3, e2: 0.0 };
    let truth = RangeErrorModel { terms, ..RangeErrorModel::error_free(interval) };

    let options = DifferenceOptions { step: 4, ..DifferenceOptions::default() };
    let mut differences = Vec::new();
    for step in 0..20 {
        let wall = Plane::facing_camera(0.6 + 0.25 * step as f64)?;
        let frame = shown(&camera, &wall, &truth, step)?;
        differences.extend(differences_to_plane(&frame, &camera, &Isometry3::identity(), &wall, &options)?);
    }
    let calibration = estimate_range_terms(&differences, interval, &RangeTermOptions::default())?;
    println!("{} differences, redundancy {}", differences.len(), calibration.redundancy());
    println!("rms {:.2} mm before, {:.2} mm after", 1e3 * calibration.rms_before_m(), 1e3 * calibration.rms_after_m());
    println!("sigma0 {:.3}", calibration.sigma0().unwrap_or(f64::NAN));
    for (parameter, truth) in calibration.parameters(Scale::Posterior)?.iter().zip(terms.to_array()) {
        let (name, unit) = (&parameter.name, &parameter.unit);
        println!("{name} {:9.6} ± {:.6} {unit}   (truth {truth:9.6})", parameter.value, parameter.sigma);
    }

    let wall = Plane::facing_camera(2.3)?;
    let mut frame = shown(&camera, &wall, &truth, 99)?;
    correct_frame(&mut frame, calibration.model(), &format, interior.principal_point_mm, None)?;
    let rest = differences_to_plane(&frame, &camera, &Isometry3::identity(), &wall, &DifferenceOptions::default())?;
    let mean = rest.iter().map(|d| d.observed_range_m - d.reference_range_m).sum::<f64>() / rest.len() as f64;
    println!("a wall at 2.3 m that was not part of the calibration is off by {:.3} mm", 1e3 * mean);
    let one_distance = differences.iter().copied().filter(|d| d.reference_range_m < 0.8).collect::<Vec<_>>();
    if let Err(refusal) = estimate_range_terms(&one_distance, interval, &RangeTermOptions::default()) {
        println!("with one distance only: {refusal}");
    }
    Ok(())
}

/// What the camera shows of the wall, with seeded noise.
fn shown(
    camera: &Camera,
    wall: &Plane,
    truth: &RangeErrorModel,
    seed: u64,
) -> Result<RangeFrame, range_calibration::Error> {
    let (width, height) = (camera.format.width, camera.format.height);
    let reference = |col, row| wall.reference_range(camera, &Isometry3::identity(), [col as f64, row as f64]);
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
    for range in frame.range.as_mut_slice() {
        let noise: f32 = StandardNormal.sample(&mut random);
        *range += SIGMA * noise;
    }
    Ok(frame)
}
