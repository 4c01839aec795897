//! What is fused, checked and put into an order that does not depend on the caller's.

use std::cmp::Ordering;

use nalgebra::{Point3, Vector3};
use point_uncertainty::{CommonErrors, PointErrors};
use rayon::prelude::*;

use crate::lattice::Lattice;
use crate::small::{self, Symmetric};
use crate::{Error, Result};

/// Variances below this are no noise of a range, square metre: a nanometre squared.
const LEAST_VARIANCE_M2: f64 = 1e-18;

/// Points of frames in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Registered<'a> {
    /// The points, metre; all finite.
    pub points: &'a [Point3<f64>],
    /// The frame of each point: an index of `centres`.
    pub frames: &'a [u32],
    /// The perspective centre of each frame.
    pub centres: &'a [Point3<f64>],
    /// Amplitudes of the points in any unit; NaN where there is none.
    pub amplitudes: Option<&'a [f64]>,
}

/// No neighbourhood.
pub(crate) const NO_NEIGHBOURHOOD: u64 = u64::MAX;

/// One point as it was observed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observation {
    pub position: Point3<f64>,
    /// Direction of sight, from the perspective centre.
    pub ray: Vector3<f64>,
    noise: [f32; 6],
    shift: [f32; 3],
    /// What shares an error of the sensor with it.
    pub neighbourhood: u64,
    pub frame: u32,
    /// Index among the caller's points.
    pub index: u32,
}

impl Observation {
    pub fn noise(&self) -> Symmetric {
        self.noise.map(f64::from)
    }

    /// Variance of its noise along a unit vector.
    #[inline]
    pub fn noise_along(&self, n: &Vector3<f64>) -> f64 {
        small::quadratic(&self.noise.map(f64::from), n).max(LEAST_VARIANCE_M2)
    }

    /// Variance of its noise in all directions.
    pub fn noise_variance(&self) -> f64 {
        f64::from(self.noise[0] + self.noise[3] + self.noise[5])
    }

    /// Shift by one standard deviation of what its neighbourhood shares.
    #[inline]
    pub fn shift(&self) -> Vector3<f64> {
        Vector3::from(self.shift.map(f64::from))
    }

    /// Largest variance of noise and sensor along any direction.
    pub fn variance(&self) -> f64 {
        f64::from(self.noise[0] + self.noise[3] + self.noise[5]) + self.shift().norm_squared()
    }

    /// An order that does not know the caller's.
    fn order(&self, other: &Self) -> Ordering {
        let numbers = |o: &Self| [o.position.x, o.position.y, o.position.z, o.ray.x, o.ray.y, o.ray.z];
        let pairs = numbers(self).into_iter().zip(numbers(other));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    }
}

/// All points by cells.
pub(crate) struct Observations {
    pub all: Vec<Observation>,
    /// Cell of each.
    pub keys: Vec<u64>,
    pub lattice: Lattice,
}

impl Observations {
    /// The same with so many times the variances of noise and neighbourhoods, by the place of an observation.
    pub fn noisier(&self, factor: impl Fn(usize) -> f64 + Sync) -> Self {
        let noisier = |(at, of): (usize, &Observation)| {
            let factor = factor(at);
            let (variance, deviation) = (factor as f32, factor.sqrt() as f32);
            Observation { noise: of.noise.map(|v| v * variance), shift: of.shift.map(|v| v * deviation), ..*of }
        };
        let all = self.all.par_iter().enumerate().map(noisier).collect();
        Self { all, keys: self.keys.clone(), lattice: self.lattice }
    }
}

impl Registered<'_> {
    /// Lengths, numbers, frames.
    pub(crate) fn check(&self) -> Result<()> {
        let count = self.points.len();
        if count == 0 {
            return Err(Error::Empty);
        }
        if count > 4_000_000_000 {
            return Err(Error::TooMany(count));
        }
        let length =
            |what, found| if found == count { Ok(()) } else { Err(Error::Length { what, expected: count, found }) };
        length("frames", self.frames.len())?;
        length("amplitudes", self.amplitudes.map_or(count, <[f64]>::len))?;
        let wrong = |points: &[Point3<f64>]| points.iter().position(|point| !rigid_pose::is_usable(point));
        if let Some(index) = wrong(self.points) {
            return Err(Error::NonFinite { what: "point", index });
        }
        if let Some(index) = wrong(self.centres) {
            return Err(Error::NonFinite { what: "perspective centre", index });
        }
        if let Some(point) = self.frames.iter().position(|frame| *frame as usize >= self.centres.len()) {
            return Err(Error::Frame { point, frame: self.frames[point], frames: self.centres.len() });
        }
        if count > 1 && self.points.iter().all(|point| *point == self.points[0]) {
            return Err(Error::Coincident(count));
        }
        Ok(())
    }

    /// The points with their errors, moved by `corrections` of the common errors, in the order of cells.
    pub(crate) fn observe(
        &self,
        errors: &dyn PointErrors,
        common: &CommonErrors,
        corrections: &[f64],
        voxel_m: f64,
    ) -> Result<Observations> {
        let moves = corrections.iter().any(|c| *c != 0.0);
        let mut all: Vec<Observation> = (0..self.points.len())
            .into_par_iter()
            .with_min_len(1024)
            .map_init(Vec::new, |derivatives, index| {
                let mut observation = self.observation(index, errors)?;
                if moves {
                    observation.position -= moved(index, errors, common, corrections, derivatives)?;
                }
                Ok(observation)
            })
            .collect::<Result<_>>()?;
        let lattice = Lattice::new(all.iter().map(|o| &o.position), voxel_m)?;
        let mut order: Vec<(u64, u32)> =
            all.par_iter().enumerate().map(|(at, o)| (lattice.key(&o.position), at as u32)).collect();
        order.par_sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then_with(|| all[a.1 as usize].order(&all[b.1 as usize])).then(a.1.cmp(&b.1))
        });
        all = order.par_iter().map(|(_, at)| all[*at as usize]).collect();
        Ok(Observations { all, keys: order.into_iter().map(|(key, _)| key).collect(), lattice })
    }

    fn observation(&self, index: usize, errors: &dyn PointErrors) -> Result<Observation> {
        let (position, frame) = (self.points[index], self.frames[index]);
        let sight = position - self.centres[frame as usize];
        let range_m = sight.norm();
        if range_m <= 0.0 {
            return Err(Error::AtCentre { point: index, frame });
        }
        let noise = small::from_matrix(&errors.noise(index));
        let (neighbourhood, shift) = errors.sensor(index).unwrap_or((NO_NEIGHBOURHOOD, Vector3::zeros()));
        let trace = noise[0] + noise[3] + noise[5];
        let variance = trace + shift.norm_squared() + 0.0 * noise.iter().sum::<f64>();
        // NaN fails the comparison.
        if !(trace > LEAST_VARIANCE_M2 && variance < 1e30) {
            return Err(Error::Variance {
                point: index,
                value: if trace > LEAST_VARIANCE_M2 { variance } else { trace },
            });
        }
        Ok(Observation {
            position,
            ray: sight / range_m,
            noise: noise.map(|v| v as f32),
            shift: [shift.x as f32, shift.y as f32, shift.z as f32],
            neighbourhood,
            frame,
            index: index as u32,
        })
    }
}

/// Derivatives of a point by the common errors, checked.
pub(crate) fn derivatives(
    index: usize,
    errors: &dyn PointErrors,
    common: &CommonErrors,
    into: &mut Vec<(usize, Vector3<f64>)>,
) -> Result<()> {
    into.clear();
    errors.common(index, into);
    let count = common.errors().len();
    match into.iter().find(|(column, by)| *column >= count || !by.iter().all(|v| v.is_finite())) {
        Some((column, by)) => Err(Error::Derivative { point: index, column: *column, errors: count, value: by.norm() }),
        None => Ok(()),
    }
}

/// How far a point was moved by common errors of these values.
fn moved(
    index: usize,
    errors: &dyn PointErrors,
    common: &CommonErrors,
    values: &[f64],
    buffer: &mut Vec<(usize, Vector3<f64>)>,
) -> Result<Vector3<f64>> {
    derivatives(index, errors, common, buffer)?;
    Ok(buffer.iter().map(|(column, by)| by * values[*column]).sum())
}
