//! A checkerboard as it is printed.

use super::render::Pattern;

/// A checkerboard on white paper: node (0, 0) at the origin, x right, y up, the field beyond it dark.
pub struct PrintedBoard {
    /// Inner corners.
    pub columns: usize,
    pub rows: usize,
    pub square_m: f64,
    /// White about the outer fields, fields.
    pub margin: f64,
    pub dark: f64,
    pub bright: f64,
}

impl PrintedBoard {
    pub fn new(columns: usize, rows: usize, square_m: f64) -> Self {
        Self { columns, rows, square_m, margin: 1.0, dark: 0.1, bright: 0.9 }
    }
}

impl Pattern for PrintedBoard {
    fn reflectance(&self, [x, y]: [f64; 2], footprint: [[f64; 2]; 2]) -> Option<f64> {
        // Fields from the board's upper left corner.
        let place = [x / self.square_m + 1.0, 1.0 - y / self.square_m];
        let sizes = [self.columns as f64 + 1.0, self.rows as f64 + 1.0];
        let paper = |axis: usize| place[axis] >= -self.margin && place[axis] <= sizes[axis] + self.margin;
        if !(paper(0) && paper(1)) {
            return None;
        }
        let width = |axis: usize| ((footprint[0][axis].abs() + footprint[1][axis].abs()) / self.square_m).max(1e-12);
        let inside = |axis: usize| covered(place[axis], width(axis)) * covered(sizes[axis] - place[axis], width(axis));
        let alternating = wave(place[0], width(0)) * wave(place[1], width(1));
        let dark = inside(0) * inside(1) * 0.5 * (1.0 + alternating);
        Some(self.bright + (self.dark - self.bright) * dark)
    }
}

/// Share of a sample of a width beyond an edge that lies at zero.
fn covered(distance: f64, width: f64) -> f64 {
    (distance / width + 0.5).clamp(0.0, 1.0)
}

/// +1 from 0 to 1, -1 from 1 to 2 and so on, mean over the width.
fn wave(place: f64, width: f64) -> f64 {
    let edge = place.round();
    let beyond = if edge.rem_euclid(2.0) < 0.5 { 1.0 } else { -1.0 };
    beyond * (2.0 * covered(place - edge, width) - 1.0)
}
