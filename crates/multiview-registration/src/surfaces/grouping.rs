//! Points into groups: those of one cell of space whose normals agree and which lie on one plane.

use nalgebra::{Point3, Vector3};

use point_cloud::Cloud;

/// Cosine of the largest angle between the normals of a group (30 degrees).
const SAME_DIRECTION: f64 = 0.866;
/// Part of the cell that the points of a group may be off the plane of its first points.
const THICKNESS: f64 = 0.35;
/// Points per patch that the size of the patches is chosen for.
pub(crate) const POINTS_PER_PATCH: f64 = 25.0;

/// A group on its way.
struct Group {
    normal: Vector3<f64>,
    sum: Vector3<f64>,
    points: Vec<u32>,
}

/// Groups of point indices, in ascending order of cells and within a cell of their first points. Points without normal
/// and those marked as rim belong to none.
pub(crate) fn group(cloud: &Cloud, normals: &[Vector3<f64>], size_m: f64) -> Vec<Vec<u32>> {
    let usable = |i: usize| normals[i].x.is_finite() && !cloud.rim.as_ref().is_some_and(|rim| rim[i]);
    let keyed = by_cells(cloud, usable, size_m);
    let mut groups = Vec::new();
    for run in keyed.chunk_by(|a, b| a.0 == b.0) {
        groups.extend(groups_of_cell(cloud, normals, run, size_m).into_iter().map(|group| group.points));
    }
    groups
}

/// The usable points with the cells of space that they lie in, cell by cell, ascending.
pub(crate) fn by_cells(cloud: &Cloud, usable: impl Fn(usize) -> bool, size_m: f64) -> Vec<([i64; 3], u32)> {
    let keyed = (0..cloud.len()).filter(|&i| usable(i)).map(|i| (cell(&cloud.points[i], size_m), i as u32));
    let mut keyed: Vec<_> = keyed.collect();
    keyed.sort_unstable();
    keyed
}

/// The cell of space that a point lies in.
fn cell(point: &Point3<f64>, size_m: f64) -> [i64; 3] {
    <[f64; 3]>::from(point.coords).map(|x| (x / size_m).floor() as i64)
}

fn groups_of_cell(cloud: &Cloud, normals: &[Vector3<f64>], run: &[([i64; 3], u32)], size_m: f64) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for &(_, index) in run {
        let (point, normal) = (cloud.points[index as usize].coords, normals[index as usize]);
        let belongs = |group: &&mut Group| {
            let direction = group.normal / group.normal.norm();
            let mean = group.sum / group.points.len() as f64;
            // The sign of normals does not count where nothing is known of the viewpoint.
            direction.dot(&normal).abs() >= SAME_DIRECTION && direction.dot(&(point - mean)).abs() <= THICKNESS * size_m
        };
        if let Some(group) = groups.iter_mut().find(belongs) {
            group.normal += if group.normal.dot(&normal) < 0.0 { -normal } else { normal };
            group.sum += point;
            group.points.push(index);
        } else {
            groups.push(Group { normal, sum: point, points: vec![index] });
        }
    }
    groups
}

/// Size of patches that hold about 25 points on average, metre, from the area that the points cover.
pub(crate) fn patch_size(cloud: &Cloud) -> f64 {
    let n = cloud.len() as f64;
    let centre = cloud.points.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords / n);
    let square: f64 = cloud.points.iter().map(|p| (p.coords - centre).norm_squared() / n).sum();
    let cell_m = square.sqrt() / 12.0;
    if cell_m <= 0.0 {
        return 1.0;
    }
    let mut cells: Vec<[i64; 3]> = cloud.points.iter().map(|point| cell(point, cell_m)).collect();
    cells.sort_unstable();
    cells.dedup();
    // A plane meets about one and a half cells per area of a cell's face.
    let area = cells.len() as f64 / 1.5 * cell_m * cell_m;
    (POINTS_PER_PATCH * area / n).sqrt()
}
