//! Two views of one room, turned and moved, and nothing known of how: `cargo run -p global-registration --example no_guess`.

#![allow(clippy::print_stdout)]

use std::error::Error;

use global_registration::point_cloud::Cloud;
use global_registration::{CoarseOptions, FeatureCloud, align_without_guess};
use nalgebra::{Isometry3, Vector3};

/// Middle and half size of the things in the room, metre; the room itself is the last.
const BOXES: [([f64; 3], [f64; 3]); 5] = [
    ([-0.9, -0.7, -2.6], [0.4, 0.5, 0.3]),
    ([0.7, -0.9, -2.2], [0.3, 0.3, 0.5]),
    ([0.2, 0.5, -3.1], [0.5, 0.2, 0.2]),
    ([1.3, 0.2, -3.0], [0.2, 1.0, 0.3]),
    ([0.0, 0.2, -1.0], [1.9, 1.4, 2.5]),
];

/// How far a ray leads to the nearest surface of a box, from outside or from within.
fn to_box((middle, half): &([f64; 3], [f64; 3]), eye: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let at = |side: f64| (middle[axis] + side * half[axis] - eye[axis]) / along[axis];
        (enters, leaves) = (enters.max(at(-1.0).min(at(1.0))), leaves.min(at(-1.0).max(at(1.0))));
    }
    let nearest = if enters > 0.0 { enters } else { leaves };
    if enters <= leaves && nearest > 0.0 { nearest } else { f64::INFINITY }
}

/// The points that 120 by 100 rays meet, in the camera's axes (x right, y up, looking along -z), metre.
fn seen_from(world_from_camera: &Isometry3<f64>) -> Result<Cloud, Box<dyn Error>> {
    let pixel = |index: usize| {
        let ray = Vector3::new(((index % 120) as f64 - 59.5) / 80.0, (49.5 - (index / 120) as f64) / 80.0, -1.0);
        let (eye, along) = (world_from_camera.translation.vector, world_from_camera.rotation * ray);
        let depth = BOXES.iter().map(|thing| to_box(thing, &eye, &along)).fold(f64::INFINITY, f64::min);
        (ray * depth).into()
    };
    let points: Vec<[f64; 3]> = (0..120 * 100).map(pixel).collect();
    Ok(Cloud::from_frame(&points, None, None)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let truth = Isometry3::new(Vector3::new(0.4, -0.1, 0.2), Vector3::new(0.05, 0.25, 0.1));
    let options = CoarseOptions::default();
    let target = FeatureCloud::new(&seen_from(&Isometry3::identity())?, &options)?;
    let source = FeatureCloud::new(&seen_from(&truth)?, &options)?;
    // What is no answer is an error that says why: too little in common, or a scene that fits twice.
    let found = align_without_guess(&source, &target, &options)?;
    let off = found.target_from_source.translation.vector - truth.translation.vector;
    println!("found to {:.0} mm with voxels of {:.0} mm", 1e3 * off.norm(), 1e3 * found.voxel_m);
    println!(
        "{:.0} % in common, another pose fits as well with a probability of {:.2}",
        100.0 * found.overlap,
        found.rival
    );
    Ok(())
}
