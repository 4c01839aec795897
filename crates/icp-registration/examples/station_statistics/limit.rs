//! What the noise allows: the bound of Cramér and Rao for surfaces that nothing is known of but that they are plane
//! within small cells.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point3, Vector3, Vector6};

use crate::common::stations::round_poses;
use crate::common::{Cuboid, Pinhole, Scene, sigma_of};

/// Edge of the cells, metre.
const CELL_M: f64 = 0.1;

/// Weight of the points of a station in a cell, and its sums with their derivatives.
#[derive(Clone, Default)]
struct Seen {
    weight: f64,
    first: Vector6<f64>,
    second: Matrix6<f64>,
}

/// A cell of a face: cell indices, and the axis of the face's normal.
type Key = ([i64; 3], usize);

/// Standard deviations of the least known station against the first: position in millimetre and rotation in degree.
pub fn cramer_rao(count: usize) -> (f64, f64) {
    let (scene, poses) = (Scene::furnished(), round_poses(count));
    let mut cells: BTreeMap<Key, Vec<Seen>> = BTreeMap::new();
    for (station, pose) in poses.iter().enumerate() {
        add_station(&scene, pose, station, count, &mut cells);
    }
    let mut information = DMatrix::zeros(6 * count, 6 * count);
    for seen in cells.values() {
        let weight: f64 = seen.iter().map(|s| s.weight).sum();
        let mut mean = DVector::zeros(6 * count);
        for (k, own) in seen.iter().enumerate() {
            let mut block = information.fixed_view_mut::<6, 6>(6 * k, 6 * k);
            block += own.second;
            mean.fixed_rows_mut::<6>(6 * k).copy_from(&own.first);
        }
        // Where the surface of the cell lies is unknown: what all see in common says nothing.
        information.ger(-1.0 / weight, &mean, &mean, 1.0);
    }
    let free = information.view((6, 6), (6 * count - 6, 6 * count - 6)).into_owned();
    let Some(covariance) = free.try_inverse() else { return (f64::INFINITY, f64::INFINITY) };
    let sigma = |k: usize, part: usize| (0..3).map(|c| covariance[(6 * k + part + c, 6 * k + part + c)]).sum::<f64>();
    let largest = |part: usize| (0..count - 1).map(|k| sigma(k, part).sqrt()).fold(0.0, f64::max);
    (1e3 * largest(0), largest(3).to_degrees())
}

fn add_station(
    scene: &Scene,
    pose: &Isometry3<f64>,
    station: usize,
    count: usize,
    cells: &mut BTreeMap<Key, Vec<Seen>>,
) {
    let (camera, eye) = (Pinhole::small(), pose.translation.vector);
    for pixel in 0..camera.width * camera.height {
        let direction = pose.rotation * camera.ray(pixel % camera.width, pixel / camera.width);
        let range = scene.range(&eye, &direction);
        let point = Point3::from(eye + direction * range);
        let Some(axis) = face(scene, &point) else { continue };
        let normal = Vector3::ith(axis, 1.0);
        let sigma = sigma_of(range) * normal.dot(&direction).abs();
        let turn = (point.coords - eye).cross(&normal);
        let row = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
        let weight = sigma.powi(-2);
        let key = (<[i64; 3]>::from(point.coords.map(|c| (c / CELL_M + 1e-4).floor() as i64)), axis);
        let seen = &mut cells.entry(key).or_insert_with(|| vec![Seen::default(); count])[station];
        seen.weight += weight;
        seen.first += row * weight;
        seen.second += row * row.transpose() * weight;
    }
}

/// Axis of the normal of the face that a point lies on.
fn face(scene: &Scene, point: &Point3<f64>) -> Option<usize> {
    let on = |cuboid: &Cuboid| {
        let inside = |k: usize| point[k] > cuboid.low[k] - 1e-9 && point[k] < cuboid.high[k] + 1e-9;
        let at = |k: usize| (point[k] - cuboid.low[k]).abs().min((point[k] - cuboid.high[k]).abs()) < 1e-9;
        (0..3).find(|&k| at(k) && (0..3).all(inside))
    };
    scene.boxes.iter().find_map(on).or_else(|| on(&scene.room))
}
