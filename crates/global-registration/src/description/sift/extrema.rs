//! Extrema of the differences in place and scale.

use nalgebra::{Matrix3, Vector3};

use super::scale_space::{Image, SCALES, ScaleSpace};

/// Pixels at the border without keypoints.
const BORDER: usize = 5;
/// Steps of the refinement, each to a neighbouring sample.
const STEPS: usize = 4;

/// A place in the image with a scale.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keypoint {
    pub(super) octave: usize,
    /// In pixels of the octave.
    pub(super) column: f32,
    pub(super) row: f32,
    /// Within the octave, in units of its steps.
    pub(super) scale: f32,
    pub(super) contrast: f32,
}

impl Keypoint {
    /// Column and row in the whole image, pixels.
    pub(super) fn position_px(&self) -> [f32; 2] {
        let pixel = (self.octave as f32).exp2();
        [self.column * pixel, self.row * pixel]
    }
}

/// Refined extrema with at least this contrast that are no edges.
pub(super) fn extrema(space: &ScaleSpace, min_contrast: f32, max_edge_ratio: f32) -> Vec<Keypoint> {
    let mut found = Vec::new();
    for (octave, images) in space.differences.iter().enumerate() {
        let (width, height) = (images[0].width, images[0].height);
        for scale in 1..=SCALES {
            for row in BORDER..height.saturating_sub(BORDER) {
                for column in BORDER..width.saturating_sub(BORDER) {
                    let value = images[scale].at(column, row);
                    // A weak sample may gain a little by the refinement.
                    if value.abs() > 0.5 * min_contrast && is_extremum(images, scale, column, row, value) {
                        found.extend(refined(images, octave, [column, row, scale], min_contrast, max_edge_ratio));
                    }
                }
            }
        }
    }
    found
}

fn is_extremum(images: &[Image], scale: usize, column: usize, row: usize, value: f32) -> bool {
    let sign = value.signum();
    images[scale - 1..=scale + 1].iter().enumerate().all(|(s, image)| {
        (row - 1..=row + 1).all(|r| {
            (column - 1..=column + 1)
                .all(|c| (s == 1 && r == row && c == column) || sign * image.at(c, r) < sign * value)
        })
    })
}

/// Vertex of the parabola through the sample and its neighbours; moves to a neighbour where that is closer to it.
fn refined(
    images: &[Image],
    octave: usize,
    start: [usize; 3],
    min_contrast: f32,
    max_edge_ratio: f32,
) -> Option<Keypoint> {
    let (width, height) = (images[0].width, images[0].height);
    let mut place = start;
    for _ in 0..STEPS {
        let (gradient, curvature) = derivatives(images, place);
        let offset = -curvature.try_inverse()? * gradient;
        if offset.iter().all(|c| c.abs() <= 0.5) {
            let [column, row, scale] = place;
            let contrast = (images[scale].at(column, row) + 0.5 * gradient.dot(&offset)).abs();
            return (contrast >= min_contrast && !is_edge(&curvature, max_edge_ratio)).then(|| Keypoint {
                octave,
                column: column as f32 + offset.x,
                row: row as f32 + offset.y,
                scale: scale as f32 + offset.z,
                contrast,
            });
        }
        let limits = [(BORDER, width - BORDER), (BORDER, height - BORDER), (1, SCALES + 1)];
        for ((place, step), (low, high)) in place.iter_mut().zip(offset.iter()).zip(limits) {
            let next = *place as f32 + step.clamp(-1.0, 1.0).round();
            if !(low as f32..high as f32).contains(&next) {
                return None;
            }
            *place = next as usize;
        }
    }
    None
}

fn derivatives(images: &[Image], [column, row, scale]: [usize; 3]) -> (Vector3<f32>, Matrix3<f32>) {
    let at = |d: [isize; 3]| {
        let moved = |place: usize, step: isize| place.saturating_add_signed(step);
        images[moved(scale, d[2])].at(moved(column, d[0]), moved(row, d[1]))
    };
    let unit = |k: usize, sign: isize| std::array::from_fn(|i| if i == k { sign } else { 0 });
    let gradient = Vector3::from_fn(|k, _| 0.5 * (at(unit(k, 1)) - at(unit(k, -1))));
    let curvature = Matrix3::from_fn(|i, j| {
        if i == j {
            return at(unit(i, 1)) + at(unit(i, -1)) - 2.0 * at([0; 3]);
        }
        let both = |a: isize, b: isize| {
            let mut step = [0; 3];
            (step[i], step[j]) = (a, b);
            at(step)
        };
        0.25 * (both(1, 1) + both(-1, -1) - both(1, -1) - both(-1, 1))
    });
    (gradient, curvature)
}

fn is_edge(curvature: &Matrix3<f32>, max_ratio: f32) -> bool {
    let trace = curvature[(0, 0)] + curvature[(1, 1)];
    let determinant = curvature[(0, 0)] * curvature[(1, 1)] - curvature[(0, 1)].powi(2);
    determinant <= 0.0 || trace * trace * max_ratio >= (max_ratio + 1.0).powi(2) * determinant
}
