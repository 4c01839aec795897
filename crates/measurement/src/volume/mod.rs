//! The volume between the surface in a region and a plane.

mod grid;

use nalgebra::{Point3, Unit as UnitVector, Vector3};
use point_uncertainty::Gradient;

use crate::quantity::{Quantity, Unit, sum};
use crate::{Cloud, Error, FittedPlane, Region, Result};
use grid::{Filled, Grid};

/// The plane that a volume is counted from.
#[derive(Debug, Clone, Copy)]
pub enum Base<'a> {
    /// One fitted to points: its errors take part.
    Fitted(&'a FittedPlane),
    /// One that is known.
    Fixed {
        /// A point of it.
        point: Point3<f64>,
        /// Its normal, towards what counts positive.
        normal: UnitVector<Vector3<f64>>,
    },
}

/// How a volume is counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeOptions {
    /// Edge of the grid's cells, metre. Default 0.02. Each should hold several points; larger cells round off the surface's edges.
    pub cell_m: f64,
}

impl Default for VolumeOptions {
    fn default() -> Self {
        Self { cell_m: 0.02 }
    }
}

/// A cell of the footprint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Column and row in the grid.
    pub position: [usize; 2],
    /// Middle of what lies in the footprint, on the plane, metre.
    pub middle: Point3<f64>,
    /// Area of what lies in the footprint, square metre.
    pub area_m2: f64,
}

/// A volume, and what it is not made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// The volume over all cells that have points; below the plane it counts negative. On a fitted plane, above is the side that
    /// most of the surface lies on.
    pub volume: Quantity,
    /// Area of the cells that have points, square metre.
    pub area_m2: f64,
    /// Number of these cells.
    pub cells: usize,
    /// Cells of the footprint without points: nothing is known there, and the volume does not have them.
    pub missing: Vec<Cell>,
}

impl Volume {
    /// Area without points, square metre.
    pub fn missing_m2(&self) -> f64 {
        // A sum of nothing is -0.
        self.missing.iter().fold(0.0, |sum, cell| sum + cell.area_m2)
    }

    /// What to say of the area without points; `None` where there is none.
    pub fn doubt(&self) -> Option<String> {
        let first = self.missing.first()?;
        Some(format!(
            "{} of {} cells ({:.4} of {:.4} m2) have no point, the first in column {}, row {}; the volume is that of the others",
            self.missing.len(),
            self.missing.len() + self.cells,
            self.missing_m2(),
            self.missing_m2() + self.area_m2,
            first.position[0],
            first.position[1],
        ))
    }
}

/// Volume between the points of a region and a plane, over the region's footprint on the plane.
///
/// Each cell of a grid counts with its area in the footprint times the height of its points, which are brought to the middle of the
/// cell along the slope that the cells around it show. A point moves the surface under it by what it is moved across that
/// slope.
///
/// # Errors
/// [`Error::Unbounded`]; [`Error::OutOfDomain`] of the cell's size; [`Error::NoCells`].
pub fn volume(cloud: &Cloud<'_>, region: &Region, base: &Base<'_>, options: &VolumeOptions) -> Result<Volume> {
    let frame = Frame::new(base);
    let grid = Grid::new(&region.parts()?, &frame, options.cell_m)?;
    let points = region.select(cloud.points)?;
    let (filled, missing) = grid.filled(cloud.points, &points, &frame);
    if filled.is_empty() {
        return Err(Error::NoCells { cells: missing.len() });
    }
    let value: f64 = filled.iter().map(|cell| cell.area_m2 * cell.height()).sum();
    let sign = if value < 0.0 && matches!(base, Base::Fitted(_)) { -1.0 } else { 1.0 };
    let surface: Gradient = filled.iter().flat_map(|cell| surface(cell, &frame)).collect();
    let of_base = of_base(&filled, base);
    let gradient = sum(&[(&surface, sign), (&of_base, sign)]);
    Ok(Volume {
        volume: Quantity::new(value * sign, Unit::CubicMetre, gradient),
        area_m2: filled.iter().map(|cell| cell.area_m2).sum(),
        cells: filled.len(),
        missing,
    })
}

/// Axes of the plane.
pub(crate) struct Frame {
    origin: Vector3<f64>,
    axes: [Vector3<f64>; 2],
    normal: Vector3<f64>,
}

impl Frame {
    fn new(base: &Base<'_>) -> Self {
        match base {
            Base::Fitted(plane) => {
                Self { origin: plane.point.coords, axes: plane.axes(), normal: plane.normal.into_inner() }
            }
            Base::Fixed { point, normal } => {
                Self { origin: point.coords, axes: crate::region::across(normal), normal: normal.into_inner() }
            }
        }
    }

    /// Two coordinates in the plane and the height above it.
    fn local(&self, point: &Vector3<f64>) -> [f64; 3] {
        let way = point - self.origin;
        [self.axes[0].dot(&way), self.axes[1].dot(&way), self.normal.dot(&way)]
    }

    fn on_plane(&self, [x, y]: [f64; 2]) -> Vector3<f64> {
        self.origin + self.axes[0] * x + self.axes[1] * y
    }
}

/// Derivatives of a cell's part of the volume by its points.
fn surface<'a>(cell: &'a Filled, frame: &'a Frame) -> impl Iterator<Item = (usize, Vector3<f64>)> + 'a {
    let upward = frame.normal - frame.axes[0] * cell.slope[0] - frame.axes[1] * cell.slope[1];
    let weight = cell.area_m2 / cell.points.len() as f64;
    cell.points.iter().map(move |point| (*point, upward * weight))
}

/// Derivatives by the points of a fitted plane.
fn of_base(filled: &[Filled], base: &Base<'_>) -> Gradient {
    let Base::Fitted(plane) = base else { return Vec::new() };
    let moment = |axis: usize| filled.iter().map(|cell| cell.area_m2 * cell.middle[axis]).sum::<f64>();
    let area: f64 = filled.iter().map(|cell| cell.area_m2).sum();
    plane.support.gradient(&[moment(0), moment(1), -area, 0.0, 0.0])
}
