//! Real captures as folders of frames.

use std::path::Path;

use nalgebra::Isometry3;

use crate::Outcome;
use crate::depth_frames::{CENTRES, FOCAL, Sequence, dense_kitchen, living_room};
use crate::files::{Camera, Writer};
use crate::sr4000;

/// Frames of the way through a kitchen.
const KITCHEN: usize = 500;
/// Where the second station stands before the first: from planes through floor, side wall and back wall, good to 2 cm.
const SR4000_STEP_M: [f64; 3] = [-0.009, 0.045, -0.309];

pub fn write(what: &str, folder: &Path) -> Outcome {
    match what {
        // Frame by frame: all of them would fill gigabytes.
        "dense_kitchen" => depth_images(folder, 0, (0..KITCHEN).map_while(|k| dense_kitchen(k..=k))),
        "living_room" => depth_images(folder, 1, living_room().into_iter()),
        "sr4000" => range_images(folder),
        _ => Err(format!("{what}: dense_kitchen, living_room or sr4000").into()),
    }
}

fn depth_images(folder: &Path, camera: usize, sequences: impl Iterator<Item = Sequence>) -> Outcome {
    let camera = Camera { width: 640, height: 480, focal_px: [FOCAL[camera]; 2], centre_px: CENTRES[camera] };
    let mut writer = Writer::new(folder, &camera)?;
    for frame in sequences.flat_map(|sequence| sequence.frames) {
        writer.frame(&frame.points, &frame.world_from_camera)?;
    }
    writer.finish(&[])
}

/// Four frames of the first station, and four of the second.
fn range_images(folder: &Path) -> Outcome {
    let [width, height] = sr4000::SIZE;
    let mut writer = Writer::new(folder, &Camera { width, height, focal_px: [0.0; 2], centre_px: [0.0; 2] })?;
    writer.directions(&(0..width * height).map(sr4000::direction).collect::<Vec<_>>())?;
    let [x, y, z] = SR4000_STEP_M;
    for (station, pose) in [Isometry3::identity(), Isometry3::translation(x, y, z)].iter().enumerate() {
        for stations in (0..4).map_while(|k| sr4000::points(&[k])) {
            writer.frame(&stations[station], pose)?;
        }
    }
    writer.finish(&[])
}
