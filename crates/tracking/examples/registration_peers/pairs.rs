//! What a method reaches over pairs of frames.

use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;

use crate::common::pose_error;
use crate::cpu_clock::cpu_seconds;
use crate::files::Frames;
use crate::{Failure, Outcome};

/// A frame's points, NaN where there is none.
pub type Points = Vec<[f64; 3]>;
/// A pose, or why there is none.
pub type Found = Result<Isometry3<f64>, Failure>;

/// Aligns the pairs, from raw points to the pose of the source in the target, and prints medians of the CPU time in
/// milliseconds, of degrees and millimetres off, and how many pairs are within `limits` of these two. A pair without an
/// answer is infinitely far off.
pub fn compare(
    name: &str,
    frames: &Frames,
    pairs: &[[usize; 2]],
    limits: [f64; 2],
    mut align: impl FnMut(&Points, &Points) -> Found,
) -> Outcome {
    let mut columns = [const { Vec::new() }; 3];
    let mut good = 0;
    for &[target, source] in pairs {
        let points = [frames.points(target)?, frames.points(source)?];
        let start = cpu_seconds();
        let found = align(&points[0], &points[1]);
        let milliseconds = 1e3 * (cpu_seconds() - start);
        let truth = frames.truth([target, source]);
        let (millimetre, degree) = found.map_or((f64::INFINITY, f64::INFINITY), |pose| pose_error(&pose, &truth));
        good += usize::from(degree < limits[0] && millimetre < limits[1]);
        for (column, value) in columns.iter_mut().zip([milliseconds, degree, millimetre]) {
            column.push(value);
        }
    }
    let [milliseconds, degree, millimetre] = columns.map(median);
    println!("{name} {milliseconds} {degree} {millimetre} {good}");
    Ok(())
}

/// A cloud of the points that there are.
pub fn cloud(points: &Points) -> Cloud {
    Cloud::new(points.iter().filter(|point| point[0].is_finite()).map(|&point| Point3::from(point)).collect())
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = |place: usize| values.get(place).copied().unwrap_or(f64::NAN);
    f64::midpoint(middle(values.len().saturating_sub(1) / 2), middle(values.len() / 2))
}
