//! What is left between a point and the surfaces that other stations saw, for maps of residuals.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::planes::contacts::BESIDE;
use crate::survey::registration::{StationRegistration, SurfacePair};
use rigid_pose::require_points;

/// Part of a patch that a point may be off it across.
const ACROSS: f64 = 0.5;

impl StationRegistration {
    /// Distance of each point of a station from the surfaces that the other stations saw there, metre, averaged over
    /// these stations: positive on the side of the surface that the other station looks at. NaN where no other station
    /// saw a surface within half a patch.
    ///
    /// `points`: in the station's frame, metre, such as the station's own (for a map, in the order of its pixels).
    ///
    /// # Errors
    /// [`Error::NoSuchStation`], [`InputError::NonFinite`](rigid_pose::InputError::NonFinite).
    pub fn point_residuals(&self, station: usize, points: &[Point3<f64>]) -> Result<Vec<f64>> {
        let count = self.world_from_station.len();
        if station >= count {
            return Err(Error::NoSuchStation { station, count });
        }
        require_points("points of a station", points)?;
        let other = |pair: &SurfacePair| match (pair.target == station, pair.source == station) {
            (true, _) => Some(pair.source),
            (_, true) => Some(pair.target),
            _ => None,
        };
        let partners = self.surfaces.iter().filter_map(other);
        let others: Vec<_> = partners
            .map(|other| {
                let pose = self.world_from_station[other].inverse() * self.world_from_station[station];
                (&self.prepared[other], pose)
            })
            .collect();
        let residual = |point: &Point3<f64>| {
            let (mut sum, mut seen) = (0.0, 0.0);
            for (surface, pose) in &others {
                let moved = pose * point;
                if !surface.extent.is_near(&moved.coords, surface.size_m) {
                    continue;
                }
                let patch = &surface.patches[surface.tree.any_nearest(&[moved.x, moved.y, moved.z]).index];
                let apart = moved - patch.centre;
                let across = patch.normal.dot(&apart);
                let along = (apart.norm_squared() - across * across).max(0.0).sqrt();
                if across.abs() <= ACROSS * surface.size_m && along <= BESIDE * surface.size_m {
                    // The side that the station looks at, whichever way the normal points.
                    sum += if patch.normal.dot(&patch.centre.coords) > 0.0 { -across } else { across };
                    seen += 1.0;
                }
            }
            if seen > 0.0 { sum / seen } else { f64::NAN }
        };
        Ok(points.par_iter().with_min_len(256).map(residual).collect())
    }
}
