//! Variation of the albedo over a surface.

use nalgebra::Vector3;

use crate::spec::scene::TextureSpec;

/// Factor on the albedo at a point of the shape's own frame, where the surface has the given normal.
pub(crate) fn factor(texture: &TextureSpec, point: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    match *texture {
        TextureSpec::Checker { size_m, factor } => {
            let [a, b] = on_surface(point, normal).map(|v| (v / size_m).floor());
            if (a + b).rem_euclid(2.0) < 0.5 { 1.0 } else { factor }
        }
        TextureSpec::Discs { spacing_m, radius_m, factor, first_m } => {
            let [a, b] = on_surface(point, normal);
            let [a, b] = [a - first_m[0], b - first_m[1]].map(|v| v - (v / spacing_m).round() * spacing_m);
            if a.hypot(b) <= radius_m { 1.0 } else { factor }
        }
        TextureSpec::Noise { size_m, contrast, seed } => 1.0 + contrast * value_noise(&(point / size_m), seed),
    }
}

/// The two coordinates along the surface: those of the axes that are not nearest to its normal.
fn on_surface(point: &Vector3<f64>, normal: &Vector3<f64>) -> [f64; 2] {
    match normal.iamax() {
        0 => [point.y, point.z],
        1 => [point.x, point.z],
        _ => [point.x, point.y],
    }
}

/// Smooth noise in -1..1: values at the nodes of the unit lattice, interpolated with zero slope at the nodes.
fn value_noise(point: &Vector3<f64>, seed: u64) -> f64 {
    let base = point.map(f64::floor);
    let weight = (point - base).map(|t| t * t * (3.0 - 2.0 * t));
    let mut sum = 0.0;
    for corner in 0..8_u8 {
        let mut share = 1.0;
        let mut node = [0_i64; 3];
        for axis in 0..3 {
            let high = corner >> axis & 1;
            share *= if high == 1 { weight[axis] } else { 1.0 - weight[axis] };
            node[axis] = (base[axis] as i64).wrapping_add(i64::from(high));
        }
        sum += share * node_value(node, seed);
    }
    sum
}

fn node_value(node: [i64; 3], seed: u64) -> f64 {
    let key = node.iter().fold(seed, |key, coordinate| crate::random::mix(key, *coordinate as u64));
    // The top 53 bits as a fraction of 1.
    (key >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}
