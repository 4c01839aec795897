//! Three stations from tie points alone: two views, the network without and with ranges, and what each is known to.
#![allow(clippy::print_stdout)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use nalgebra::{Isometry3, Point3, Vector3};
use orientation::{
    ImagePoint, NetworkOptions, ObservedRange, OrientedNetwork, RelativeOrientationOptions, TieObservation,
    orient_network, orient_two_views,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

fn main() -> Result<(), orientation::Error> {
    let camera = Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).map_err(camera_model::Error::from)?,
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, ..LensDistortion::default() },
    )?;
    let stations = [
        Isometry3::identity(),
        Isometry3::new(Vector3::new(0.9, 0.1, -0.2), Vector3::new(0.05, 0.3, -0.1)),
        Isometry3::new(Vector3::new(-0.7, 0.5, 0.1), Vector3::new(-0.15, -0.2, 0.4)),
    ];
    let mut generator = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
    let mut observations = Vec::new();
    for (station, pose) in stations.iter().enumerate() {
        for target in 0..16 {
            let t = f64::from(target);
            let point = Point3::new(0.8 * (2.0 * t).sin(), 0.6 * (3.1 * t).cos(), -3.2 + 0.7 * (5.3 * t).sin());
            let seen = camera.observe(pose, &point)?;
            let pixel = camera.format.pixel_from_image(seen.image_mm).map(|position| position + 0.1 * normal());
            let range = Some(ObservedRange { range_m: seen.range_m + 0.005 * normal(), sigma_m: 0.005 });
            observations.push(TieObservation {
                station,
                target: target as usize,
                image: ImagePoint::new(pixel, 0.1),
                range,
            });
        }
    }
    // One target mistaken for another.
    observations[20].image.pixel = observations[25].image.pixel;

    let view = |station: usize| -> Vec<ImagePoint> {
        observations.iter().filter(|seen| seen.station == station).map(|seen| seen.image).collect()
    };
    let pair = orient_two_views([&camera; 2], [&view(0), &view(1)], &RelativeOrientationOptions::default())?;
    println!("two views: base {:.4?}", pair.first_from_second.translation.vector.as_slice());
    println!("  deviations {:.4?}", pair.covariance.diagonal().map(f64::sqrt).as_slice());
    println!("  gross errors {:?}, sigma0 {:.2?}", pair.gross_errors, pair.sigma0);

    report("ranges and image points", &orient_network(&camera, &observations, &NetworkOptions::default())?);
    for seen in &mut observations {
        seen.range = None;
    }
    report("image points", &orient_network(&camera, &observations, &NetworkOptions::default())?);
    Ok(())
}

fn report(name: &str, network: &OrientedNetwork) {
    println!(
        "{name}: scale {:?}, sigma0 {:.2?}, gross errors {:?}",
        network.scale, network.sigma0, network.gross_errors
    );
    for station in &network.stations[1..] {
        let sigma = station.covariance.diagonal().map(f64::sqrt);
        println!("  centre {:.4?}", station.first_from_station.translation.vector.as_slice());
        println!("    +- {:.4?}, turns +- {:.5?} rad", &sigma.as_slice()[..3], &sigma.as_slice()[3..]);
    }
}
