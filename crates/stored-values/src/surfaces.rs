//! Smooth surfaces of a frame, and how far each is bent from what a plane makes of ranges to what it makes of depths.

use camera_model::RayTable;
use nalgebra::{Matrix3, Vector3};
use range_image::Raster;

use crate::{Error, Result};

/// Cells of a window in one direction: enough that the residuals tell their own scatter.
const CELLS: usize = 12;
/// Pixels of a cell in one direction, at least: of fewer, noise takes the place of the surface.
const SMALLEST_CELL_PX: usize = 3;
/// Times that the image is halved: windows of a sixteenth of the image bend by less than noise.
const HALVINGS: usize = 3;
/// Part of a cell's pixels, and of a window's cells, that must have a value.
const FILLED: f64 = 0.6;
/// Largest spread of the values in a cell, as a part of their mean: an edge runs through it.
const CELL_SPREAD: f64 = 0.2;
/// Cells whose residual is larger than so many robust deviations belong to something else.
const TRIM: f64 = 4.0;
/// Residuals of a surface's cells, as a part of the range: the periodic errors of range cameras stay below it, furniture
/// does not. Larger, the surfaces scatter more and less is told; smaller, cameras that are not calibrated have none.
const SMOOTH: f64 = 0.008;
/// Steps towards the bending of a window: from the middle, one or two reach it.
const STEPS: usize = 4;
/// Bending beyond which a window is no plane.
const MOST_BENT: f64 = 20.0;

/// What one smooth surface says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bending {
    /// 0: the surface is plane if the values are ranges; 1: if they are depths.
    pub bending: f64,
    /// Its standard deviation, from the scatter of the residuals and their correlation between neighbours.
    pub sigma: f64,
    /// First column and row of the window that shows the surface, its width and height, pixel.
    pub window: [usize; 4],
}

/// The smooth surfaces of a frame in windows that do not overlap, the largest ones first tried.
///
/// `values` are as they were stored, in any unit; what is not finite or not positive is left out. A window is taken where
/// residuals of its cells from a plane bent by whatever fits best are below 0.8 % of the values; else it is quartered, three
/// times.
pub fn bendings(values: &Raster<f32>, rays: &RayTable) -> Result<Vec<Bending>> {
    let format = rays.format();
    let (here, there) = ([values.width(), values.height()], [format.width, format.height]);
    if here != there {
        return Err(Error::Size { values: here, rays: there });
    }
    let mut found = Vec::new();
    look(values, rays, [0, 0, here[0], here[1]], HALVINGS, &mut found);
    Ok(found)
}

/// Takes a window, or its quarters.
fn look(values: &Raster<f32>, rays: &RayTable, window: [usize; 4], halvings: usize, found: &mut Vec<Bending>) {
    let [col, row, width, height] = window;
    let sides = [width, height].map(|side| CELLS.min(side / SMALLEST_CELL_PX));
    if sides[0].min(sides[1]) < 4 {
        return;
    }
    let cells = cells(values, rays, window, sides);
    let bending = fit(&cells, sides);
    if let Some((bending, sigma)) = bending {
        found.push(Bending { bending, sigma, window });
    } else if halvings > 0 {
        let (left, top) = (width / 2, height / 2);
        for (col, width) in [(col, left), (col + left, width - left)] {
            for (row, height) in [(row, top), (row + top, height - top)] {
                look(values, rays, [col, row, width, height], halvings - 1, found);
            }
        }
    }
}

/// A few pixels beside each other; on a plane all three means are linear in each other.
struct Cell {
    place: [usize; 2],
    /// Mean of the rays, of length one.
    ray: Vector3<f64>,
    /// The same, of depth one.
    of_depth_one: Vector3<f64>,
    /// Mean of one over the value.
    inverse: f64,
}

fn cells(values: &Raster<f32>, rays: &RayTable, window: [usize; 4], sides: [usize; 2]) -> Vec<Cell> {
    let mut cells = Vec::with_capacity(sides[0] * sides[1]);
    for down in 0..sides[1] {
        for across in 0..sides[0] {
            let ends = |first: usize, length: usize, place: usize, of: usize| {
                first + place * length / of..first + (place + 1) * length / of
            };
            let cols = ends(window[0], window[2], across, sides[0]);
            let rows = ends(window[1], window[3], down, sides[1]);
            cells.extend(cell(values, rays, [across, down], [cols, rows]));
        }
    }
    cells
}

fn cell(
    values: &Raster<f32>,
    rays: &RayTable,
    place: [usize; 2],
    [cols, rows]: [std::ops::Range<usize>; 2],
) -> Option<Cell> {
    let pixels = cols.len() * rows.len();
    let (mut count, mut inverse, mut low, mut high) = (0.0, 0.0, f64::INFINITY, 0.0_f64);
    let (mut ray, mut of_depth_one) = (Vector3::zeros(), Vector3::zeros());
    for row in rows {
        for col in cols.clone() {
            let (Some(value), direction) = (values.get(col, row), rays.direction(col, row)) else { continue };
            let value = f64::from(*value);
            if !(value > 0.0 && value.is_finite() && direction.z < 0.0) {
                continue;
            }
            count += 1.0;
            (low, high) = (low.min(value), high.max(value));
            inverse += 1.0 / value;
            ray += direction;
            of_depth_one -= direction / direction.z;
        }
    }
    let filled = count > 0.0 && count >= FILLED * pixels as f64;
    let inverse = inverse / count;
    let one_surface = (high - low) * inverse < CELL_SPREAD;
    (filled && one_surface).then(|| Cell { place, ray: ray / count, of_depth_one: of_depth_one / count, inverse })
}

/// Bending and standard deviation of a window that shows one smooth surface.
///
/// A plane has `nᵀ r = d`, hence `1/range = mᵀ u` for rays u of length one and `1/depth = mᵀ u` for rays of depth one, with
/// `m = n/d`: both linear in m. Between the two the rays are interpolated, and the bending is the weight of the second.
fn fit(cells: &[Cell], sides: [usize; 2]) -> Option<(f64, f64)> {
    let least = (FILLED * (sides[0] * sides[1]) as f64).max(9.0);
    let mut used: Vec<&Cell> = cells.iter().collect();
    for _ in 0..3 {
        if (used.len() as f64) < least {
            return None;
        }
        let plane = bent_plane(&used)?;
        let residuals: Vec<f64> = used.iter().map(|cell| plane.residual(cell)).collect();
        let scale = statistics::mad_scale(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<f64>>());
        let before = used.len();
        let mut residuals = residuals.iter();
        used.retain(|_| residuals.next().is_some_and(|r| r.abs() <= TRIM * scale));
        if used.len() == before {
            break;
        }
    }
    if (used.len() as f64) < least {
        return None;
    }
    let plane = bent_plane(&used)?;
    let squares: f64 = used.iter().map(|cell| plane.residual(cell).powi(2)).sum();
    let spread = (squares / (used.len() as f64 - 4.0)).sqrt();
    let together = neighbours(&used, sides, &plane).clamp(0.0, 0.9);
    // Of residuals that go with their neighbours along both axes, fewer count.
    let sigma = spread / plane.information.sqrt() * (1.0 + together) / (1.0 - together);
    (spread < SMOOTH && plane.bending.abs() < MOST_BENT && sigma.is_finite()).then_some((plane.bending, sigma))
}

struct BentPlane {
    bending: f64,
    normal: Vector3<f64>,
    /// Sum of squares of the residuals' derivative by the bending, the plane adapted.
    information: f64,
}

impl BentPlane {
    /// As a part of the value.
    fn residual(&self, cell: &Cell) -> f64 {
        1.0 - self.normal.dot(&bent_ray(cell, self.bending)) / cell.inverse
    }
}

fn bent_ray(cell: &Cell, bending: f64) -> Vector3<f64> {
    cell.ray + bending * (cell.of_depth_one - cell.ray)
}

fn bent_plane(cells: &[&Cell]) -> Option<BentPlane> {
    let mut found = BentPlane { bending: 0.5, normal: Vector3::zeros(), information: 0.0 };
    for step in 0..=STEPS {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for cell in cells {
            let row = bent_ray(cell, found.bending) / cell.inverse;
            normal += row * row.transpose();
            right += row;
        }
        let factor = normal.cholesky()?;
        found.normal = factor.solve(&right);
        // What the bending changes and the plane cannot follow.
        let change = |cell: &Cell| found.normal.dot(&(cell.of_depth_one - cell.ray)) / cell.inverse;
        let mut followed = Vector3::zeros();
        for cell in cells {
            followed += bent_ray(cell, found.bending) / cell.inverse * change(cell);
        }
        let followed = factor.solve(&followed);
        let (mut information, mut misfit) = (0.0, 0.0);
        for cell in cells {
            let row = bent_ray(cell, found.bending) / cell.inverse;
            let own = change(cell) - followed.dot(&row);
            information += own * own;
            misfit += own * (1.0 - found.normal.dot(&row));
        }
        found.information = information;
        if information.is_nan() || information <= 0.0 {
            return None;
        }
        if step < STEPS {
            found.bending = (found.bending + misfit / information).clamp(-2.0 * MOST_BENT, 2.0 * MOST_BENT);
        }
    }
    Some(found)
}

/// Correlation of the residuals of cells beside each other.
fn neighbours(cells: &[&Cell], sides: [usize; 2], plane: &BentPlane) -> f64 {
    let mut residuals = vec![f64::NAN; sides[0] * sides[1]];
    for cell in cells {
        if let Some(place) = residuals.get_mut(cell.place[1] * sides[0] + cell.place[0]) {
            *place = plane.residual(cell);
        }
    }
    let (mut products, mut squares, mut pairs, mut all) = (0.0, 0.0, 0.0, 0.0);
    for (index, here) in residuals.iter().enumerate().filter(|(_, here)| !here.is_nan()) {
        squares += here * here;
        all += 1.0;
        let right = (index % sides[0] + 1 < sides[0]).then_some(index + 1);
        for other in right.into_iter().chain([index + sides[0]]) {
            if let Some(other) = residuals.get(other).filter(|other| !other.is_nan()) {
                products += here * other;
                pairs += 1.0;
            }
        }
    }
    if pairs > 0.0 && squares > 0.0 { products / pairs * all / squares } else { 0.0 }
}
