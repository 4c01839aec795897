//! Frames of a furnished room with noise and mixed pixels, as everyone gets them.

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::Outcome;
use crate::common::{Cuboid, Pinhole, Scene, disturbance, frame_pair, frame_with_mixed_pixels, look_at};
use crate::files::{Camera, Writer};

/// Frames that a camera takes on its way round the room.
const TRACKED: usize = 300;
/// Stations on a ring.
const STATIONS: usize = 16;
/// Pairs with motions too large for any method that needs a guess.
const COARSE: usize = 14;
/// Share of a frame that the other of such a pair sees too.
const OVERLAP: [f64; 2] = [0.4, 0.6];

pub fn write(what: &str, folder: &Path) -> Outcome {
    match what {
        "large" => pairs(&Pinhole::large(), 10, folder),
        "medium" => pairs(&Pinhole::medium(), 20, folder),
        "coarse" => coarse(folder),
        "degenerate" => degenerate(folder),
        "tracking" => tracking(folder),
        "stations" => stations(folder),
        _ => Err(format!("{what}: no such frames").into()),
    }
}

fn pairs(camera: &Pinhole, count: u64, folder: &Path) -> Outcome {
    let mut writer = Writer::new(folder, &Camera::from(camera))?;
    for k in 0..count {
        let pair = frame_pair(camera, k);
        writer.frame(&pair.target.0, &Isometry3::identity())?;
        writer.frame(&pair.source.0, &pair.target_from_source)?;
    }
    writer.finish(&[])
}

/// Pairs whose views differ by 1 to 2 m and 20 to 60 degrees, and share half of what they see.
fn coarse(folder: &Path) -> Outcome {
    let (scene, camera) = (Scene::furnished(), Pinhole::large());
    let mut writer = Writer::new(folder, &Camera::from(&camera))?;
    let mut drawn = 0..;
    for k in 0..COARSE {
        let [target, source] = drawn
            .by_ref()
            .map(distant_views)
            .find(|poses| {
                let shared = shared(&scene, poses).min(shared(&scene, &[poses[1], poses[0]]));
                (OVERLAP[0]..OVERLAP[1]).contains(&shared)
            })
            .ok_or("no such views")?;
        for (side, pose) in [target, source].iter().enumerate() {
            let (points, _) = frame_with_mixed_pixels(&scene, &camera, pose, 50_000 + 2 * k as u64 + side as u64);
            writer.frame(&points, pose)?;
        }
    }
    writer.finish(&[])
}

/// Two views from about the middle of the room, the second one disturbed.
fn distant_views(seed: u64) -> [Isometry3<f64>; 2] {
    let mut random = Pcg64::seed_from_u64(30_000 + seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let angle = between(0.0, TAU);
    let position = [0.9 * angle.cos(), 0.6 * angle.sin(), between(1.1, 1.7)];
    let at = [-2.2 * angle.cos(), -1.8 * angle.sin(), between(0.3, 0.9)];
    let target = look_at(position, at);
    [target, target * disturbance(between(1.0, 2.0), between(20.0, 60.0), 40_000 + seed)]
}

/// The share of rays of the second view that end where the first one sees as well; none if it stands in a wall.
fn shared(scene: &Scene, [first, second]: &[Isometry3<f64>; 2]) -> f64 {
    let camera = Pinhole { width: 31, height: 23, focal_px: 26.0 };
    let inside = |low: &Vector3<f64>, high: &Vector3<f64>, point: &Vector3<f64>| {
        (0..3).all(|axis| low[axis] < point[axis] && point[axis] < high[axis])
    };
    let eye = second.translation.vector;
    let margin = Vector3::repeat(0.3);
    let free = |solid: &Cuboid| !inside(&(solid.low - margin), &(solid.high + margin), &eye);
    if !inside(&(scene.room.low + margin), &(scene.room.high - margin), &eye) || !scene.boxes.iter().all(free) {
        return 0.0;
    }
    let mut seen = 0;
    for pixel in 0..camera.width * camera.height {
        let direction = second.rotation * camera.ray(pixel % camera.width, pixel / camera.width);
        let point = eye + direction * scene.range(&eye, &direction);
        let there = first.inverse_transform_vector(&(point - first.translation.vector));
        let half = |size: usize| size as f64 / 2.0;
        let (x, y) = (camera.focal_px * there.x / -there.z, camera.focal_px * there.y / -there.z);
        if there.z < 0.0 && x.abs() < half(camera.width) && y.abs() < half(camera.height) {
            let back = point - first.translation.vector;
            let range = scene.range(&first.translation.vector, &back.normalize());
            seen += usize::from((range - back.norm()).abs() < 0.02);
        }
    }
    seen as f64 / (camera.width * camera.height) as f64
}

/// A wall that fills the view, and a wall with the floor: the first pair can slide along two directions and turn about
/// the normal, the second can slide along the edge.
fn degenerate(folder: &Path) -> Outcome {
    let empty = Scene { room: Cuboid::new([-20.0, -20.0, 0.0], [20.0, 2.0, 20.0]), boxes: Vec::new() };
    let camera = Pinhole::medium();
    let mut writer = Writer::new(folder, &Camera::from(&camera))?;
    for (k, at) in [[0.0, 2.0, 10.0], [0.0, 2.0, 0.2]].into_iter().enumerate() {
        let height = if k == 0 { 10.0 } else { 1.4 };
        let target = look_at([0.0, 0.0, height], at);
        let source = target * disturbance(0.1, 3.0, 60 + k as u64);
        for (side, pose) in [target, source].iter().enumerate() {
            let (points, _) = frame_with_mixed_pixels(&empty, &camera, pose, 60_000 + (2 * k + side) as u64);
            writer.frame(&points, pose)?;
        }
    }
    writer.finish(&[])
}

/// Once round the room, looking across it, in ten seconds at 30 frames a second.
fn tracking(folder: &Path) -> Outcome {
    let (scene, camera) = (Scene::furnished(), Pinhole::medium());
    let mut writer = Writer::new(folder, &Camera::from(&camera))?;
    for k in 0..TRACKED {
        let angle = TAU * k as f64 / TRACKED as f64;
        // A hand trembles.
        let shake = [2.9, 4.3, 7.1].map(|rate: f64| 0.01 * (rate * k as f64 / 10.0).sin());
        let position =
            [0.9 * angle.cos() + shake[0], 0.6 * angle.sin() + shake[1], 1.4 + 0.2 * (2.0 * angle).sin() + shake[2]];
        let across = angle + std::f64::consts::PI + 0.3 * (3.0 * angle).sin();
        let pose = look_at(position, [2.2 * across.cos(), 1.8 * across.sin(), 0.6]);
        writer.frame(&frame_with_mixed_pixels(&scene, &camera, &pose, 70_000 + k as u64).0, &pose)?;
    }
    writer.finish(&[])
}

/// A ring of stations that look down into the room; they are known to 3 cm and 2 degrees.
fn stations(folder: &Path) -> Outcome {
    let (scene, camera) = (Scene::furnished(), Pinhole::medium());
    let mut writer = Writer::new(folder, &Camera::from(&camera))?;
    let mut starts = Vec::new();
    for k in 0..STATIONS {
        let angle = TAU * k as f64 / STATIONS as f64;
        // From above the edges towards the middle: no pair sees one wall only.
        let position = [1.7 * angle.cos(), 1.4 * angle.sin(), 2.0];
        let pose = look_at(position, [-0.4 * angle.cos(), -0.3 * angle.sin(), 0.2]);
        writer.frame(&frame_with_mixed_pixels(&scene, &camera, &pose, 80_000 + k as u64).0, &pose)?;
        let off = if k == 0 { Isometry3::identity() } else { disturbance(0.03, 2.0, 81_000 + k as u64) };
        starts.push(pose * off);
    }
    writer.finish(&[("starts.txt", starts)])
}
