//! Patches of one plane: the wider the plane, the better its normal is known.
//!
//! Noise of normals is worse than noise of distances: on a wall, normals that scatter imitate a surface that resists
//! sliding along it. A wall that is one plane within the noise gives all its patches one normal, and says nothing.

use nalgebra::{Point3, Vector3};

use crate::surfaces::plane_fit::{Moments, Plane, SAME_DIRECTION};

/// Standard deviations that a patch may be off the plane of its region, or of all stations.
pub(crate) const OFF_PLANE: f64 = 3.0;
/// Ratio of the scatter about a joint plane to that about its parts beyond which it is no plane.
pub(crate) const ROUGHER: f64 = 1.15;
/// Fewest patches of a region: smaller ones have no better normal than neighbours give.
const FEWEST: usize = 5;

/// Patches on one plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Region {
    /// Of all points, about the origin of the surface.
    pub moments: Moments,
    pub plane: Plane,
}

/// Patches to be divided: fits, centres, neighbours of each, and what no offset is better known than, metre.
pub(crate) struct Patches<'a> {
    pub fits: &'a [(Moments, Plane)],
    pub centres: &'a [Point3<f64>],
    pub neighbours: &'a [Vec<usize>],
    pub roughness_m: f64,
}

impl Patches<'_> {
    /// The regions, and which of them each patch belongs to.
    pub(crate) fn regions(&self, origin: &Vector3<f64>) -> (Vec<Region>, Vec<Option<usize>>) {
        let known = |k: usize| self.fits[k].1.variance / self.fits[k].0.count();
        let mut order: Vec<usize> = (0..self.fits.len()).collect();
        order.sort_by(|&a, &b| known(a).total_cmp(&known(b)).then(a.cmp(&b)));
        let mut taken = vec![false; self.fits.len()];
        let (mut regions, mut of_patch) = (Vec::new(), vec![None; self.fits.len()]);
        for seed in order {
            if taken[seed] {
                continue;
            }
            let (region, moments) = self.grown(seed, origin, &mut taken);
            if region.len() < FEWEST {
                continue;
            }
            let plane = moments.region_plane().filter(|plane| plane.variance <= ROUGHER * self.scatter(&region));
            let Some(plane) = plane else { continue };
            for &k in &region {
                of_patch[k] = Some(regions.len());
            }
            regions.push(Region { moments, plane });
        }
        (regions, of_patch)
    }

    fn grown(&self, seed: usize, origin: &Vector3<f64>, taken: &mut [bool]) -> (Vec<usize>, Moments) {
        let (mut moments, mut plane) = self.fits[seed];
        let mut region = vec![seed];
        taken[seed] = true;
        let mut next = 0;
        while next < region.len() {
            for &other in &self.neighbours[region[next]] {
                let (own, fit) = &self.fits[other];
                if taken[other] || plane.normal.dot(&fit.normal).abs() < SAME_DIRECTION {
                    continue;
                }
                let apart = self.centres[other].coords - origin - moments.mean();
                // The plane is less well known beyond its rim.
                let of_plane = plane.variance / moments.count() * (1.0 + apart.norm_squared() / plane.spread);
                let variance = of_plane + fit.variance / own.count() + self.roughness_m.powi(2);
                if plane.normal.dot(&apart).powi(2) > OFF_PLANE.powi(2) * variance {
                    continue;
                }
                let mut with = moments;
                with.join(own);
                let Some(fitted) = with.region_plane() else { continue };
                (moments, plane) = (with, fitted);
                taken[other] = true;
                region.push(other);
            }
            next += 1;
        }
        (region, moments)
    }

    /// Mean variance of points about their own patches.
    fn scatter(&self, region: &[usize]) -> f64 {
        let sum = |f: &dyn Fn(usize) -> f64| region.iter().map(|&k| f(k)).sum::<f64>();
        let count = sum(&|k| self.fits[k].0.count());
        sum(&|k| self.fits[k].0.count() * self.fits[k].1.variance) / count + self.roughness_m.powi(2)
    }
}
