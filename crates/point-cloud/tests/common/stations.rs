//! Stations around the furnished room.

use nalgebra::{Isometry3, Vector3};
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{Pinhole, Scene, frame, look_at};

/// `count` stations on a round that look across the room: clouds with normals, a part `gross` of whose pixels is wrong
/// by metres, and the poses.
pub fn round(count: usize, gross: f64, seed: u64) -> (Vec<Cloud>, Vec<Isometry3<f64>>) {
    let scene = Scene::furnished();
    let poses = round_poses(count);
    let clouds = poses.iter().zip(0_u64..).map(|(pose, k)| cloud(&scene, pose, gross, 100 * seed + k)).collect();
    (clouds, poses)
}

/// Positions on an ellipse, each looking over the middle to the other side.
pub fn round_poses(count: usize) -> Vec<Isometry3<f64>> {
    let pose = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / count as f64;
        let height = 1.45 + 0.15 * (2.0 * angle).sin();
        look_at([1.7 * angle.cos(), 1.3 * angle.sin(), height], [-0.8 * angle.cos(), -0.6 * angle.sin(), 0.8])
    };
    (0..count).map(pose).collect()
}

/// The pose on the opposite side of the room, which sees walls like its own there.
pub fn turned(pose: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::rotation(Vector3::z() * std::f64::consts::PI) * pose
}

/// The cloud of one station of 176 x 144 pixels.
pub fn cloud(scene: &Scene, pose: &Isometry3<f64>, gross: f64, seed: u64) -> Cloud {
    let camera = Pinhole::small();
    let (mut points, sigma) = frame(scene, &camera, pose, 1.0, seed);
    let mut random = Pcg64::seed_from_u64(seed + 500_000);
    for point in &mut points {
        if random.random::<f64>() < gross {
            let range = 0.3 + 4.7 * random.random::<f64>();
            let wrong = Vector3::from(*point).normalize() * range;
            *point = [wrong.x, wrong.y, wrong.z];
        }
    }
    let options = OrganisedNormalOptions::default();
    let normals = organised_normals(&points, camera.width, camera.height, &options).unwrap();
    Cloud::from_frame(&points, Some(&normals), Some(&sigma)).unwrap()
}
