//! Grids of dots as they are printed.

use targets::CircleGrid;

use super::render::Pattern;

/// Dots on paper, and what of them is hidden.
pub struct PrintedDots<'a> {
    pub grid: CircleGrid,
    pub radius_m: f64,
    pub dark: f64,
    pub bright: f64,
    /// Nodes without a dot.
    pub hidden: &'a dyn Fn([usize; 2]) -> bool,
    /// Whether x is mirrored.
    pub mirrored: bool,
    /// The node with the larger dot, if there is one.
    pub mark: [usize; 2],
}

impl PrintedDots<'_> {
    pub fn new(grid: CircleGrid, radius_m: f64) -> Self {
        Self { grid, radius_m, dark: 0.1, bright: 0.9, hidden: &|_| false, mirrored: false, mark: [0, 0] }
    }
}

impl Pattern for PrintedDots<'_> {
    fn reflectance(&self, [x, y]: [f64; 2], footprint: [[f64; 2]; 2]) -> Option<f64> {
        let x = if self.mirrored { -x } else { x };
        let (spacing, margin) = (self.grid.spacing_m(), 1.5 * self.grid.spacing_m());
        let last = self.grid.node_m([self.grid.columns() - 1, self.grid.rows() - 1]);
        let right = last.x + if self.grid.is_staggered() { spacing } else { 0.0 };
        if x < -margin || x > right + margin || y > margin || y < last.y - margin {
            return None;
        }
        let width = footprint.iter().map(|[dx, dy]| dx.hypot(*dy)).fold(1e-12, f64::max);
        let near = |value: f64, count: usize| {
            let middle = (value / spacing).round() as i64;
            (middle - 2..=middle + 2).filter(move |k| (0..count as i64).contains(k)).map(|k| k as usize)
        };
        let step = if self.grid.is_staggered() { 0.5 } else { 1.0 };
        let mut covered: f64 = 0.0;
        for j in near(-y, self.grid.rows()) {
            for i in near(x * step, self.grid.columns()) {
                let node = self.grid.node_m([i, j]);
                let is_origin = [i, j] == self.mark;
                let radius = self.radius_m * self.grid.origin_dot().filter(|_| is_origin).unwrap_or(1.0);
                let off = (x - node.x).hypot(y - node.y) - radius;
                if !(self.hidden)([i, j]) {
                    covered = covered.max((0.5 - off / width).clamp(0.0, 1.0));
                }
            }
        }
        Some(self.bright + (self.dark - self.bright) * covered)
    }
}
