//! The pixels that belong to one corner.

use nalgebra::{Matrix2, Vector2};
use range_image::Raster;

/// Half the size of a window in steps from node to node: windows meet, so that no pixel counts twice.
const HALF: f64 = 0.5;

/// The same, at most, pixel: the lens bends edges by little over it, and what lies farther adds little.
const LARGEST: f64 = 14.0;

/// Pixels farther than so many pixels from both edges tell levels only, which others tell as well.
const BAND: f64 = 6.0;

/// A pixel of a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pixel {
    /// From the middle of the window.
    pub(super) place: [f64; 2],
    pub(super) value: f64,
    /// How far the edges along columns and rows have bent away along their normals, pixel.
    pub(super) bend: [f64; 2],
}

/// Where a corner is expected, and how the grid runs there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub(super) position: Vector2<f64>,
    /// Steps along columns and rows.
    pub(super) steps: [Vector2<f64>; 2],
    /// Curvature of the edges along columns and rows, 1/pixel, positive where they turn from x to y: a lens bends them.
    pub(super) curvatures: [f64; 2],
}

impl Expected {
    /// Unit normals of the edges along columns and along rows, each towards the other step; `None` where both steps are one
    /// direction.
    pub(super) fn normals(&self) -> Option<[Vector2<f64>; 2]> {
        let [u, v] = self.steps;
        let turn = u.perp(&v).signum();
        let normals = [Vector2::new(-u.y, u.x) * turn, Vector2::new(v.y, -v.x) * turn];
        let normals = normals.map(|normal| normal.try_normalize(0.0));
        Some([normals[0]?, normals[1]?])
    }

    /// The middle of the window: the pixel nearest to the corner.
    pub(super) fn middle(&self) -> Vector2<f64> {
        self.position.map(f64::round)
    }

    /// The pixels with a value between here and half the way to the neighbours. Empty for no numbers.
    pub(super) fn window(&self, image: &Raster<f32>) -> Vec<Pixel> {
        let middle = self.middle();
        let (Some(inverse), Some(normals)) = (inverse(self.steps), self.normals()) else { return Vec::new() };
        let reach = (self.steps[0].abs() + self.steps[1].abs()) * HALF;
        let range = |axis: usize, size: usize| {
            let reach = (reach[axis] + 1.0).min(LARGEST);
            let least = (middle[axis] - reach).ceil().max(0.0) as usize;
            least..((middle[axis] + reach).floor() + 1.0).clamp(0.0, size as f64) as usize
        };
        let mut pixels = Vec::new();
        for row in range(1, image.height()) {
            for col in range(0, image.width()) {
                let at = Vector2::new(col as f64, row as f64);
                let offset = at - self.position;
                let in_window = (inverse * offset).amax() <= HALF;
                let near = normals.iter().any(|normal| normal.dot(&offset).abs() <= BAND);
                let value = f64::from(image.as_slice()[row * image.width() + col]);
                if in_window && near && value.is_finite() {
                    let bend = [0, 1].map(|edge| {
                        let along = self.steps[edge].dot(&offset) / self.steps[edge].norm();
                        let side = self.steps[edge].perp(&normals[edge]).signum();
                        0.5 * side * self.curvatures[edge] * along * along
                    });
                    pixels.push(Pixel { place: (at - middle).into(), value, bend });
                }
            }
        }
        pixels
    }
}

/// From pixels to steps.
fn inverse([u, v]: [Vector2<f64>; 2]) -> Option<Matrix2<f64>> {
    let determinant = u.perp(&v);
    let inverse = Matrix2::new(v.y, -v.x, -u.y, u.x) / determinant;
    inverse.iter().all(|value| value.is_finite()).then_some(inverse)
}
