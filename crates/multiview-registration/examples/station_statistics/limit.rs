//! What the noise allows: bounds of Cramér and Rao for surfaces of which nothing is known but that they are plane.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6, Matrix6x3, Point3, Vector3, Vector6};

use crate::common::stations::round_poses;
use crate::common::{Cuboid, Pinhole, Scene, sigma_of};

/// Edge of the cells, metre.
const CELL_M: f64 = 0.1;

/// What is plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// Cells of known direction, their offsets unknown.
    Cells,
    /// Whole faces of room and furniture, offsets and slopes unknown.
    Faces,
}

/// Weighted sums over the points of a station on one plane: with their place `[1, u, v]` on it.
#[derive(Clone, Default)]
struct Seen {
    cross: Matrix6x3<f64>,
    square: Matrix6<f64>,
    plane: Matrix3<f64>,
}

/// Box, face, and cell indices.
type Key = (usize, usize, [i64; 3]);

/// Standard deviations of the stations against the first.
pub struct Limit {
    /// Position of each but the first, millimetre.
    pub mm: Vec<f64>,
    /// Rotation, degree.
    pub degrees: Vec<f64>,
}

impl Limit {
    pub fn rms_mm(&self) -> f64 {
        (self.mm.iter().map(|mm| mm * mm).sum::<f64>() / self.mm.len() as f64).sqrt()
    }
}

pub fn cramer_rao(count: usize, plane: Plane) -> Option<Limit> {
    let (scene, poses) = (Scene::furnished(), round_poses(count));
    let mut planes: BTreeMap<Key, Vec<Seen>> = BTreeMap::new();
    for (station, pose) in poses.iter().enumerate() {
        add_station(&scene, pose, (station, count), plane, &mut planes);
    }
    let mut information = DMatrix::zeros(6 * count, 6 * count);
    for seen in planes.values() {
        let of_plane: Matrix3<f64> = seen.iter().map(|s| s.plane).sum();
        let inverse = inverse(&of_plane, plane);
        for (a, first) in seen.iter().enumerate() {
            let mut block = information.fixed_view_mut::<6, 6>(6 * a, 6 * a);
            block += first.square;
            for (b, second) in seen.iter().enumerate() {
                // Where the surface lies is unknown: what all see in common says nothing.
                let mut block = information.fixed_view_mut::<6, 6>(6 * a, 6 * b);
                block -= first.cross * inverse * second.cross.transpose();
            }
        }
    }
    let covariance = information.view((6, 6), (6 * count - 6, 6 * count - 6)).into_owned().try_inverse()?;
    let sigma = |part: usize| -> Vec<f64> {
        let variance = |k: usize| (0..3).map(|c| covariance[(6 * k + part + c, 6 * k + part + c)]).sum::<f64>();
        (0..count - 1).map(|k| variance(k).sqrt()).collect()
    };
    let (mm, degrees) = (sigma(0).iter().map(|s| 1e3 * s).collect(), sigma(3).iter().map(|s| s.to_degrees()).collect());
    Some(Limit { mm, degrees })
}

fn inverse(of_plane: &Matrix3<f64>, plane: Plane) -> Matrix3<f64> {
    let offset = || Matrix3::from_diagonal(&Vector3::new(1.0 / of_plane[(0, 0)], 0.0, 0.0));
    match plane {
        Plane::Cells => offset(),
        Plane::Faces => of_plane.try_inverse().unwrap_or_else(offset),
    }
}

fn add_station(
    scene: &Scene,
    pose: &Isometry3<f64>,
    (station, count): (usize, usize),
    plane: Plane,
    planes: &mut BTreeMap<Key, Vec<Seen>>,
) {
    let (camera, eye) = (Pinhole::small(), pose.translation.vector);
    for pixel in 0..camera.width * camera.height {
        let direction = pose.rotation * camera.ray(pixel % camera.width, pixel / camera.width);
        let range = scene.range(&eye, &direction);
        let point = Point3::from(eye + direction * range);
        let Some((cuboid, face)) = face(scene, &point) else { continue };
        let axis = face / 2;
        let normal = Vector3::ith(axis, 1.0);
        let weight = (sigma_of(range) * normal.dot(&direction).abs()).powi(-2);
        let turn = (point.coords - eye).cross(&normal);
        let row = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
        let place = Vector3::new(1.0, point[(axis + 1) % 3], point[(axis + 2) % 3]);
        let cell = match plane {
            Plane::Cells => <[i64; 3]>::from(point.coords.map(|c| (c / CELL_M + 1e-4).floor() as i64)),
            Plane::Faces => [0; 3],
        };
        let seen = &mut planes.entry((cuboid, face, cell)).or_insert_with(|| vec![Seen::default(); count])[station];
        seen.cross += row * place.transpose() * weight;
        seen.square += row * row.transpose() * weight;
        seen.plane += place * place.transpose() * weight;
    }
}

/// The box (0: the room) and the face, two an axis, that a point lies on.
fn face(scene: &Scene, point: &Point3<f64>) -> Option<(usize, usize)> {
    let on = |cuboid: &Cuboid| {
        let inside = |k: usize| point[k] > cuboid.low[k] - 1e-9 && point[k] < cuboid.high[k] + 1e-9;
        let at = |k: usize, end: &Vector3<f64>| (point[k] - end[k]).abs() < 1e-9;
        let faces = (0..6).filter(|face| at(face / 2, if face % 2 == 0 { &cuboid.low } else { &cuboid.high }));
        faces.into_iter().find(|_| (0..3).all(inside))
    };
    let mut boxes = scene.boxes.iter().enumerate();
    boxes.find_map(|(k, cuboid)| on(cuboid).map(|face| (k + 1, face))).or_else(|| on(&scene.room).map(|face| (0, face)))
}
