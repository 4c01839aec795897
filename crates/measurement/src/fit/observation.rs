//! Points as observations: where each would lie if it had no error of its own.

use nalgebra::{Matrix3, Vector3};

use super::surface::{Parameters, Surface};
use crate::Cloud;

/// Cosine of the largest angle of incidence, 78 degrees: beyond it the surface is nearly along the ray, and a pixel of any size mixes
/// what lies far apart. Larger leaves out more of floors.
const SMALLEST_COSINE: f64 = 0.2;
/// Standard deviations of the range that the limb of a round body, four times the height that it rises beyond a ray, must have: there
/// second-order terms of one deviation are a tenth of the first-order ones. Fewer let in rays that the body's own uncertainty
/// makes miss it.
const SIGMAS_OF_LIMB: f64 = 10.0;
/// The direction of a point's error depends on the normal where it is no single ray; each round brings the change down to its square.
const ROUNDS: usize = 4;

/// A point of a region with its own error.
#[derive(Debug, Clone)]
pub(crate) struct Observation {
    pub(crate) index: usize,
    pub(crate) point: Vector3<f64>,
    noise: Matrix3<f64>,
    sensor: Option<(u64, Vector3<f64>)>,
    /// Of both.
    own: Matrix3<f64>,
}

/// What an observation says of a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// Outward normal of the surface where the point would lie.
    pub(crate) normal: Vector3<f64>,
    /// Residual across the surface, metre.
    pub(crate) residual: f64,
    /// Variance of what the point has for itself, across the surface.
    pub(crate) variance: f64,
    /// The part of it that no other point has.
    pub(crate) noise: f64,
    /// Neighbourhood, and shift across the surface by one standard deviation of its shared error.
    pub(crate) sensor: Option<(u64, f64)>,
    pub(crate) by: Parameters,
    /// Whether the ray meets the surface steeply and far from a limb.
    pub(crate) is_clear: bool,
}

/// The points of a region that have position and standard deviation, and how many have not.
pub(crate) fn observations(cloud: &Cloud<'_>, points: &[usize]) -> (Vec<Observation>, usize) {
    let all = points.iter().filter_map(|index| Observation::new(cloud, *index));
    let usable: Vec<Observation> = all.collect();
    let without = points.len() - usable.len();
    (usable, without)
}

impl Observation {
    /// Trace of the own covariance, square metre.
    pub(crate) fn variance(&self) -> f64 {
        self.own.trace()
    }

    fn new(cloud: &Cloud<'_>, index: usize) -> Option<Self> {
        let point = cloud.points.get(index)?.coords;
        let (noise, sensor) = (cloud.errors.noise(index), cloud.errors.sensor(index));
        let own = noise + sensor.map_or_else(Matrix3::zeros, |(_, shift)| shift * shift.transpose());
        let finite = point.iter().chain(own.iter()).all(|value| value.is_finite());
        (finite && noise.trace() > 0.0).then_some(Self { index, point, noise, sensor, own })
    }

    /// Where the point would lie on the surface: moved in the direction in which its error is most probable, which is its ray where
    /// the error is one of the range. `None` where that misses the surface.
    ///
    /// Taken at the surface and not at the point, normals and weights do not depend on the point's noise, and round bodies are
    /// estimated without bias.
    pub(crate) fn hit(&self, surface: &Surface) -> Option<Hit> {
        let mut place = self.point;
        let mut found = None;
        for _ in 0..ROUNDS {
            let normal = surface.beside(&place).normal;
            let along = (self.own * normal).try_normalize(0.0)?;
            let (way, between) = surface.way(&self.point, &along)?;
            let next = self.point + along * way;
            let done = (next - place).norm_squared() <= 1e-24 * next.norm_squared();
            place = next;
            found = Some((along, between));
            if done {
                break;
            }
        }
        let (along, between) = found?;
        let beside = surface.beside(&place);
        let normal = beside.normal;
        let cosine = normal.dot(&along).abs();
        let variance = normal.dot(&(self.own * normal));
        let is_apart = between * cosine * cosine > SIGMAS_OF_LIMB * variance.sqrt();
        (variance > 0.0).then(|| Hit {
            normal,
            residual: normal.dot(&(self.point - place)),
            variance,
            noise: normal.dot(&(self.noise * normal)),
            sensor: self.sensor.map(|(cell, shift)| (cell, normal.dot(&shift))),
            by: beside.by,
            is_clear: cosine >= SMALLEST_COSINE && is_apart,
        })
    }
}
