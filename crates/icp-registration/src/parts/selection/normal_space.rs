//! Selection evenly over the directions of the normals.

use nalgebra::Vector3;

/// Fills every direction's quota: small buckets give all they have, large ones every k-th point.
pub(super) fn normal_space(normals: &[Vector3<f64>], wanted: usize) -> Vec<usize> {
    let mut buckets = vec![Vec::new(); BUCKETS];
    for (i, normal) in normals.iter().enumerate() {
        if let Some(bucket) = bucket(normal) {
            buckets[bucket].push(i);
        }
    }
    buckets.retain(|b| !b.is_empty());
    buckets.sort_by_key(Vec::len);
    let (mut left, mut chosen) = (wanted, Vec::with_capacity(wanted));
    let count = buckets.len();
    for (k, bucket) in buckets.iter().enumerate() {
        let take = bucket.len().min(left / (count - k));
        // Evenly through the bucket.
        chosen.extend((0..take).map(|j| bucket[j * bucket.len() / take]));
        left -= take;
    }
    chosen.sort_unstable();
    chosen
}

const CELLS: usize = 6;
const BUCKETS: usize = 6 * CELLS * CELLS;

/// Cell of the cube that the normal points to.
fn bucket(normal: &Vector3<f64>) -> Option<usize> {
    let axis = normal.iamax();
    let largest = normal[axis];
    if largest.is_nan() || largest.abs() <= 0.0 {
        return None;
    }
    let cell = |v: f64| (((v / largest.abs() + 1.0) * 0.5 * CELLS as f64) as usize).min(CELLS - 1);
    let face = 2 * axis + usize::from(largest < 0.0);
    Some((face * CELLS + cell(normal[(axis + 1) % 3])) * CELLS + cell(normal[(axis + 2) % 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_space_keeps_the_rare_direction() {
        let mut normals = vec![Vector3::z(); 990];
        normals.extend(vec![Vector3::x(); 10]);
        normals.push(Vector3::repeat(f64::NAN));
        let chosen = normal_space(&normals, 100);
        assert_eq!(chosen.len(), 100);
        assert_eq!(chosen.iter().filter(|&&i| i >= 990).count(), 10);
        assert!(chosen.windows(2).all(|w| w[0] < w[1]));
    }
}
