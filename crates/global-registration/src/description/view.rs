//! What was seen from the viewpoint: ranges by direction on the six faces of a cube.

use statistics::upper_median;

use crate::description::fpfh::{dot, subtract};

/// Most cells along the edge of a face.
const MOST: f32 = 256.0;
/// Ranges that differ by more than this many tolerances about a direction belong to several surfaces.
const JUMP: f32 = 3.0;

/// What a map says about a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sight {
    /// In front of what was seen: it would have hidden it.
    InFree,
    /// Where something was seen.
    OnSurface,
    /// Behind what was seen, in a direction that nothing is known of, or at a jump of the range where the point may be hidden
    /// or not.
    Unknown,
}

/// What is said of a point in a direction in which the range jumps, between its two sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Jumps {
    /// Nothing: of two clouds alone, edges that noise moves would speak against a right pose.
    Unknown,
    /// That it misses the surface: among many stations, the outlines of furniture tell which have slid along a wall.
    Missed,
    /// The same, but for points that face away from the viewpoint: of stations in several rooms, what is just behind a wall is the other
    /// side of that wall.
    MissedByFronts,
}

/// Nearest and farthest range in each direction; the nearest also of those about it.
#[derive(Debug, Clone)]
pub(crate) struct View {
    eye: [f32; 3],
    edge: usize,
    nearest: Vec<f32>,
    farthest: Vec<f32>,
    tolerance: f32,
}

impl View {
    /// Map of `points` seen from `eye`, with cells of about `spacing` at the median range.
    pub(crate) fn new(points: &[[f32; 3]], eye: [f32; 3], spacing: f32, tolerance: f32) -> Self {
        let median = upper_median(&mut points.iter().map(|p| length(subtract(*p, eye))).collect::<Vec<f32>>());
        let edge = (2.0 * median / spacing).clamp(1.0, MOST) as usize;
        let cells = 6 * edge * edge;
        let mut view = Self { eye, edge, nearest: vec![f32::INFINITY; cells], farthest: vec![0.0; cells], tolerance };
        for point in points {
            let Some((cell, range)) = view.cell(*point) else { continue };
            view.nearest[cell] = view.nearest[cell].min(range);
            view.farthest[cell] = view.farthest[cell].max(range);
        }
        let faces = view.nearest.chunks_exact(edge * edge);
        view.nearest = faces.flat_map(|face| least_around(face, edge)).collect();
        view
    }

    /// Whether a surface with this normal turns its back on the viewpoint.
    pub(crate) fn is_behind(&self, point: [f32; 3], normal: [f32; 3]) -> bool {
        dot(subtract(point, self.eye), normal) > 0.0
    }

    pub(crate) fn sight(&self, point: [f32; 3], jumps: Jumps) -> Sight {
        let Some((cell, range)) = self.cell(point) else { return Sight::Unknown };
        let (nearest, farthest) = (self.nearest[cell], self.farthest[cell]);
        if farthest <= 0.0 || range > farthest + self.tolerance {
            Sight::Unknown
        } else if range < nearest - self.tolerance {
            Sight::InFree
        } else if jumps == Jumps::Unknown && farthest > nearest + JUMP * self.tolerance {
            Sight::Unknown
        } else {
            Sight::OnSurface
        }
    }

    #[inline]
    fn cell(&self, point: [f32; 3]) -> Option<(usize, f32)> {
        let d = subtract(point, self.eye);
        let [face, cell] = on_cube(d, self.edge)?;
        Some((face * self.edge * self.edge + cell, length(d)))
    }
}

/// Where a direction meets a cube about the viewpoint: the face by the largest coordinate, and its cell by the other two, of `edge` along each
/// edge.
#[inline]
pub(crate) fn on_cube(d: [f32; 3], edge: usize) -> Option<[usize; 2]> {
    let a = d.map(f32::abs);
    let axis = if a[0] >= a[1] && a[0] >= a[2] { 0 } else { 1 + usize::from(a[2] > a[1]) };
    let largest = a[axis];
    // NaN fails the comparison.
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let scale = 0.5 * edge as f32 / largest;
    let place = |c: f32| (((c + largest) * scale) as usize).min(edge - 1);
    let (u, v) = (place(d[(axis + 1) % 3]), place(d[(axis + 2) % 3]));
    Some([2 * axis + usize::from(d[axis] < 0.0), v * edge + u])
}

/// The least of each cell of a face and those about it, for beside a jump of the range nothing is certain; zero where it is not
/// known itself.
pub(crate) fn least_around(cells: &[f32], edge: usize) -> Vec<f32> {
    let least = |(cell, own): (usize, &f32)| {
        if own.is_infinite() {
            return 0.0;
        }
        let (u, v) = (cell % edge, cell / edge);
        let rows = v.saturating_sub(1)..=(v + 1).min(edge - 1);
        let columns = u.saturating_sub(1)..=(u + 1).min(edge - 1);
        rows.flat_map(|row| columns.clone().map(move |column| cells[row * edge + column])).fold(*own, f32::min)
    };
    cells.iter().enumerate().map(least).collect()
}

fn length(d: [f32; 3]) -> f32 {
    dot(d, d).sqrt()
}
