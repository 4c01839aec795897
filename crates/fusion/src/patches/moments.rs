//! Weighted moments of points, and the plane through them.

use std::sync::LazyLock;

use nalgebra::{Point3, Vector3};
use point_cloud::{eigenvalues3, eigenvector3};
use statistics::Distribution;

use crate::input::Observation;
use crate::small::{self, Symmetric};

/// Fewest points of a plane: three tell nothing about whether they lie on one.
const FEWEST_POINTS: f64 = 6.0;
/// Probability that points of a plane are taken for those of something else. Larger: flat places are left to the planes
/// beside them; smaller: edges are taken for planes.
const LEVEL: f64 = 0.05;
/// Least width of a patch, cells: narrower ones leave the normal to noise.
const LEAST_WIDTH: f64 = 0.1;
/// Largest standard deviation of a normal, rad: points a cell away then err by a tenth of a cell.
const LARGEST_TILT: f64 = 0.15;
/// The same of a normal that stands for itself.
const FIRM_TILT: f64 = 0.06;
/// Unevenness of surfaces that are flat, cells: where light grazes, noise along the normal vanishes and this is left.
const UNEVEN: f64 = 0.004;
/// Unevenness that is no noise, cells: a radius of curvature of five cells within one.
const SHAPED: f64 = 0.01;
/// Least square of the width of points over their thickness where noise is asked for.
const FLAT_2: f64 = 4.0;
/// Least cosine between normal and ray: below it a pixel covers more than twelve times its width, and noise along the normal is
/// that of the normal.
pub(crate) const LEAST_FACING: f64 = 0.08;

/// Sums over points about the centre of a cell, each with the weight of its variance.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments {
    count: f64,
    weight: f64,
    sum: Vector3<f64>,
    products: Symmetric,
    noise: Symmetric,
    sensor: Symmetric,
    /// Neighbourhoods that the points are of: as many errors of the sensor.
    neighbourhoods: f64,
    ray: Vector3<f64>,
}

/// A plane through points of one frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub point: Point3<f64>,
    /// On the side that it is seen from.
    pub normal: Vector3<f64>,
    /// Of the height at the point, without common errors, square metre.
    pub variance: f64,
    /// Of the inclination, square radian.
    pub tilt_variance: f64,
    /// Whether it goes through points of the cells around as well.
    pub is_firm: bool,
}

/// The plane that fits points best, whether they lie on it or not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    plane: Plane,
    /// Independent heights, and the degrees of freedom of their squares.
    free: f64,
    dof: f64,
    /// Variance of a height, square metre.
    expected: f64,
    /// Second moments, square metre: along the narrower side of the plane, and of the heights.
    width_2: f64,
    thickness_2: f64,
    is_seen: bool,
}

impl Fit {
    /// The plane, where the points about the centre lie on one.
    pub fn plane(&self, centre: &Point3<f64>, voxel_m: f64) -> Option<Plane> {
        static DEVIATIONS: LazyLock<f64> = LazyLock::new(|| Distribution::Normal.upper_quantile(LEVEL));
        let is_wide = self.width_2 > (LEAST_WIDTH * voxel_m).powi(2);
        let is_told = is_wide && self.plane.tilt_variance < LARGEST_TILT * LARGEST_TILT && self.is_seen;
        (is_told && self.thickness_2 * self.free < self.expected * largest_sum(self.dof, *DEVIATIONS))
            .then(|| Plane { point: centre + self.plane.point.coords, ..self.plane })
    }

    /// Squares of the heights over their variances and the degrees of freedom, where the points are so much wider than thick that noise has
    /// not chosen what is across.
    pub fn squares(&self, voxel_m: f64) -> Option<(f64, f64)> {
        let expected = self.expected + (SHAPED * voxel_m).powi(2);
        let is_flat = self.is_seen && self.width_2 > FLAT_2 * self.thickness_2;
        is_flat.then_some((self.thickness_2 * self.free / expected, self.dof))
    }
}

impl Moments {
    /// Adds a point, the first of its neighbourhood or another one.
    pub fn add(&mut self, observation: &Observation, is_first: bool, centre: &Point3<f64>) {
        let offset = observation.position - centre;
        let weight = 1.0 / observation.variance();
        self.count += 1.0;
        self.weight += weight;
        self.sum += offset * weight;
        small::add(&mut self.products, &small::outer(&offset), weight);
        small::add(&mut self.noise, &observation.noise(), weight);
        small::add(&mut self.sensor, &small::outer(&observation.shift()), weight);
        self.neighbourhoods += f64::from(u8::from(is_first));
        self.ray += observation.ray;
    }

    /// Adds moments about another centre, which lies `shift` from this one.
    pub fn include(&mut self, other: &Self, shift: &Vector3<f64>) {
        self.count += other.count;
        self.weight += other.weight;
        self.sum += other.sum + shift * other.weight;
        small::add(&mut self.products, &other.products, 1.0);
        small::add(&mut self.products, &small::outer(shift), other.weight);
        let cross = other.sum * shift.transpose();
        small::add(&mut self.products, &small::from_matrix(&(cross + cross.transpose())), 1.0);
        small::add(&mut self.noise, &other.noise, 1.0);
        small::add(&mut self.sensor, &other.sensor, 1.0);
        self.neighbourhoods += other.neighbourhoods;
        self.ray += other.ray;
    }

    /// Whether both are seen from one side of anything.
    pub fn sees_along(&self, other: &Self) -> bool {
        self.ray.dot(&other.ray) > 0.0
    }

    pub fn has_enough(&self) -> bool {
        self.count >= FEWEST_POINTS
    }

    /// The plane that fits best, from the centre of the sums; `common` is the covariance of what points of one frame have in common and those of others have not.
    ///
    /// Noise along the ray tilts the principal axes of scattered points; the scatter that it causes is taken off before.
    pub fn fit(&self, voxel_m: f64, common: &Symmetric) -> Option<Fit> {
        if !self.has_enough() {
            return None;
        }
        let mean = self.sum / self.weight;
        let mut scatter = self.products.map(|p| p / self.weight);
        small::add(&mut scatter, &small::outer(&mean), -1.0);
        let mut surface = scatter;
        small::add(&mut surface, &self.noise, -1.0 / self.weight);
        small::add(&mut surface, &self.sensor, -1.0 / self.weight);
        let matrix = small::to_matrix(&surface);
        let values = eigenvalues3(&matrix);
        let mut normal = eigenvector3(&matrix, values[0])?;
        if normal.dot(&self.ray) > 0.0 {
            normal = -normal;
        }
        let noise = small::quadratic(&self.noise, &normal) / self.weight;
        let sensor = small::quadratic(&self.sensor, &normal) / self.weight;
        let uneven = (UNEVEN * voxel_m).powi(2);
        let expected = noise + sensor + uneven + small::quadratic(common, &normal);
        let of_mean = (expected - sensor) / self.count + sensor / self.neighbourhoods;
        // Satterthwaite: a sum of squares of which a part is common to neighbourhoods varies as one of so many free ones.
        let crowd = self.count / self.neighbourhoods;
        let free = self.count / (1.0 + (crowd - 1.0) * (sensor / expected).powi(2));
        let tilt_variance = of_mean / values[1];
        let plane = Plane {
            point: Point3::from(mean),
            normal,
            variance: (noise + uneven) / self.count + sensor / self.neighbourhoods,
            tilt_variance,
            is_firm: tilt_variance < FIRM_TILT * FIRM_TILT,
        };
        Some(Fit {
            plane,
            free,
            dof: (free - 3.0).max(1.0),
            expected,
            width_2: values[1],
            thickness_2: small::quadratic(&scatter, &normal),
            is_seen: -normal.dot(&self.ray) > LEAST_FACING * self.ray.norm(),
        })
    }
}

/// The limit of a sum of squares in the approximation of Wilson and Hilferty, to 1 % from three degrees of freedom; its level is
/// that of so many standard deviations, upwards.
pub(crate) fn largest_sum(dof: f64, deviations: f64) -> f64 {
    let part = 2.0 / (9.0 * dof);
    dof * (1.0 - part + deviations * part.sqrt()).powi(3)
}

/// Part of the variance of a normal variable that is left where none beyond `limit` standard deviations is kept: that of a truncated one,
/// by its chi-squared distributions of three degrees of freedom and one.
pub(crate) fn variance_within(limit: f64) -> f64 {
    let within = |dof: f64| Distribution::ChiSquared { dof }.cumulative(limit * limit);
    within(3.0) / within(1.0)
}
