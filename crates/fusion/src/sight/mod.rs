//! What each frame sees of the fused surfaces, and what cannot be there because of that.

mod contradict;
mod map;
mod reason;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::outcome::Surfel;
pub(crate) use contradict::{contradictions, stay};
use map::Map;
pub(crate) use reason::reasons;

/// Distance from the middle of a surfel, in its radii, within which a ray meets it: so that discs on a lattice leave no gaps.
const MEETS: f64 = 1.3;

/// Fused points as seen from the perspective centres.
pub(crate) struct Scene<'a> {
    pub surfels: &'a [Surfel],
    pub centres: &'a [Point3<f64>],
    maps: Vec<Map>,
}

impl<'a> Scene<'a> {
    pub fn new(surfels: &'a [Surfel], centres: &'a [Point3<f64>]) -> Self {
        let maps = centres.par_iter().map(|centre| Map::new(surfels, centre)).collect();
        Self { surfels, centres, maps }
    }

    /// The surfel that a frame would see in the direction of a point: of the nearest ones around, that whose middle the ray
    /// meets best.
    fn toward(&self, frame: u32, point: &Point3<f64>) -> Option<u32> {
        let centre = &self.centres[frame as usize];
        let direction = point - centre;
        let aside = |at: &u32| {
            let surfel = &self.surfels[*at as usize];
            let along = surfel.normal.dot(&(surfel.position - centre)) / surfel.normal.dot(&direction);
            (centre + direction * along - surfel.position).norm() / surfel.radius_m
        };
        let met = self.maps[frame as usize].around(&direction).map(|at| (aside(&at), at));
        let best = met.filter(|(aside, _)| *aside <= MEETS).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        best.map(|(_, at)| at)
    }

    /// Whether a frame saw a surfel.
    fn has_seen(&self, frame: u32, surfel: u32) -> bool {
        self.surfels[surfel as usize].frames.binary_search(&frame).is_ok()
    }
}
