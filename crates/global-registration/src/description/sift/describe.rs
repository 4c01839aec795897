//! Orientation and descriptor of a keypoint from the gradients about it.

use std::f32::consts::TAU;

use super::extrema::Keypoint;
use super::scale_space::{Image, ScaleSpace, sigma_of};

const ORIENTATION_BINS: usize = 36;
/// Further peaks of the orientations count from this fraction of the highest on.
const PEAK: f32 = 0.8;
const CELLS: usize = 4;
const DIRECTIONS: usize = 8;
/// Edge of a cell in units of the keypoint's blur.
const CELL_SIGMAS: f32 = 3.0;
/// Largest entry of the unit vector: strong gradients change most with the light.
const LARGEST_ENTRY: f32 = 0.2;

/// Directions of the strongest gradients, radian; each makes a feature of its own.
pub(super) fn orientations(space: &ScaleSpace, keypoint: &Keypoint) -> Vec<f32> {
    let sigma = 1.5 * sigma_of(keypoint.scale);
    let mut histogram = [0.0_f32; ORIENTATION_BINS];
    for_gradients(image_of(space, keypoint), keypoint, 3.0 * sigma, |d, gradient| {
        let weight = (-0.5 * (d[0] * d[0] + d[1] * d[1]) / (sigma * sigma)).exp();
        let turn = gradient[1].atan2(gradient[0]) / TAU + 1.0;
        let bin = (turn * ORIENTATION_BINS as f32).round() as usize % ORIENTATION_BINS;
        histogram[bin] += weight * gradient[0].hypot(gradient[1]);
    });
    let around = |h: &[f32; ORIENTATION_BINS], i: usize, step: usize| h[(i + step) % ORIENTATION_BINS];
    for _ in 0..2 {
        let old = histogram;
        for (i, value) in histogram.iter_mut().enumerate() {
            *value = (around(&old, i, ORIENTATION_BINS - 1) + old[i] + around(&old, i, 1)) / 3.0;
        }
    }
    let highest = histogram.iter().copied().fold(0.0, f32::max);
    let peak = |i: usize| {
        let (before, own, after) =
            (around(&histogram, i, ORIENTATION_BINS - 1), histogram[i], around(&histogram, i, 1));
        let is_peak = own > before && own >= after && own >= PEAK * highest;
        // Vertex of the parabola through the three.
        let offset = 0.5 * (before - after) / (before - 2.0 * own + after);
        is_peak.then_some((i as f32 + offset) / ORIENTATION_BINS as f32 * TAU)
    };
    (0..ORIENTATION_BINS).filter_map(peak).collect()
}

/// Gradients about the keypoint, turned by `angle`, in 4 x 4 cells and 8 directions; each counts in the eight nearest
/// entries.
pub(super) fn descriptor(space: &ScaleSpace, keypoint: &Keypoint, angle: f32) -> [f32; 128] {
    let cell = CELL_SIGMAS * sigma_of(keypoint.scale);
    let (sine, cosine) = angle.sin_cos();
    let half = CELLS as f32 / 2.0;
    let mut entries = [0.0_f32; CELLS * CELLS * DIRECTIONS];
    let reach = cell * (half + 0.5) * std::f32::consts::SQRT_2;
    for_gradients(image_of(space, keypoint), keypoint, reach, |d, gradient| {
        let u = (cosine * d[0] + sine * d[1]) / cell;
        let v = (cosine * d[1] - sine * d[0]) / cell;
        let direction = (gradient[1].atan2(gradient[0]) - angle).rem_euclid(TAU) / TAU * DIRECTIONS as f32;
        let weight = (-0.5 * (u * u + v * v) / (half * half)).exp() * gradient[0].hypot(gradient[1]);
        spread(&mut entries, [u + half - 0.5, v + half - 0.5, direction], weight);
    });
    normalise(&mut entries);
    for value in &mut entries {
        *value = value.min(LARGEST_ENTRY);
    }
    normalise(&mut entries);
    entries
}

/// Adds a weight to the entries about a place, linearly in all three coordinates; directions are cyclic.
fn spread(entries: &mut [f32; 128], place: [f32; 3], weight: f32) {
    let low = place.map(f32::floor);
    for corner in 0..8 {
        let step = [corner & 1, corner >> 1 & 1, corner >> 2];
        let mut share = weight;
        for k in 0..3 {
            let fraction = place[k] - low[k];
            share *= if step[k] == 1 { fraction } else { 1.0 - fraction };
        }
        let [u, v, direction] = std::array::from_fn(|k| low[k] as i32 + step[k]);
        let cells = 0..CELLS as i32;
        if cells.contains(&u) && cells.contains(&v) {
            let direction = direction.rem_euclid(DIRECTIONS as i32) as usize;
            entries[(v as usize * CELLS + u as usize) * DIRECTIONS + direction] += share;
        }
    }
}

fn normalise(entries: &mut [f32; 128]) {
    let length = entries.iter().map(|v| v * v).sum::<f32>().sqrt();
    if length > 0.0 {
        for value in entries {
            *value /= length;
        }
    }
}

fn image_of<'a>(space: &'a ScaleSpace, keypoint: &Keypoint) -> &'a Image {
    let octave = &space.blurred[keypoint.octave];
    &octave[(keypoint.scale.round() as usize).min(octave.len() - 1)]
}

/// Hands every gradient within the reach over, with the distance from the keypoint in pixels.
fn for_gradients(image: &Image, keypoint: &Keypoint, reach: f32, mut take: impl FnMut([f32; 2], [f32; 2])) {
    let range = |middle: f32, length: usize| {
        let low = (middle - reach).ceil().max(1.0) as usize;
        let high = (middle + reach).floor().min(length as f32 - 2.0) as usize;
        low..=high
    };
    for row in range(keypoint.row, image.height) {
        for column in range(keypoint.column, image.width) {
            let d = [column as f32 - keypoint.column, row as f32 - keypoint.row];
            if d[0] * d[0] + d[1] * d[1] <= reach * reach {
                take(d, image.gradient(column, row));
            }
        }
    }
}
