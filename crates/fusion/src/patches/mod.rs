//! Planes of single frames, cell by cell: where surfaces are, before anything is averaged over frames.
//!
//! A frame sees one side of a wall, and one of two walls that bad poses make: planes of single frames mix neither.

mod moments;
mod noise;
mod places;

use nalgebra::{Point3, Vector3};
use point_uncertainty::{CommonErrors, PointErrors};
use rayon::prelude::*;

use crate::Result;
use crate::input::{NO_NEIGHBOURHOOD, Observations, derivatives};
use crate::lattice::{Runs, neighbour, neighbours};
use crate::small::{self, Symmetric};
use moments::{Fit, Moments};
pub(crate) use moments::{LEAST_FACING, Plane, largest_sum, variance_within};
pub(crate) use noise::{if_larger, is_smaller, noise_ratio};
pub(crate) use places::{ONE_SURFACE, Seed, seeds};

/// Part of the patches by which noise is judged, those of the least squares: shapes, edges and what lies about make others of more.
const FLAT_SHARE: f64 = 0.25;

/// What one frame saw in one cell.
pub(crate) struct Patch {
    pub frame: u32,
    moments: Moments,
    /// Covariance of a point there from common errors, square metre.
    pub common: Symmetric,
    pub plane: Option<Plane>,
    /// Of the frame's points about their plane, over their variances, and their degrees of freedom.
    squares: Option<(f64, f64)>,
}

/// What is found of a patch: plane, and squares as there.
type Found = (Option<Plane>, Option<(f64, f64)>);

/// Patches by cells.
pub(crate) struct Patches {
    pub cells: Runs,
    pub all: Vec<Patch>,
    /// Patches of a cell begin here.
    pub starts: Vec<u32>,
}

impl Patches {
    /// The patches of a cell.
    pub fn of(&self, cell: usize) -> &[Patch] {
        &self.all[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The variance of the noise of points within single frames over what is stated.
    pub fn noise_ratio(&self) -> f64 {
        noise_ratio(self.all.iter().filter_map(|patch| patch.squares), FLAT_SHARE)
    }

    /// The patch of a frame in a cell.
    pub fn by_frame(&self, cell: usize, frame: u32) -> Option<&Patch> {
        self.of(cell).iter().find(|patch| patch.frame == frame)
    }
}

/// Patches of all cells with their planes.
pub(crate) fn patches(observations: &Observations, errors: &dyn PointErrors, common: &CommonErrors) -> Result<Patches> {
    let cells = Runs::new(observations.keys.iter().copied());
    let by_cell: Vec<Vec<Patch>> = (0..cells.keys.len())
        .into_par_iter()
        .with_min_len(64)
        .map_init(Vec::new, |buffer, cell| in_cell(cell, &cells, observations, errors, common, buffer))
        .collect::<Result<_>>()?;
    let mut starts = vec![0];
    let mut all = Vec::new();
    for patches in by_cell {
        all.extend(patches);
        starts.push(all.len() as u32);
    }
    let mut patches = Patches { cells, all, starts };
    let near = neighbours(1);
    let found: Vec<Vec<Found>> = (0..patches.cells.keys.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|cell| planes(cell, &patches, observations, &near))
        .collect();
    for (patch, (plane, squares)) in patches.all.iter_mut().zip(found.into_iter().flatten()) {
        (patch.plane, patch.squares) = (plane, squares);
    }
    Ok(patches)
}

fn in_cell(
    cell: usize,
    cells: &Runs,
    observations: &Observations,
    errors: &dyn PointErrors,
    common: &CommonErrors,
    buffer: &mut Vec<(usize, Vector3<f64>)>,
) -> Result<Vec<Patch>> {
    let centre = observations.lattice.centre(cells.keys[cell]);
    let mut found: Vec<Patch> = Vec::new();
    let mut seen: Vec<Vec<u64>> = Vec::new();
    for observation in &observations.all[cells.items(cell)] {
        let known = found.iter().position(|patch| patch.frame == observation.frame);
        let at = if let Some(at) = known {
            at
        } else {
            // Common errors vary slowly: one point of the patch stands for all.
            derivatives(observation.index as usize, errors, common, buffer)?;
            let common = covariance(buffer, common);
            found.push(Patch {
                frame: observation.frame,
                moments: Moments::default(),
                common,
                plane: None,
                squares: None,
            });
            seen.push(Vec::new());
            found.len() - 1
        };
        let id = observation.neighbourhood;
        // From the last one on: points of a neighbourhood lie together.
        let is_first = id == NO_NEIGHBOURHOOD || !seen[at].iter().rev().any(|other| *other == id);
        if is_first {
            seen[at].push(id);
        }
        found[at].moments.add(observation, is_first, &centre);
    }
    Ok(found)
}

/// Covariance of a point from common errors.
fn covariance(derivatives: &[(usize, Vector3<f64>)], common: &CommonErrors) -> Symmetric {
    let mut sum = [0.0; 6];
    for (row, first) in derivatives {
        let mut with = Vector3::zeros();
        for (column, second) in derivatives {
            with += second * common.covariance()[(*row, *column)];
        }
        let product = first * with.transpose();
        small::add(&mut sum, &small::from_matrix(&((product + product.transpose()) * 0.5)), 1.0);
    }
    sum
}

/// The planes of a cell's patches: through the points of the cells around where these are flat, else of the cell alone;
/// where a frame has too few points, through those of all frames that look the same way.
fn planes(cell: usize, patches: &Patches, observations: &Observations, near: &[i64]) -> Vec<Found> {
    let lattice = &observations.lattice;
    let key = patches.cells.keys[cell];
    let centre = lattice.centre(key);
    let around: Vec<(usize, Vector3<f64>)> = near
        .iter()
        .map(|difference| neighbour(key, *difference))
        .filter_map(|key| Some((patches.cells.find(key)?, lattice.centre(key) - centre)))
        .collect();
    let own = patches.of(cell);
    let mut any_enough = false;
    let mut found: Vec<Found> = own
        .iter()
        .map(|patch| {
            let mut window = Moments::default();
            for (cell, shift) in &around {
                if let Some(other) = patches.by_frame(*cell, patch.frame) {
                    window.include(&other.moments, shift);
                }
            }
            any_enough |= window.has_enough();
            let none = [0.0; 6];
            let [wide, alone] = [&window, &patch.moments].map(|moments| moments.fit(lattice.size_m, &none));
            let plane = |fit: Fit| fit.plane(&centre, lattice.size_m);
            let squares = |fit: Fit| fit.squares(lattice.size_m);
            // A bent surface is flatter within its cell.
            (
                wide.and_then(plane).or_else(|| alone.and_then(plane).map(weak)),
                alone.and_then(squares).or_else(|| wide.and_then(squares)),
            )
        })
        .collect();
    if !any_enough && let Some((first, _)) = found.first_mut() {
        *first = together(&own[0], patches, &around, &centre, lattice.size_m);
    }
    let alone = [(cell, Vector3::zeros())];
    for ((plane, _), patch) in found.iter_mut().zip(own).filter(|((plane, _), _)| plane.is_none()) {
        *plane = together(patch, patches, &alone, &centre, lattice.size_m).map(weak);
    }
    found
}

fn weak(plane: Plane) -> Plane {
    Plane { is_firm: false, ..plane }
}

/// The plane through points of all frames that look as one does.
fn together(
    like: &Patch,
    patches: &Patches,
    around: &[(usize, Vector3<f64>)],
    centre: &Point3<f64>,
    voxel_m: f64,
) -> Option<Plane> {
    let mut window = Moments::default();
    for (cell, shift) in around {
        for patch in patches.of(*cell).iter().filter(|patch| patch.moments.sees_along(&like.moments)) {
            window.include(&patch.moments, shift);
        }
    }
    window.fit(voxel_m, &like.common)?.plane(centre, voxel_m)
}
