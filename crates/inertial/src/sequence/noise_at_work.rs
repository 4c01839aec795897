//! The noise that a unit has at work: what its sheet says holds on a table, and motors, steps and hands shake it.
//!
//! Two intervals that follow each other tell the velocity between them twice, and each of them its turn; what both ways differ by comes from
//! the known errors of the camera's poses and from the unit's noise. Over longer intervals poses tell velocities better and the unit worse:
//! lengths are doubled, and the one that tells most of the noise is taken. No weight of the adjustment is in that: there, poses would give
//! way to a unit that is trusted too much.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Vector3};
use rigid_pose::product_jacobians;
use statistics::quantile;

use crate::noise::ImuNoise;
use crate::preintegrated::{POSITION, Preintegrated, ROTATION, VELOCITY};
use crate::sequence::options::CameraPose;

/// One-sided quantile of the normal distribution at 0.1 %: how sure it must be that a unit is noisier than it is said to be.
const SIGNIFICANCE: f64 = 3.09;
/// Share of the misclosures that is taken as sound, and the quantile of chi-squared (one degree of freedom) there: a wild sample is in two
/// or three of them. The median uses little more than half as much of what they tell.
const SOUND: f64 = 0.8;
const SOUND_SQUARE: f64 = 1.642_374;
/// Biases that the misclosures of a kind have told themselves; velocities have told the direction of gravity besides.
const BIASES: usize = 3;
/// Standard deviation of the scale from one misclosure, as a share of it: 0.89 by that quantile, and neighbours share a pose.
const SCATTER: f64 = 1.0;
/// Times its stated noise that a unit may have. Phones in a hand and drones at work have up to ten; wrong units, axes and clocks are
/// far beyond, and must not pass for noise.
const LARGEST: f64 = 30.0;

/// A misclosure and its variances by the poses and by the unit's stated noise.
struct Misclosure {
    value: f64,
    by_poses: f64,
    by_unit: f64,
}

/// What is known beside the motions.
pub(crate) struct Known<'a> {
    pub(crate) poses: &'a [CameraPose],
    pub(crate) camera_from_body: Isometry3<f64>,
    pub(crate) gravity: Vector3<f64>,
}

/// The noise with the densities that the motions show, where these are larger than stated; as stated where they are larger than those of
/// any unit.
pub(crate) fn noise_at_work(known: &Known<'_>, motions: &[Preintegrated], stated: &ImuNoise) -> ImuNoise {
    let bodies: Vec<(Isometry3<f64>, Matrix6<f64>)> = known.poses.iter().map(|pose| body(known, pose)).collect();
    let (mut turns, mut velocities) = (Told::default(), Told::default());
    let mut length = 1;
    while length <= motions.len() {
        let joined: Vec<Preintegrated> = motions.chunks_exact(length).map(Preintegrated::joined).collect();
        let ends: Vec<_> = bodies.iter().step_by(length).copied().collect();
        let steps = |k: usize| velocity(&ends[k..], &joined[k..], &known.gravity);
        turns.take(BIASES, &(0..joined.len()).flat_map(|k| turn(&ends[k..], &joined[k])).collect::<Vec<_>>());
        velocities.take(BIASES + 2, &(1..joined.len()).flat_map(|k| steps(k - 1)).collect::<Vec<_>>());
        length *= 2;
    }
    if turns.beyond || velocities.beyond {
        return *stated;
    }
    ImuNoise {
        gyro_density: stated.gyro_density * turns.factor,
        accel_density: stated.accel_density * velocities.factor,
        ..*stated
    }
}

/// What misclosures of several lengths tell of a noise.
struct Told {
    /// Factor of the standard deviation.
    factor: f64,
    /// How much the length told that it comes from: misclosures, each with the square of the unit's share of its variance.
    information: f64,
    /// Whether it is more than any unit has.
    beyond: bool,
}

impl Default for Told {
    fn default() -> Self {
        Self { factor: 1.0, information: 0.0, beyond: false }
    }
}

impl Told {
    fn take(&mut self, unknowns: usize, misclosures: &[Misclosure]) {
        let Some(factor) = excess(unknowns, misclosures) else {
            self.beyond = true;
            return;
        };
        let share = |m: &Misclosure| factor * factor * m.by_unit / (m.by_poses + factor * factor * m.by_unit);
        let information = misclosures.iter().map(|m| share(m).powi(2)).sum::<f64>();
        if factor > 1.0 && information > self.information {
            (self.factor, self.information) = (factor, information);
        }
    }
}

fn body(known: &Known<'_>, camera: &CameraPose) -> (Isometry3<f64>, Matrix6<f64>) {
    let to_body = product_jacobians(&camera.pose.pose, &known.camera_from_body).0;
    (camera.pose.pose * known.camera_from_body, to_body * camera.pose.covariance * to_body.transpose())
}

/// By what the turn of the unit differs from that of the camera.
fn turn(bodies: &[(Isometry3<f64>, Matrix6<f64>)], motion: &Preintegrated) -> [Misclosure; 3] {
    let [from, to] = [0, 1].map(|k| bodies[k].0.rotation);
    let turned = from.inverse() * to;
    let value = (motion.rotation.inverse() * turned).scaled_axis();
    let back = turned.inverse().to_rotation_matrix().into_inner();
    let attitude = |k: usize| bodies[k].1.fixed_view::<3, 3>(3, 3).into_owned();
    let by_poses = back * attitude(0) * back.transpose() + attitude(1);
    let by_unit = motion.covariance.fixed_view::<3, 3>(ROTATION, ROTATION);
    [0, 1, 2].map(|k| Misclosure { value: value[k], by_poses: by_poses[(k, k)], by_unit: by_unit[(k, k)] })
}

/// By what the velocity at the second of three poses differs, told by the way to it and by the way from it.
fn velocity(
    bodies: &[(Isometry3<f64>, Matrix6<f64>)],
    motions: &[Preintegrated],
    gravity: &Vector3<f64>,
) -> [Misclosure; 3] {
    let (first, second) = (&motions[0], &motions[1]);
    let (t0, t1) = (first.seconds, second.seconds);
    let [p0, p1, p2] = [0, 1, 2].map(|k| bodies[k].0.translation.vector);
    let [r0, r1] = [0, 1].map(|k| bodies[k].0.rotation.to_rotation_matrix().into_inner());
    let gained = first.velocity - first.position / t0;
    let arriving = (p1 - p0) / t0 + gravity * (t0 / 2.0) + r0 * gained;
    let leaving = (p2 - p1) / t1 - gravity * (t1 / 2.0) - r1 * second.position / t1;
    let value = arriving - leaving;
    let of_pose = |k: usize, by_place: f64, by_turn: Matrix3<f64>| {
        let mut by = SMatrix::<f64, 3, 6>::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * by_place));
        by.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_turn);
        by * bodies[k].1 * by.transpose()
    };
    let by_poses = of_pose(0, -1.0 / t0, -r0 * gained.cross_matrix())
        + of_pose(1, 1.0 / t0 + 1.0 / t1, -r1 * (second.position / t1).cross_matrix())
        + of_pose(2, -1.0 / t1, Matrix3::zeros());
    let mut by = SMatrix::<f64, 3, 9>::zeros();
    by.fixed_view_mut::<3, 3>(0, VELOCITY).copy_from(&r0);
    by.fixed_view_mut::<3, 3>(0, POSITION).copy_from(&(-r0 / t0));
    let far = second.covariance.fixed_view::<3, 3>(POSITION, POSITION) / (t1 * t1);
    let by_unit = by * first.covariance * by.transpose() + r1 * far * r1.transpose();
    [0, 1, 2].map(|k| Misclosure { value: value[k], by_poses: by_poses[(k, k)], by_unit: by_unit[(k, k)] })
}

/// The factor of the unit's standard deviations with which four fifths of the squares lie below their quantile; 1 where nothing speaks for more;
/// `None` where it is more than any unit has. A fifth of the misclosures may be wrong.
fn excess(unknowns: usize, misclosures: &[Misclosure]) -> Option<f64> {
    if misclosures.len() <= 2 * unknowns {
        return Some(1.0);
    }
    let free = (misclosures.len() - unknowns) as f64;
    let share = misclosures.len() as f64 / free;
    let scale = |factor: f64| {
        let square = |m: &Misclosure| m.value * m.value / (m.by_poses + factor * factor * m.by_unit);
        (quantile(&mut misclosures.iter().map(square).collect::<Vec<f64>>(), SOUND) * share / SOUND_SQUARE).sqrt()
    };
    if scale(1.0) <= 1.0 + SIGNIFICANCE * SCATTER / free.sqrt() {
        return Some(1.0);
    }
    if scale(LARGEST) > 1.0 {
        return None;
    }
    let mut within = [1.0, LARGEST];
    // Halved until a factor is told to a thousandth.
    while within[1] > 1.001 * within[0] {
        let middle = (within[0] * within[1]).sqrt();
        within[usize::from(scale(middle) <= 1.0)] = middle;
    }
    Some(within[1])
}
