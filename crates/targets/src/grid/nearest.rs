//! Points of an image by place.

use nalgebra::Vector2;

/// Points sorted into square cells, to find those near a place.
#[derive(Debug, Clone)]
pub(crate) struct Places<'a> {
    points: &'a [Vector2<f64>],
    cell: f64,
    least: Vector2<f64>,
    columns: usize,
    rows: usize,
    /// Where the points of each cell begin in `order`, and one more.
    starts: Vec<usize>,
    order: Vec<usize>,
}

impl<'a> Places<'a> {
    /// Sorts points into cells of about one point each. Points that are not finite are never found.
    pub(crate) fn new(points: &'a [Vector2<f64>]) -> Self {
        let finite: Vec<usize> = (0..points.len()).filter(|&k| points[k].iter().all(|v| v.is_finite())).collect();
        let bound = |pick: fn(f64, f64) -> f64, start: f64| {
            finite.iter().fold(Vector2::repeat(start), |bound, &k| points[k].zip_map(&bound, pick))
        };
        let (least, most) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let span = if finite.is_empty() { Vector2::zeros() } else { most - least };
        let cell = (span.x.max(span.y) / (finite.len() as f64).sqrt().max(1.0)).max(1e-9);
        let cells = |length: f64| (length / cell) as usize + 1;
        let (columns, rows) = (cells(span.x), cells(span.y));
        let cell_of = |k: usize| {
            let place = (points[k] - least) / cell;
            place.y as usize * columns + place.x as usize
        };
        let mut order = finite;
        order.sort_by_key(|&k| (cell_of(k), k));
        let mut starts = vec![0; columns * rows + 1];
        for &k in &order {
            starts[cell_of(k) + 1] += 1;
        }
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        Self { points, cell, least, columns, rows, starts, order }
    }

    /// Indices of the points within `radius` of a place, the nearest first.
    pub(crate) fn within(&self, place: Vector2<f64>, radius: f64) -> Vec<usize> {
        let range = |value: f64, least: f64, count: usize| {
            let cell = |bound: f64| (((bound - least) / self.cell).floor().max(-1.0) as isize).min(count as isize);
            (cell(value - radius).max(0) as usize)..((cell(value + radius) + 1).clamp(0, count as isize) as usize)
        };
        let mut found = Vec::new();
        for row in range(place.y, self.least.y, self.rows) {
            for col in range(place.x, self.least.x, self.columns) {
                let index = row * self.columns + col;
                found.extend_from_slice(&self.order[self.starts[index]..self.starts[index + 1]]);
            }
        }
        let distance = |k: &usize| (self.points[*k] - place).norm();
        found.retain(|k| distance(k) <= radius);
        found.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        found
    }
}

impl Places<'_> {
    /// Indices of the `count` nearest points, the nearest first.
    pub(crate) fn nearest(&self, place: Vector2<f64>, count: usize) -> Vec<usize> {
        let count = count.min(self.order.len());
        if count == 0 || !place.iter().all(|value| value.is_finite()) {
            return Vec::new();
        }
        // The circle grows until it holds enough; all points lie within an infinite one.
        let mut radius = self.cell * (count as f64).sqrt();
        loop {
            let mut found = self.within(place, radius);
            if found.len() >= count || radius.is_infinite() {
                found.truncate(count);
                return found;
            }
            radius *= 2.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_points_as_by_trying_all() {
        let points: Vec<_> =
            (0..200).map(|k| Vector2::new(f64::from(k * 37 % 101), 0.3 * f64::from(k * 53 % 97))).collect();
        let places = Places::new(&points);
        for (place, radius) in [([50.0, 10.0], 9.0), ([-5.0, 3.0], 12.0), ([300.0, 3.0], 5.0), ([20.0, 20.0], 1e9)] {
            let place = Vector2::from(place);
            let mut all: Vec<usize> = (0..200).filter(|&k| (points[k] - place).norm() <= radius).collect();
            let mut found = places.within(place, radius);
            assert!(found.windows(2).all(|two| (points[two[0]] - place).norm() <= (points[two[1]] - place).norm()));
            all.sort_unstable();
            found.sort_unstable();
            assert_eq!(found, all);
        }
        let place = Vector2::new(30.0, 12.0);
        assert_eq!(places.nearest(place, 7), places.within(place, 1e9)[..7]);
        assert_eq!(places.nearest(place, 900).len(), 200);
    }

    #[test]
    fn nothing_and_no_numbers_are_nowhere() {
        assert!(Places::new(&[]).within(Vector2::zeros(), 5.0).is_empty());
        let points = [Vector2::new(f64::NAN, 1.0), Vector2::new(1.0, 1.0)];
        let places = Places::new(&points);
        assert_eq!(places.within(Vector2::zeros(), 5.0), [1]);
        assert!(places.within(Vector2::repeat(f64::NAN), 5.0).is_empty());
        assert_eq!(places.within(Vector2::zeros(), f64::INFINITY), [1]);
        assert_eq!(places.nearest(Vector2::zeros(), 3), [1]);
        assert!(places.nearest(Vector2::repeat(f64::NAN), 3).is_empty());
        assert!(Places::new(&[]).nearest(Vector2::zeros(), 3).is_empty());
    }
}
