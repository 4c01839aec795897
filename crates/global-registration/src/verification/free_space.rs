//! The space that a station looked through, as fine as its pixels.

use nalgebra::Point3;

use crate::description::view::{least_around, on_cube};

/// The ranges up to which a station surely saw nothing, by direction: on the six faces of a cube about its viewpoint.
#[derive(Debug, Clone)]
pub struct FreeSpace {
    /// Cells along the edge of a face.
    edge: usize,
    /// Metre; zero where nothing is known. A face in which nothing was seen is empty.
    faces: [Vec<f32>; 6],
}

/// Most cells along the edge of a face, and those by which the angle between rays is found.
const MOST: f64 = 512.0;
const COARSE: usize = 32;
/// Size of a cell, angles between neighbouring rays.
const CELL: f64 = 1.2;

impl FreeSpace {
    /// From what was seen about a viewpoint at the origin: points, and the range up to which the ray of each is free, metre. Each direction
    /// is as free as the least free of those about it: where the range jumps nothing is certain.
    pub fn new(seen: &[(Point3<f64>, f64)]) -> Self {
        let mut this = Self { edge: COARSE, faces: Default::default() };
        this.fill(seen);
        let filled = this.faces.iter().flatten().filter(|free_to_m| free_to_m.is_finite()).count();
        this.edge =
            ((COARSE as f64) * (seen.len() as f64 / filled.max(1) as f64).sqrt() / CELL).clamp(1.0, MOST) as usize;
        this.fill(seen);
        let edge = this.edge;
        this.faces = this.faces.map(|cells| least_around(&cells, edge));
        this
    }

    fn fill(&mut self, seen: &[(Point3<f64>, f64)]) {
        self.faces = Default::default();
        for (point, free_to_m) in seen.iter().filter(|(_, free_to_m)| *free_to_m > 0.0) {
            let Some([face, cell]) = on_cube(point.coords.cast().into(), self.edge) else { continue };
            let cells = &mut self.faces[face];
            cells.resize(self.edge * self.edge, f32::INFINITY);
            cells[cell] = cells[cell].min(*free_to_m as f32);
        }
    }

    /// Whether the station looked through this place.
    pub fn holds(&self, place: &Point3<f64>) -> bool {
        let Some([face, cell]) = on_cube(place.coords.cast().into(), self.edge) else { return false };
        self.faces[face].get(cell).is_some_and(|free_to_m| place.coords.norm() < f64::from(*free_to_m))
    }
}
