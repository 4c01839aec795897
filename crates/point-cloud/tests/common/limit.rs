//! What the noise allows: the bound of Cramér and Rao for surfaces that nothing is known of but that they are plane
//! within small cells. Pixels that see more than one face know nothing.
#![allow(dead_code)]

use std::collections::BTreeMap;

use nalgebra::{
    DMatrix, Dyn, Isometry3, Matrix3, Matrix6, Matrix6x3, OMatrix, Point3, SymmetricEigen, U3, Vector3, Vector6,
};

use super::{Cuboid, Pinhole, Scene, sigma_of};

/// Edge of the cells, metre.
const CELL_M: f64 = 0.1;

/// Sums over the points of a station in a cell: products of the derivatives by the plane (offset and two tilts), by the
/// motion, and between both.
#[derive(Clone, Default)]
struct Seen {
    plane: Matrix3<f64>,
    mixed: Matrix6x3<f64>,
    motion: Matrix6<f64>,
}

/// A cell of a face: cell indices, and the axis of the face's normal.
type Key = ([i64; 3], usize);

/// Information of all stations about their motions `[dt, dθ]` about their perspective centres, axes of the room.
pub fn information(scene: &Scene, camera: &Pinhole, poses: &[Isometry3<f64>]) -> DMatrix<f64> {
    let count = poses.len();
    let mut cells: BTreeMap<Key, Vec<Seen>> = BTreeMap::new();
    for (station, pose) in poses.iter().enumerate() {
        add_station(scene, camera, pose, station, count, &mut cells);
    }
    let mut information = DMatrix::zeros(6 * count, 6 * count);
    for seen in cells.values() {
        let mut mixed = OMatrix::<f64, Dyn, U3>::zeros(6 * count);
        for (k, own) in seen.iter().enumerate() {
            let mut block = information.fixed_view_mut::<6, 6>(6 * k, 6 * k);
            block += own.motion;
            mixed.fixed_view_mut::<6, 3>(6 * k, 0).copy_from(&own.mixed);
        }
        // How the surface of the cell lies is unknown: what all see in common says nothing.
        let common = SymmetricEigen::new(seen.iter().map(|s| s.plane).sum::<Matrix3<f64>>());
        for (value, vector) in common.eigenvalues.iter().zip(common.eigenvectors.column_iter()) {
            // Below: rounding, of cells whose few points leave a tilt open.
            if *value > 1e-9 * common.eigenvalues.max() {
                let column = &mixed * vector;
                information.ger(-1.0 / value, &column, &column, 1.0);
            }
        }
    }
    information
}

/// Standard deviation of the least known motion of one frame against another, metre at the rms radius of what the frame
/// sees, about its centroid; infinite where a motion is not determined.
pub fn pair_sigma_m(scene: &Scene, camera: &Pinhole, target: &Isometry3<f64>, source: &Isometry3<f64>) -> f64 {
    let information = information(scene, camera, &[*target, *source]);
    let Some(inverse) = information.fixed_view::<6, 6>(6, 6).cholesky().map(|c| c.inverse()) else {
        return f64::INFINITY;
    };
    let eye = source.translation.vector;
    let points: Vec<Vector3<f64>> = (0..camera.width * camera.height)
        .step_by(7)
        .map(|k| source.rotation * camera.ray(k % camera.width, k / camera.width))
        .map(|direction| eye + direction * scene.range(&eye, &direction))
        .collect();
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let radius = (points.iter().map(|p| (p - centre).norm_squared()).sum::<f64>() / points.len() as f64).sqrt();
    // dt' = dt + w x (centre - eye), and the turn as a length at the radius.
    let mut to_centre = Matrix6::identity();
    to_centre.fixed_view_mut::<3, 3>(0, 3).copy_from(&-(centre - eye).cross_matrix());
    to_centre.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Matrix3::identity() * radius));
    let covariance = to_centre * inverse * to_centre.transpose();
    covariance.symmetric_eigenvalues().max().sqrt()
}

fn add_station(
    scene: &Scene,
    camera: &Pinhole,
    pose: &Isometry3<f64>,
    station: usize,
    count: usize,
    cells: &mut BTreeMap<Key, Vec<Seen>>,
) {
    let eye = pose.translation.vector;
    for pixel in 0..camera.width * camera.height {
        let (col, row) = ((pixel % camera.width) as f64, (pixel / camera.width) as f64);
        let met = |col: f64, row: f64| {
            let direction = pose.rotation * camera.ray_at(col, row);
            let range = scene.range(&eye, &direction);
            let point = Point3::from(eye + direction * range);
            face(scene, &point).map(|face| (point, direction, range, face))
        };
        let Some((point, direction, range, (axis, level))) = met(col, row) else { continue };
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
        let same = |(x, y)| met(col + x, row + y).is_some_and(|m| m.3.0 == axis && (m.3.1 - level).abs() < 1e-6);
        if !corners.into_iter().all(same) {
            continue;
        }
        let normal = Vector3::ith(axis, 1.0);
        let sigma = sigma_of(range) * normal.dot(&direction).abs();
        let turn = (point.coords - eye).cross(&normal);
        let motion = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
        let weight = sigma.powi(-2);
        let key = (<[i64; 3]>::from(point.coords.map(|c| (c / CELL_M + 1e-4).floor() as i64)), axis);
        // Place within the cell, in units of its edge.
        let within = point.coords / CELL_M - Vector3::from(key.0.map(|k| k as f64 + 0.5));
        let plane = Vector3::new(1.0, within[(axis + 1) % 3], within[(axis + 2) % 3]);
        let seen = &mut cells.entry(key).or_insert_with(|| vec![Seen::default(); count])[station];
        seen.plane += plane * plane.transpose() * weight;
        seen.mixed += motion * plane.transpose() * weight;
        seen.motion += motion * motion.transpose() * weight;
    }
}

/// The face that a point lies on: axis of its normal and position along it.
fn face(scene: &Scene, point: &Point3<f64>) -> Option<(usize, f64)> {
    let on = |cuboid: &Cuboid| {
        let inside = |k: usize| point[k] > cuboid.low[k] - 1e-9 && point[k] < cuboid.high[k] + 1e-9;
        let at = |k: usize| (point[k] - cuboid.low[k]).abs().min((point[k] - cuboid.high[k]).abs()) < 1e-9;
        (0..3).find(|&k| at(k) && (0..3).all(inside)).map(|k| (k, point[k]))
    };
    scene.boxes.iter().find_map(on).or_else(|| on(&scene.room))
}
