//! One averaged point for each occupied cell.

use nalgebra::{Point3, Vector3};

use super::numerics::gather::{Sum, gather};
use super::numerics::lattice::{Lattice, cell};
use crate::error::Result;
use point_cloud::Cloud;
use point_cloud::no_normal;

/// Normals whose mean is shorter than this point to opposite sides (or all around): there is no common one.
const SHORTEST_MEAN_NORMAL: f64 = 0.5;

/// One point for each cube of `voxel_m` that holds points: their averages, in a fixed order (that of the cubes).
///
/// Normals are averaged over the points that have one, all turned to the side of the first; there is none where they
/// scatter too widely. The standard deviation is that of the average of independent points, over those of which it is
/// known. A cube is at the rim where more than half of its points are. The cubes are aligned with the multiples of
/// `voxel_m`.
///
/// # Errors
/// [`InputError::Empty`](rigid_pose::InputError::Empty), [`InputError::NonFinite`](rigid_pose::InputError::NonFinite), [`InputError::LengthMismatch`](rigid_pose::InputError::LengthMismatch),
/// [`InputError::NotPositive`](rigid_pose::InputError::NotPositive) for the cloud; [`crate::Error::VoxelSize`] for a size that is not positive, or of which
/// more than two million lie along the cloud.
pub fn downsample(cloud: &Cloud, voxel_m: f64) -> Result<Cloud> {
    cloud.validate("the cloud to be thinned")?;
    let lattice = Lattice::new(&cloud.points, voxel_m)?;
    let (keys, sums) = gather::<Average>(&cloud.points, &lattice, |_| true, cloud);
    let points = keys.iter().zip(&sums).map(|(key, sum)| sum.point(*key, &lattice)).collect();
    Ok(Cloud {
        points,
        normals: cloud.normals.as_ref().map(|_| sums.iter().map(Average::normal).collect()),
        sigma: cloud.sigma.as_ref().map(|_| sums.iter().map(Average::sigma).collect()),
        intensity: cloud.intensity.as_ref().map(|_| sums.iter().map(Average::intensity).collect()),
        rim: cloud.rim.as_ref().map(|_| sums.iter().map(|s| 2 * s.rim > s.count).collect()),
    })
}

#[derive(Debug, Default, Clone)]
struct Average {
    count: usize,
    offset: [f64; 3],
    normals: usize,
    normal: Vector3<f64>,
    sigmas: usize,
    /// Sum of squares relative to the square of `sigma_unit`, which is the first: no square leaves the range.
    variance: f64,
    sigma_unit: f64,
    intensities: usize,
    intensity: f64,
    rim: usize,
}

impl Sum for Average {
    type Source<'a> = Cloud;

    fn add(&mut self, index: usize, offset: [f64; 3], cloud: &Cloud) {
        self.count += 1;
        for (sum, value) in self.offset.iter_mut().zip(offset) {
            *sum += value;
        }
        if let Some(normal) = cloud.normals.as_ref().map(|n| n[index])
            && normal.iter().all(|v| v.is_finite())
        {
            self.normals += 1;
            self.normal += same_side(normal, &self.normal);
        }
        if let Some(sigma) = cloud.sigma.as_ref().map(|s| s[index])
            && !sigma.is_nan()
        {
            if self.sigmas == 0 {
                self.sigma_unit = sigma;
            }
            self.sigmas += 1;
            self.variance += (sigma / self.sigma_unit).powi(2);
        }
        if let Some(intensity) = cloud.intensity.as_ref().map(|v| v[index])
            && intensity.is_finite()
        {
            self.intensities += 1;
            self.intensity += intensity;
        }
        self.rim += usize::from(cloud.rim.as_ref().is_some_and(|r| r[index]));
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        for (sum, value) in self.offset.iter_mut().zip(other.offset) {
            *sum += value;
        }
        self.normals += other.normals;
        self.normal += same_side(other.normal, &self.normal);
        if self.sigmas == 0 {
            (self.sigma_unit, self.variance) = (other.sigma_unit, other.variance);
        } else if other.sigmas > 0 {
            self.variance += other.variance * (other.sigma_unit / self.sigma_unit).powi(2);
        }
        self.sigmas += other.sigmas;
        self.intensities += other.intensities;
        self.intensity += other.intensity;
        self.rim += other.rim;
    }
}

impl Average {
    fn point(&self, key: u64, lattice: &Lattice) -> Point3<f64> {
        let (cell, count) = (cell(key), self.count as f64);
        lattice.point(&[0, 1, 2].map(|k| f64::from(cell[k]) + 0.5 + self.offset[k] / count))
    }

    fn normal(&self) -> Vector3<f64> {
        let length = self.normal.norm();
        // Without any normal both sides are zero.
        if length > SHORTEST_MEAN_NORMAL * self.normals as f64 { self.normal / length } else { no_normal() }
    }

    fn sigma(&self) -> f64 {
        if self.sigmas == 0 { f64::NAN } else { self.sigma_unit * self.variance.sqrt() / self.sigmas as f64 }
    }

    fn intensity(&self) -> f64 {
        if self.intensities == 0 { f64::NAN } else { self.intensity / self.intensities as f64 }
    }
}

fn same_side(normal: Vector3<f64>, sum: &Vector3<f64>) -> Vector3<f64> {
    if normal.dot(sum) < 0.0 { -normal } else { normal }
}
