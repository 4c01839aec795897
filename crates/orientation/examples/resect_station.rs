//! One station from seven targets: with ranges, without, and with a target that was mistaken for another.
#![allow(clippy::print_stdout)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, euler_from_pose, pose_from_euler};
use nalgebra::{Point3, Vector3};
use orientation::{Resection, ResectionOptions, TargetObservation, resect};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

const TARGETS: [[f64; 3]; 7] = [
    [-0.8, -0.6, 0.0],
    [0.8, -0.6, 0.1],
    [0.8, 0.6, 0.0],
    [-0.8, 0.6, -0.1],
    [0.1, 0.0, 0.6],
    [-0.3, 0.2, 0.3],
    [0.4, -0.3, -0.2],
];

fn main() -> Result<(), orientation::Error> {
    let camera = Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).map_err(camera_model::Error::from)?,
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, p1: 1.2e-4, ..LensDistortion::default() },
    )?;
    let truth = pose_from_euler(Vector3::new(0.4, -0.5, 3.0), [0.15, 0.1, 0.3]);
    let mut generator = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
    let mut targets = Vec::new();
    for point in TARGETS.map(Point3::from) {
        let seen = camera.observe(&truth, &point)?;
        let pixel = camera.format.pixel_from_image(seen.image_mm).map(|position| position + 0.1 * normal());
        targets.push(TargetObservation::new(point, pixel, 0.1).with_range(seen.range_m + 0.005 * normal(), 0.005));
    }

    report("image points and ranges", &resect(&camera, &targets, &ResectionOptions::default())?);
    let image_only: Vec<_> = targets.iter().map(|target| TargetObservation { range: None, ..*target }).collect();
    report("image points only", &resect(&camera, &image_only, &ResectionOptions::default())?);
    match resect(&camera, &image_only[..3], &ResectionOptions::default()) {
        Ok(station) => report("three image points", &station),
        Err(error) => println!("three image points: {error}"),
    }
    targets[3].pixel[0] += 3.0;
    report("target 3 displaced by 3 pixels", &resect(&camera, &targets, &ResectionOptions::default())?);
    println!("truth: {:.4?} m, {:.5?} rad", truth.translation.vector.as_slice(), euler_from_pose(&truth));
    Ok(())
}

fn report(name: &str, station: &Resection) {
    let pose = &station.world_from_camera;
    let sigma = station.covariance.diagonal().map(f64::sqrt);
    println!("{name} ({:?}):", station.start);
    println!("  centre {:.4?} +- {:.4?} m", pose.translation.vector.as_slice(), &sigma.as_slice()[..3]);
    println!("  omega phi kappa {:.5?}, turns +- {:.5?} rad", euler_from_pose(pose), &sigma.as_slice()[3..]);
    let w: Vec<_> = station.residuals.iter().map(|residual| residual.standardised).collect();
    println!("  sigma0 {:.2?}, redundancy {}, standardised residuals {w:.1?}", station.sigma0, station.redundancy);
}
