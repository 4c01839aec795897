//! The weighted least-squares plane through the points of a place.
//!
//! A point's height over the place's plane is `h = h₀ + τ₁ s + τ₂ t + b + ε`, where s, t is where its ray meets the plane, b what
//! its neighbourhood shares and ε its noise along the normal. Each b is eliminated with its variance: the weights of
//! its points, W together, shrink by `1 + W σ_b²`. Common errors stay in the sums, frame by frame.

use nalgebra::{Matrix2, Matrix3, Point3, Vector2, Vector3};

use crate::input::{NO_NEIGHBOURHOOD, Observation};
use crate::patches::{Seed, largest_sum};
use crate::small;

/// Fewest points of a fused point: a mean of less is no surface.
pub(crate) const FEWEST_POINTS: usize = 1;
/// Least radius, cells, of a fused point whose few points scatter less.
const LEAST_RADIUS: f64 = 0.35;
/// Unevenness that is no edge, cells: a radius of curvature of ten cells.
const UNEVEN: f64 = 0.01;
/// Standard deviation of the inclination against the plane that is there before, rad. It decides where points form a line.
const TILT: f64 = 0.1;

/// Sums over the points of one frame.
#[derive(Debug, Clone)]
pub(crate) struct FrameSums {
    pub frame: u32,
    /// The point next to the middle of the place.
    pub stands_for: u32,
    pub count: u32,
    /// Normal matrix of `[h₀, τ₁, τ₂]`.
    pub normal: Matrix3<f64>,
    pub right: Vector3<f64>,
    /// Weighted sum of the squared heights.
    pub square: f64,
    /// Variances of the mean times the square of its weight: noise, sensor.
    pub noise: f64,
    pub sensor: f64,
    /// Variances that points share with their neighbourhoods over those of their noise, summed.
    pub shared: f64,
    /// Weight and derivative of the neighbourhood that counts most, times its deviation.
    strongest: (u64, f64),
    second_moments: Vector3<f64>,
}

impl FrameSums {
    /// Adds what another frame saw.
    pub fn include(&mut self, other: &Self) {
        self.count += other.count;
        self.normal += other.normal;
        self.right += other.right;
        self.square += other.square;
        self.noise += other.noise;
        self.sensor += other.sensor;
        self.shared += other.shared;
        self.second_moments += other.second_moments;
    }
}

/// A place with its plane.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    pub position: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Weight of the mean height, one over square metre.
    pub weight: f64,
    pub noise_variance: f64,
    pub sensor_variance: f64,
    /// The neighbourhood with the largest part of the sensor's variance, and the shift of the mean by its deviation.
    pub strongest: (u64, f64),
    pub frames: Vec<FrameSums>,
    /// Second central moments of the points along the tangents: ss, st, tt.
    pub moments: Vector3<f64>,
    pub tilt_variance: f64,
    pub count: u32,
    /// Height over the place's plane as it was before: constant, along s, along t.
    pub solution: Vector3<f64>,
    /// The axes of s and t.
    pub tangents: [Vector3<f64>; 2],
}

impl Estimate {
    /// Variance of the height without common errors.
    pub fn own_variance(&self) -> f64 {
        self.noise_variance + self.sensor_variance
    }

    /// Radius of a disc that scatters as the points do.
    pub fn radius_m(&self, voxel_m: f64) -> f64 {
        (2.0 * (self.moments[0] + self.moments[2])).sqrt().max(LEAST_RADIUS * voxel_m)
    }

    /// Whether the points of each frame lie on a plane, the same for all but its height, as far as noise tells. What a neighbourhood
    /// shares may change within it, as where a camera smooths its ranges, and counts as noise of its points here.
    pub fn is_plane(&self, deviations: f64, voxel_m: f64) -> bool {
        let x = &self.solution;
        let squares = |frame: &FrameSums| {
            let about_plane = frame.square - 2.0 * frame.right.dot(x) + x.dot(&(frame.normal * x));
            let mean = frame.right[0] - frame.normal.row(0).transpose().dot(x);
            about_plane - mean * mean / frame.normal[(0, 0)]
        };
        let dof = f64::from(self.count) - self.frames.len() as f64 - 2.0;
        let found: f64 = self.frames.iter().map(squares).sum();
        let uneven = (UNEVEN * voxel_m).powi(2) * self.weight;
        let points: f64 = self.frames.iter().map(|frame| f64::from(frame.count)).sum();
        let shared: f64 = self.frames.iter().map(|frame| frame.shared).sum();
        dof < 1.0 || found <= largest_sum(dof, deviations) * (1.0 + shared / points) + uneven
    }

    /// The place on the plane that was found; `common` is the variance of common errors of the height.
    pub fn seed(&self, before: &Seed, common: f64) -> Seed {
        let anchor = before.anchor - self.normal * self.normal.dot(&(before.anchor - self.position));
        let aside = (anchor - self.position).norm_squared();
        let variance = self.own_variance() + self.tilt_variance * aside + common;
        Seed { anchor, normal: self.normal, variance, common, tilt_variance: self.tilt_variance, ..*before }
    }
}

/// Weights of neighbourhoods at places, and how many places each serves.
pub(crate) trait Spread: Sync {
    /// By how much the variance of what a neighbourhood shares counts at one place.
    fn factor(&self, neighbourhood: u64) -> f64;
}

/// Each place for itself.
pub(crate) struct Alone;

impl Spread for Alone {
    fn factor(&self, _: u64) -> f64 {
        1.0
    }
}

/// Frame, neighbourhood and number of the points of a place, neighbours together.
pub(crate) fn runs(members: &[u32], all: &[Observation]) -> Vec<(u32, u64, u32)> {
    let mut keyed: Vec<(u32, u64, u32)> =
        members.iter().map(|at| (all[*at as usize].frame, all[*at as usize].neighbourhood, *at)).collect();
    keyed.sort_unstable();
    keyed
}

/// The plane of some points; `None` for fewer than [`FEWEST_POINTS`].
pub(crate) fn estimate(seed: &Seed, members: &[u32], all: &[Observation], spread: &dyn Spread) -> Option<Estimate> {
    if members.len() < FEWEST_POINTS {
        return None;
    }
    let tangents = small::tangents(&seed.normal);
    let keyed = runs(members, all);
    let mut frames: Vec<(u32, FrameSums)> = keyed
        .chunk_by(|a, b| a.0 == b.0)
        .map(|of_frame| {
            let first = of_frame.iter().map(|(_, _, at)| *at).min().unwrap_or(0);
            (first, frame_sums(seed, &tangents, of_frame, all, spread))
        })
        .collect();
    // The order of frames in sums is not that of their numbers.
    frames.sort_by_key(|(first, _)| *first);
    Some(solved(seed, &tangents, frames.into_iter().map(|(_, sums)| sums).collect()))
}

fn frame_sums(
    seed: &Seed,
    tangents: &[Vector3<f64>; 2],
    of_frame: &[(u32, u64, u32)],
    all: &[Observation],
    spread: &dyn Spread,
) -> FrameSums {
    let mut sums = FrameSums {
        frame: of_frame[0].0,
        stands_for: of_frame[0].2,
        count: of_frame.len() as u32,
        normal: Matrix3::zeros(),
        right: Vector3::zeros(),
        square: 0.0,
        noise: 0.0,
        sensor: 0.0,
        shared: 0.0,
        strongest: (NO_NEIGHBOURHOOD, 0.0),
        second_moments: Vector3::zeros(),
    };
    let mut nearest = f64::INFINITY;
    for run in of_frame.chunk_by(|a, b| a.1 == b.1) {
        let (mut normal, mut right, mut moments) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
        let (mut square, mut shift) = (0.0, 0.0);
        for (_, _, at) in run {
            let point = &all[*at as usize];
            let height = seed.normal.dot(&(point.position - seed.anchor));
            let foot = point.position - point.ray * (height / seed.normal.dot(&point.ray)) - seed.anchor;
            let row = Vector3::new(1.0, foot.dot(&tangents[0]), foot.dot(&tangents[1]));
            let weight = 1.0 / seed.noise(point);
            normal += row * row.transpose() * weight;
            right += row * (weight * height);
            square += weight * height * height;
            moments += Vector3::new(row.y * row.y, row.y * row.z, row.z * row.z) * weight;
            let own_shift = point.shift().dot(&seed.normal);
            shift += weight * own_shift;
            sums.shared += weight * own_shift * own_shift;
            let aside = foot.norm_squared();
            if aside < nearest {
                (nearest, sums.stands_for) = (aside, *at);
            }
        }
        let weight = normal[(0, 0)];
        shift /= weight;
        let shared = shift * shift * spread.factor(run[0].1);
        let kept = 1.0 / (1.0 + weight * shared);
        let column: Vector3<f64> = normal.column(0).into();
        sums.normal += normal - column * column.transpose() * (shared * kept);
        sums.right += right - column * (shared * kept * right[0]);
        sums.square += square - shared * kept * right[0] * right[0];
        sums.noise += weight * kept * kept;
        let derivative = weight * kept * shift;
        sums.sensor += derivative * derivative;
        if derivative.abs() > sums.strongest.1.abs() {
            sums.strongest = (run[0].1, derivative);
        }
        sums.second_moments += moments * kept;
    }
    sums
}

/// The plane from the sums of all frames: at the weighted centre of the points, where the height does not depend on the
/// inclination.
fn solved(seed: &Seed, tangents: &[Vector3<f64>; 2], frames: Vec<FrameSums>) -> Estimate {
    let normal: Matrix3<f64> = frames.iter().map(|f| f.normal).sum();
    let right: Vector3<f64> = frames.iter().map(|f| f.right).sum();
    let weight = normal[(0, 0)];
    let height = right[0] / weight;
    let centre = Vector2::new(normal[(0, 1)], normal[(0, 2)]) / weight;
    let prior = 1.0 / (TILT * TILT);
    let mut of_tilt: Matrix2<f64> = normal.fixed_view::<2, 2>(1, 1) - centre * centre.transpose() * weight;
    of_tilt += Matrix2::identity() * prior;
    let right_of_tilt = Vector2::new(right[1], right[2]) - centre * (weight * height);
    let inverse =
        Matrix2::new(of_tilt[(1, 1)], -of_tilt[(0, 1)], -of_tilt[(0, 1)], of_tilt[(0, 0)]) / of_tilt.determinant();
    let tilt = inverse * right_of_tilt;
    let sum = |value: fn(&FrameSums) -> f64| frames.iter().map(value).sum::<f64>();
    let second: Vector3<f64> = frames.iter().map(|f| f.second_moments).sum::<Vector3<f64>>() / weight;
    let moments = second - Vector3::new(centre.x * centre.x, centre.x * centre.y, centre.y * centre.y);
    let strongest = frames.iter().map(|f| f.strongest).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let strongest = strongest.map_or((NO_NEIGHBOURHOOD, 0.0), |(id, by)| (id, by / weight));
    Estimate {
        position: seed.anchor + tangents[0] * centre.x + tangents[1] * centre.y + seed.normal * height,
        normal: (seed.normal - tangents[0] * tilt.x - tangents[1] * tilt.y).normalize(),
        weight,
        noise_variance: sum(|f| f.noise) / (weight * weight),
        sensor_variance: sum(|f| f.sensor) / (weight * weight),
        strongest,
        moments: Vector3::new(moments[0].max(0.0), moments[1], moments[2].max(0.0)),
        tilt_variance: 0.5 * inverse.trace(),
        count: frames.iter().map(|f| f.count).sum(),
        solution: Vector3::new(height - tilt.dot(&centre), tilt.x, tilt.y),
        tangents: *tangents,
        frames,
    }
}
