//! Light that bounces once makes ranges too long, most of all near a corner.
#![allow(clippy::unwrap_used)]

mod common;

use common::{first, fixture, range_error};
use nalgebra::Point3;

/// Error and height above the floor of each pixel of the west wall, away from the third face.
fn profile(albedo_factor: f64) -> Vec<(f64, f64)> {
    let mut spec = fixture("corner_multipath");
    spec.errors.noise = None;
    for object in &mut spec.scene.objects {
        object.albedo *= albedo_factor;
    }
    let (frame, complex) = first(&spec);
    let error = range_error(&complex, 0, &frame.truth.range);
    let truth = &frame.truth;
    let place = |i: usize| {
        let pixel = [(i % truth.range.width()) as f64, (i / truth.range.width()) as f64];
        truth.world_from_camera * spec.camera.geometry.point(pixel, f64::from(truth.range.as_slice()[i]))
    };
    (0..error.len())
        .filter(|i| truth.object.as_slice()[*i] == Some(0))
        .map(|i| (error[i], place(i)))
        .map(|(error, point): (f64, Point3<f64>)| (error, point.y))
        .collect()
}

fn mean_between(profile: &[(f64, f64)], near_m: f64, far_m: f64) -> f64 {
    let inside: Vec<f64> = profile.iter().filter(|(_, d)| (near_m..far_m).contains(d)).map(|(e, _)| *e).collect();
    assert!(inside.len() > 20, "{} pixels between {near_m} and {far_m} m", inside.len());
    inside.iter().sum::<f64>() / inside.len() as f64
}

#[test]
fn ranges_are_too_long_and_more_so_towards_the_corner() {
    let profile = profile(1.0);
    // Every bounced path is longer than the direct one, and by less than half an interval.
    assert!(profile.iter().all(|(error, _)| *error > 0.0));
    let means = [(0.2, 0.5), (0.5, 0.9), (0.9, 1.4), (1.4, 2.2)].map(|(near, far)| mean_between(&profile, near, far));
    println!("mean error by distance from the corner: {means:?} m");
    assert!(means.windows(2).all(|w| w[0] > w[1]), "{means:?}");
    assert!(means[0] > 0.02, "{means:?}");
}

#[test]
fn darker_walls_bend_less() {
    let (bright, dark) = (mean_between(&profile(1.0), 0.2, 0.9), mean_between(&profile(0.25), 0.2, 0.9));
    // The share of bounced light goes with the albedo of the other face: a quarter of it, a little more of the error.
    assert!(dark > 0.2 * bright && dark < 0.35 * bright, "{dark} against {bright}");
}

#[test]
fn light_that_bounces_adds_to_the_mean_sample() {
    let mut spec = fixture("corner_multipath");
    spec.errors.noise = None;
    let with = first(&spec).1;
    spec.errors.multipath = None;
    let without = first(&spec).1;
    let offset = |c: &range_image::ComplexFrame, i: usize| c.channels[0].offset.as_ref().unwrap().as_slice()[i];
    assert!((0..with.flags.len()).all(|i| offset(&with, i) >= offset(&without, i)));
}
