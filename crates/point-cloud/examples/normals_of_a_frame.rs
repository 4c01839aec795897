//! Normals of a frame that sees a wall and a step in it: none reaches over the step.

#![allow(clippy::print_stdout)]

use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};

fn main() -> Result<(), point_cloud::Error> {
    let (width, height) = (64, 48);
    let pixel = |k: usize| {
        let (u, v) = ((k % width) as f64 / 60.0 - 0.53, (k / width) as f64 / 60.0 - 0.4);
        let depth = if k % width < 32 { 3.0 } else { 2.5 };
        [u * depth, -v * depth, -depth]
    };
    let points: Vec<[f64; 3]> = (0..width * height).map(pixel).collect();
    let normals = organised_normals(&points, width, height, &OrganisedNormalOptions::default())?;
    let with = normals.iter().filter(|normal| normal.x.is_finite()).count();
    let cloud = Cloud::from_frame(&points, Some(&normals), None)?;
    println!("{with} of {} points have a normal", cloud.len());
    println!("in the middle of the left wall: {:.3?}", normals[24 * width + 16].as_slice());
    Ok(())
}
