//! The two surfaces at both sides of a mixed pixel, continued to it.

use range_image::{RangeFrame, Raster};

/// Row, column and the two diagonals, as steps of `(column, row)`.
const DIRECTIONS: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];
/// Largest distance of the first pixel that a surface is continued from, behind mixed ones.
const FARTHEST_START: isize = 3;
/// Most pixels that a surface is continued from. A choice; more follow curved surfaces less, fewer carry more noise to
/// the pixel.
const MOST_SUPPORT: usize = 6;
/// Differences that noise explains, in standard deviations. By chance one pixel in sixteen thousand.
const SAME_SURFACE_SIGMAS: f64 = 4.0;
/// Smallest difference in range of two surfaces, metre; half of it is what a curved one does from pixel to pixel. A choice for
/// rooms seen by cameras of 10^5 pixels; a smaller one splits pixels of slanted surfaces, a larger one leaves steps whole.
const LEAST_JUMP_M: f64 = 0.05;

/// A range that was not measured but continued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Continued {
    pub range_m: f64,
    pub sigma_m: f64,
}

/// Two surfaces at different ranges, the nearer one first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sides {
    pub foreground: Continued,
    pub background: Continued,
}

impl Sides {
    fn variance(&self) -> f64 {
        self.foreground.sigma_m.powi(2) + self.background.sigma_m.powi(2)
    }

    fn jump_m(&self) -> f64 {
        self.background.range_m - self.foreground.range_m
    }
}

/// What is around a mixed pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Around {
    /// Two surfaces in at least one direction.
    Two,
    /// A surface at each side, but one and the same.
    Same,
    /// Not a surface at both sides in any direction.
    Unknown,
}

/// Looks for surfaces around the mixed pixels of one frame.
pub(crate) struct SurfaceFinder<'a> {
    pub frame: &'a RangeFrame,
    pub mixed: &'a Raster<bool>,
    /// Standard deviation of a range where the frame gives none, metre.
    pub unknown_sigma_m: f64,
    /// What surfaces do beside a straight line, metre.
    pub floor_m: f64,
}

/// A pixel of a surface: distance from the mixed one in steps, range, variance.
type Support = (f64, f64, f64);

impl SurfaceFinder<'_> {
    /// The pairs of surfaces at both sides, in all directions that have one; the best known pair first.
    pub fn around(&self, col: usize, row: usize, out: &mut Vec<Sides>) -> Around {
        out.clear();
        let mut same = false;
        for step in DIRECTIONS {
            let [Some(a), Some(b)] = [-1, 1].map(|side| self.continued(col, row, step.map(|s| s * side))) else {
                continue;
            };
            let (foreground, background) = if a.range_m < b.range_m { (a, b) } else { (b, a) };
            let sides = Sides { foreground, background };
            let noise = SAME_SURFACE_SIGMAS * sides.variance().sqrt();
            if sides.jump_m() > noise.max(LEAST_JUMP_M) {
                out.push(sides);
            } else {
                same = true;
            }
        }
        out.sort_by(|a, b| a.variance().total_cmp(&b.variance()));
        match (out.is_empty(), same) {
            (false, _) => Around::Two,
            (true, true) => Around::Same,
            (true, false) => Around::Unknown,
        }
    }

    /// The surface in the direction of a step, continued to the pixel straight in inverse range: as planes are.
    fn continued(&self, col: usize, row: usize, step: [isize; 2]) -> Option<Continued> {
        let first = (1..=FARTHEST_START).find(|count| self.at(col, row, step, *count).is_some())?;
        // The first pixel may be mixed a little, too little to be found: better without it.
        let surface = [first + 1, first].into_iter().find_map(|start| self.straight_from(col, row, step, start));
        if let Some(surface) = surface {
            let sigma_m = surface.sigma_m.hypot(self.floor_m);
            return Some(Continued { sigma_m, ..surface });
        }
        // A surface too narrow to know its slope.
        let (distance, range_m, variance) = self.at(col, row, step, first)?;
        let slope = 0.5 * LEAST_JUMP_M * distance;
        Some(Continued { range_m, sigma_m: (variance + slope * slope).sqrt() })
    }

    /// The line through as many pixels as lie on one, three at least, from a first one on.
    fn straight_from(&self, col: usize, row: usize, step: [isize; 2], start: isize) -> Option<Continued> {
        let mut support = [(0.0, 0.0, 0.0); MOST_SUPPORT];
        let mut count = 0;
        for place in &mut support {
            let Some(pixel) = self.at(col, row, step, start + count as isize) else { break };
            *place = pixel;
            count += 1;
        }
        let length = (3..=count).rev().find(|length| self.is_straight(&support[..*length]))?;
        line(&support[..length], 0.0)
    }

    /// Whether each pixel is where all others say.
    fn is_straight(&self, support: &[Support]) -> bool {
        (0..support.len()).all(|index| {
            let (distance, range, variance) = support[index];
            let mut others = [(0.0, 0.0, 0.0); MOST_SUPPORT];
            let rest = support.iter().enumerate().filter(|(other, _)| *other != index);
            others.iter_mut().zip(rest).for_each(|(place, (_, pixel))| *place = *pixel);
            line(&others[..support.len() - 1], distance).is_some_and(|expected| {
                let noise = SAME_SURFACE_SIGMAS * (variance + expected.sigma_m.powi(2)).sqrt();
                (range - expected.range_m).abs() <= noise + self.floor_m
            })
        })
    }

    /// The pixel some steps away; `None` outside the frame, where it is mixed and where there is no positive range.
    fn at(&self, col: usize, row: usize, [dx, dy]: [isize; 2], count: isize) -> Option<Support> {
        let (col, row) = (col.checked_add_signed(dx * count)?, row.checked_add_signed(dy * count)?);
        let range = f64::from(*self.frame.range.get(col, row)?);
        let sigma = f64::from(self.frame.sigma[(col, row)]);
        let sigma = if sigma.is_finite() { sigma } else { self.unknown_sigma_m };
        let usable = range > 0.0 && range.is_finite() && !self.mixed[(col, row)];
        usable.then_some((count as f64, range, sigma * sigma))
    }
}

/// A straight line through inverse ranges, at a distance. Two points at least.
fn line(support: &[Support], distance: f64) -> Option<Continued> {
    let count = support.len() as f64;
    let mean = support.iter().map(|(x, _, _)| x).sum::<f64>() / count;
    let spread: f64 = support.iter().map(|(x, _, _)| (x - mean).powi(2)).sum();
    let (mut inverse, mut variance) = (0.0, 0.0);
    for (x, range, range_variance) in support {
        let weight = 1.0 / count + (distance - mean) * (x - mean) / spread;
        inverse += weight / range;
        variance += weight * weight * range_variance / range.powi(4);
    }
    let range_m = 1.0 / inverse;
    (inverse > 0.0 && range_m.is_finite()).then(|| Continued { range_m, sigma_m: range_m * range_m * variance.sqrt() })
}
