//! Pairs of clouds with truth, and clouds that do not determine a pose.
#![allow(dead_code)]

use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use point_cloud::Cloud;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::common::scenes::open_scene;
use crate::common::{Cuboid, Pinhole, Scene, disturbance, frame_with_mixed_pixels, look_at};

/// A cloud of bare points: nothing of the frame is left but the points' order.
pub fn bare(points: &[[f64; 3]]) -> Cloud {
    Cloud::new(points.iter().map(|p| (*p).into()).collect())
}

/// Source, target and truth of two views of the furnished room.
pub struct Views {
    pub source: Cloud,
    pub target: Cloud,
    pub target_from_source: Isometry3<f64>,
}

/// What is common to two views: its share of the pixels of `source` (3 cm), and how well it determines the pose: the
/// smallest eigenvalue of the mean of `J J^T`, J the derivative of the distance along the true normal with respect to
/// motions about the centre of the common points, rotations multiplied by their radius (1/6 would be perfect).
fn common(scene: &Scene, camera: &Pinhole, target: &Isometry3<f64>, source: &Isometry3<f64>) -> (f64, f64) {
    let origin = source.translation.vector;
    let hit = |col: f64, row: f64| {
        let direction = source.rotation * camera.ray_at(col, row);
        origin + direction * scene.range(&origin, &direction)
    };
    let (mut common, mut all) = (vec![], 0);
    for row in (0..camera.height).step_by(6) {
        for col in (0..camera.width).step_by(6) {
            let point = hit(col as f64, row as f64);
            let there = target.inverse() * Point3::from(point);
            let (x, y) = (camera.focal_px * there.x / -there.z, camera.focal_px * there.y / -there.z);
            let inside = x.abs() < camera.width as f64 / 2.0 && y.abs() < camera.height as f64 / 2.0;
            let ray = point - target.translation.vector;
            let visible = scene.range(&target.translation.vector, &ray.normalize()) > ray.norm() - 0.03;
            if there.z < 0.0 && inside && visible {
                let right = hit(col as f64 + 0.01, row as f64) - point;
                common.push((point, right.cross(&(hit(col as f64, row as f64 + 0.01) - point)).normalize()));
            }
            all += 1;
        }
    }
    let n = common.len().max(1) as f64;
    let centre = common.iter().fold(Vector3::zeros(), |sum, (p, _)| sum + p / n);
    let radius = common.iter().map(|(p, _)| (p - centre).norm_squared() / n).sum::<f64>().sqrt();
    let information = common.iter().fold(Matrix6::zeros(), |sum, (p, normal)| {
        let turn = ((p - centre) / radius).cross(normal);
        let j = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
        sum + j * j.transpose() / n
    });
    (n / f64::from(all), information.symmetric_eigenvalues().min())
}

/// Views of which the common part is one wall and a floor determine no pose, whoever looks at them.
const WEAKEST: f64 = 0.002;

/// Two views of the furnished room of which 45 to 55 % is common.
pub fn half_overlapping(camera: &Pinhole, seed: u64) -> Views {
    let scene = Scene::furnished();
    let mut random = Pcg64::seed_from_u64(500_000 + seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    loop {
        let angle = between(0.0, std::f64::consts::TAU);
        let position = [0.9 * angle.cos(), 0.6 * angle.sin(), between(1.1, 1.7)];
        let turned = angle + std::f64::consts::PI + between(-0.6, 0.6);
        let at = [2.2 * turned.cos(), 1.8 * turned.sin(), between(0.3, 0.9)];
        let target = look_at(position, at);
        let other = turned + between(-0.7, 0.7);
        let elsewhere = [0, 1, 2].map(|k| position[k] + between(-0.4, 0.4));
        let source = look_at(elsewhere, [2.2 * other.cos(), 1.8 * other.sin(), between(0.3, 0.9)]);
        let (share, weakest) = common(&scene, camera, &target, &source);
        if (0.45..0.55).contains(&share) && weakest > WEAKEST {
            return views(&scene, camera, &target, &source, 2 * seed);
        }
    }
}

/// Two views of a scene with noise and mixed pixels.
pub fn views(scene: &Scene, camera: &Pinhole, target: &Isometry3<f64>, source: &Isometry3<f64>, seed: u64) -> Views {
    let cloud = |pose: &Isometry3<f64>, seed| bare(&frame_with_mixed_pixels(scene, camera, pose, seed).0);
    Views {
        target: cloud(target, 600_000 + seed),
        source: cloud(source, 600_001 + seed),
        target_from_source: target.inverse() * source,
    }
}

/// The same two views with other noise each time.
pub fn repeated(camera: &Pinhole, seed: u64) -> Views {
    let target = look_at([0.9, 0.3, 1.4], [-2.0, -0.4, 0.6]);
    let source = target * disturbance(0.15, 5.0, 77);
    views(&Scene::furnished(), camera, &target, &source, 2 * seed)
}

/// Only the wall at x = 3 m is in view; two translations and a rotation are free.
pub fn one_wall(camera: &Pinhole, seed: u64) -> Views {
    let scene = Scene { room: Cuboid::new([-30.0, -30.0, -30.0], [3.0, 30.0, 30.0]), boxes: vec![] };
    let (a, b) = (look_at([0.0, 0.0, 0.0], [3.0, 0.2, 0.1]), look_at([0.1, 0.2, -0.1], [3.0, 0.3, 0.3]));
    views(&scene, camera, &a, &b, 2 * seed)
}

/// Wall and floor without an end; the translation along their edge is free.
pub fn wall_and_floor(camera: &Pinhole, seed: u64) -> Views {
    let scene = Scene { room: Cuboid::new([-1e3, -1e3, 0.0], [3.0, 1e3, 1e3]), boxes: vec![] };
    let (a, b) = (look_at([0.0, 0.0, 1.4], [3.0, 0.2, 0.3]), look_at([0.1, 0.2, 1.5], [3.0, 0.3, 0.4]));
    views(&scene, camera, &a, &b, 2 * seed)
}

/// Two walls, floor and ceiling without an end; the translation along x is free.
pub fn corridor(camera: &Pinhole, seed: u64) -> Views {
    let scene = Scene { room: Cuboid::new([-1e3, -1.0, 0.0], [1e3, 1.0, 2.4]), boxes: vec![] };
    let (a, b) = (look_at([0.0, 0.2, 1.4], [1.5, -1.0, 0.6]), look_at([0.2, 0.1, 1.3], [1.8, -1.0, 0.5]));
    views(&scene, camera, &a, &b, 2 * seed)
}

/// Two walls that face each other; as one wall.
pub fn parallel_walls(_: &Pinhole, seed: u64) -> Views {
    shared(2, seed)
}

/// Three rotations are free.
pub fn sphere(_: &Pinhole, seed: u64) -> Views {
    shared(3, seed)
}

/// Along and about the axis it is free.
pub fn cylinder(_: &Pinhole, seed: u64) -> Views {
    shared(4, seed)
}

/// The scenes of the other registrations as bare points.
fn shared(kind: usize, seed: u64) -> Views {
    let (_, source, target, target_from_source, _) = open_scene(kind, seed);
    Views { source: Cloud::new(source.points), target: Cloud::new(target.points), target_from_source }
}

/// Guess that is off by `metre` in place and `degrees` in direction at the middle of the source.
pub fn far_off(views: &Views, metre: f64, degrees: f64, seed: u64) -> Isometry3<f64> {
    let n = views.source.len() as f64;
    let centre = views.source.points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords / n);
    let error = disturbance(metre, degrees, 800_000 + seed);
    let at_centre = nalgebra::Translation3::from(centre);
    views.target_from_source * at_centre * error * at_centre.inverse()
}
