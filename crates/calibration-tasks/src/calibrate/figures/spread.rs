//! A few of many places that are spread as widely as possible.

use nalgebra::Vector3;

/// Indices of at most `most` places, in ascending order: the first, and then always the one furthest from those chosen. All
/// where there are no more; a fixed stride would pick places of one kind where kinds alternate.
pub(crate) fn spread(places: &[Vector3<f64>], most: usize) -> Vec<usize> {
    if places.len() <= most {
        return (0..places.len()).collect();
    }
    let mut nearest = vec![f64::INFINITY; places.len()];
    let mut chosen = Vec::with_capacity(most);
    let mut next = 0;
    while chosen.len() < most {
        chosen.push(next);
        for (distance, place) in nearest.iter_mut().zip(places) {
            *distance = distance.min((place - places[next]).norm_squared());
        }
        nearest[next] = f64::NEG_INFINITY;
        let furthest = nearest.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
        next = furthest.map_or(0, |(index, _)| index);
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_come_first() {
        let grid: Vec<Vector3<f64>> = (0..25).map(|k| Vector3::new(f64::from(k % 5), f64::from(k / 5), 0.0)).collect();
        assert_eq!(spread(&grid, 4), [0, 4, 20, 24]);
        assert_eq!(spread(&grid, 30).len(), 25);
        assert_eq!(spread(&[Vector3::zeros(); 9], 3).len(), 3, "places that are one");
    }
}
