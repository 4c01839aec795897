//! Pairs of frames of which nothing is known, with truth.
#![allow(dead_code, clippy::unwrap_used, missing_docs)]

use global_registration::Error;
use global_registration::{CoarseAlignment, CoarseOptions, FeatureCloud, align_without_guess};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use point_cloud::Cloud;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::common::{Pinhole, Scene, frame_with_mixed_pixels, look_at, pose_error};

/// Two cameras in a scene.
pub struct Pair {
    pub world_from_target: Isometry3<f64>,
    pub world_from_source: Isometry3<f64>,
    /// Fraction of the source's pixels that the target sees.
    pub overlap: f64,
    pub seed: u64,
}

impl Pair {
    pub fn target_from_source(&self) -> Isometry3<f64> {
        self.world_from_target.inverse() * self.world_from_source
    }

    /// Points of target and source in their camera frames.
    pub fn points(&self, scene: &Scene, camera: &Pinhole) -> [Vec<[f64; 3]>; 2] {
        [(&self.world_from_target, 0), (&self.world_from_source, 1)]
            .map(|(pose, k)| frame_with_mixed_pixels(scene, camera, pose, 50_000 + 2 * self.seed + k).0)
    }
}

/// The first pair from `seed` on whose cameras are 1 to 2 m apart, look across the room, are rolled by up to 30 degrees, and
/// overlap by a fraction within `wanted`.
pub fn pair(scene: &Scene, camera: &Pinhole, wanted: std::ops::Range<f64>, seed: u64) -> Pair {
    let mut random = Pcg64::seed_from_u64(100_000 + seed);
    loop {
        let world_from_target = anywhere(scene, &mut random, None);
        let near = Some(world_from_target.translation.vector);
        let world_from_source = anywhere(scene, &mut random, near);
        let found = overlap(scene, camera, &world_from_target, &world_from_source);
        if wanted.contains(&found) {
            return Pair { world_from_target, world_from_source, overlap: found, seed };
        }
    }
}

fn anywhere(scene: &Scene, random: &mut Pcg64, near: Option<Vector3<f64>>) -> Isometry3<f64> {
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    loop {
        let mut position = Vector3::from_fn(|k, _| between(scene.room.low[k] + 0.5, scene.room.high[k] - 0.5));
        position.z = between(1.0, 1.8);
        let apart = near.map_or(1.5, |other| (position - other).norm());
        let blocked =
            scene.boxes.iter().any(|b| (0..3).all(|k| (b.low[k] - 0.3..b.high[k] + 0.3).contains(&position[k])));
        if blocked || !(1.0..2.0).contains(&apart) {
            continue;
        }
        // Not at the wall before it: two thirds of the way across, so that furniture and more than one wall are in view.
        let half = (scene.room.high - scene.room.low) / 2.0;
        let (across, roll) = (between(0.0, std::f64::consts::TAU), between(-0.5, 0.5));
        let at = Vector3::new(0.6 * half.x * across.cos(), 0.6 * half.y * across.sin(), between(0.2, 1.2));
        if (at - position).xy().norm() < 1.5 {
            continue;
        }
        let level = look_at([position.x, position.y, position.z], [at.x, at.y, at.z]);
        return level * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    }
}

/// Fraction of the source's pixels (one in 8 by 8) that the target sees within 2 cm.
pub fn overlap(scene: &Scene, camera: &Pinhole, target: &Isometry3<f64>, source: &Isometry3<f64>) -> f64 {
    let (mut seen, mut all) = (0.0, 0.0);
    for row in (camera.height / 40..camera.height).step_by(camera.height / 20) {
        for column in (camera.width / 40..camera.width).step_by(camera.width / 20) {
            let direction = source.rotation * camera.ray(column, row);
            let origin = source.translation.vector;
            let point = Point3::from(origin + direction * scene.range(&origin, &direction));
            let local = target.inverse_transform_point(&point);
            all += 1.0;
            let half = [camera.width as f64 / 2.0, camera.height as f64 / 2.0];
            let inside = local.z < 0.0
                && (local.x / -local.z * camera.focal_px).abs() < half[0]
                && (local.y / -local.z * camera.focal_px).abs() < half[1];
            let eye = target.translation.vector;
            let range = (point.coords - eye).norm();
            if inside && (scene.range(&eye, &((point.coords - eye) / range)) - range).abs() < 0.02 {
                seen += 1.0;
            }
        }
    }
    seen / all
}

/// A room of random size with random furniture, twelve pieces.
pub fn random_room(seed: u64) -> Scene {
    use crate::common::Cuboid;
    let mut random = Pcg64::seed_from_u64(300_000 + seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let (x, y, z) = (between(2.0, 3.0), between(1.6, 2.4), between(2.3, 2.9));
    let boxes = (0..12).map(|k| {
        let size = [between(0.3, 1.2), between(0.3, 0.9), between(0.3, 1.9)];
        // Along the walls, alternately; every fourth hangs.
        let along = between(-0.8, 0.8);
        let centre = match k % 4 {
            0 => [along * x, y - size[1] / 2.0],
            1 => [along * x, -y + size[1] / 2.0],
            2 => [x - size[0] / 2.0, along * y],
            _ => [-x + size[0] / 2.0, along * y],
        };
        let low = if k % 4 == 3 { between(0.8, 1.2) } else { 0.0 };
        let high = if k % 4 == 3 { low + 0.4 * size[2] } else { size[2] };
        Cuboid::new(
            [centre[0] - size[0] / 2.0, centre[1] - size[1] / 2.0, low],
            [centre[0] + size[0] / 2.0, centre[1] + size[1] / 2.0, high],
        )
    });
    Scene { boxes: boxes.collect(), room: Cuboid::new([-x, -y, 0.0], [x, y, z]) }
}

pub fn prepared(points: &[[f64; 3]], options: &CoarseOptions) -> FeatureCloud {
    FeatureCloud::new(&Cloud::from_frame(points, None, None).unwrap(), options).unwrap()
}

/// What came of a pair.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// Within 5 degrees and 10 cm: distance in millimetre, angle in degree.
    Right(f64, f64, CoarseAlignment),
    Wrong(f64, f64, CoarseAlignment),
    None(Error),
}

pub fn outcome(truth: &Isometry3<f64>, found: Result<CoarseAlignment, Error>) -> Outcome {
    match found {
        Err(error) => Outcome::None(error),
        Ok(found) => {
            let (millimetre, degree) = pose_error(&found.target_from_source, truth);
            if millimetre <= 100.0 && degree <= 5.0 {
                Outcome::Right(millimetre, degree, found)
            } else {
                Outcome::Wrong(millimetre, degree, found)
            }
        }
    }
}

pub fn align_points(
    target: &[[f64; 3]],
    source: &[[f64; 3]],
    options: &CoarseOptions,
) -> Result<CoarseAlignment, Error> {
    align_without_guess(&prepared(source, options), &prepared(target, options), options)
}

pub fn pose(translation: [f64; 3], quaternion_xyzw: [f64; 4]) -> Isometry3<f64> {
    let [x, y, z, w] = quaternion_xyzw;
    let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Translation3::from(translation), rotation)
}
