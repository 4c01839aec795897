//! The nearest fused point in each direction from a perspective centre: the six faces of a cube.

use nalgebra::{Point3, Vector3};

use crate::outcome::Surfel;

/// Pixels along an edge of the cube: 1.4°, a surfel of 5 cm at 2 m. Finer ones have holes far away, coarser ones hide edges.
const EDGE: usize = 64;
/// Least cosine between normal and ray: more inclined discs hide or show by the error of their normal.
const LEAST_FACING: f64 = 0.2;
const NOTHING: u32 = u32::MAX;

/// Nearest surfels by direction.
pub(crate) struct Map {
    nearest: Vec<u32>,
}

/// Where a direction meets the cube.
#[derive(Debug, Clone, Copy)]
struct Place {
    face: usize,
    u: f64,
    v: f64,
}

impl Place {
    fn of(direction: &Vector3<f64>) -> Option<Self> {
        let axis = direction.iamax();
        let depth = direction[axis].abs();
        if depth.is_nan() || depth <= 0.0 {
            return None;
        }
        let face = 2 * axis + usize::from(direction[axis] < 0.0);
        Some(Self { face, u: direction[(axis + 1) % 3] / depth, v: direction[(axis + 2) % 3] / depth })
    }

    fn pixel(value: f64) -> usize {
        ((value + 1.0) * 0.5 * EDGE as f64).clamp(0.0, (EDGE - 1) as f64) as usize
    }

    fn index(&self) -> usize {
        (self.face * EDGE + Self::pixel(self.v)) * EDGE + Self::pixel(self.u)
    }
}

/// Direction through the middle of a pixel.
fn direction(face: usize, column: usize, row: usize) -> Vector3<f64> {
    let middle = |at: usize| (at as f64 + 0.5) * 2.0 / EDGE as f64 - 1.0;
    let axis = face / 2;
    let mut direction = Vector3::zeros();
    direction[axis] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    direction[(axis + 1) % 3] = middle(column);
    direction[(axis + 2) % 3] = middle(row);
    direction
}

impl Map {
    pub fn new(surfels: &[Surfel], centre: &Point3<f64>) -> Self {
        let mut map = Self { nearest: vec![NOTHING; 6 * EDGE * EDGE] };
        let mut ranges = vec![f64::INFINITY; 6 * EDGE * EDGE];
        for (at, surfel) in surfels.iter().enumerate() {
            map.draw(&mut ranges, at as u32, surfel, centre);
        }
        map
    }

    fn draw(&mut self, ranges: &mut [f64], at: u32, surfel: &Surfel, centre: &Point3<f64>) {
        let sight = surfel.position - centre;
        let range_m = sight.norm();
        let height = surfel.normal.dot(&sight);
        let Some(place) = Place::of(&sight).filter(|_| -height > LEAST_FACING * range_m) else { return };
        let mut mark = |index: usize, range: f64| {
            if range < ranges[index] {
                ranges[index] = range;
                self.nearest[index] = at;
            }
        };
        mark(place.index(), range_m);
        let size = surfel.radius_m / range_m * (1.0 + place.u * place.u + place.v * place.v);
        for row in Place::pixel(place.v - size)..=Place::pixel(place.v + size) {
            for column in Place::pixel(place.u - size)..=Place::pixel(place.u + size) {
                let direction = direction(place.face, column, row);
                let along = height / surfel.normal.dot(&direction);
                let foot = direction * along - sight;
                if along > 0.0 && foot.norm_squared() <= surfel.radius_m * surfel.radius_m {
                    mark((place.face * EDGE + row) * EDGE + column, along * direction.norm());
                }
            }
        }
    }

    /// The nearest surfel in a direction.
    fn toward(&self, direction: &Vector3<f64>) -> Option<u32> {
        let at = self.nearest[Place::of(direction)?.index()];
        (at != NOTHING).then_some(at)
    }

    /// The nearest surfels around a direction.
    pub fn around(&self, direction: &Vector3<f64>) -> impl Iterator<Item = u32> + '_ {
        let step = 2.0 / EDGE as f64;
        let place = Place::of(direction);
        let of_face = move |place: Place| {
            let axis = place.face / 2;
            let sign = if place.face.is_multiple_of(2) { 1.0 } else { -1.0 };
            (-1..=1).flat_map(move |row| {
                (-1..=1).map(move |column| {
                    let mut aside = Vector3::zeros();
                    aside[axis] = sign;
                    aside[(axis + 1) % 3] = place.u + step * f64::from(column);
                    aside[(axis + 2) % 3] = place.v + step * f64::from(row);
                    aside
                })
            })
        };
        place.into_iter().flat_map(of_face).filter_map(|aside| self.toward(&aside))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_where_their_directions_say() {
        for face in 0..6 {
            for (column, row) in [(0, 0), (3, 60), (63, 31)] {
                let place = Place::of(&direction(face, column, row));
                assert_eq!(place.map(|place| place.index()), Some((face * EDGE + row) * EDGE + column));
            }
        }
        assert!(Place::of(&Vector3::zeros()).is_none());
        assert!(Place::of(&Vector3::repeat(f64::NAN)).is_none());
    }
}
