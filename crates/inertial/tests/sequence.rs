//! Sequences of camera poses with a unit.

use inertial::{
    Biases, CameraPose, Error, ImuNoise, InertialSample, InertialSequence, Mounting, SequenceOptions, estimate_sequence,
};
use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::{Uncertain, pose_difference, step_pose};

use crate::path::{gravity, measured, velocity, world_from_body};

/// 2 mm and 2 mrad.
const SIGMA: f64 = 2e-3;

fn camera_from_body() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.03, -0.02, 0.05), Vector3::new(0.1, 1.5, -0.3))
}

fn noise() -> ImuNoise {
    ImuNoise { gyro_density: 1e-3, accel_density: 1e-2, ..ImuNoise::default() }
}

fn options() -> SequenceOptions {
    SequenceOptions { noise: noise(), mounting: Mounting::Known(camera_from_body()), ..SequenceOptions::default() }
}

/// Noisy camera poses at 10 Hz.
fn poses(count: usize, seed: u64) -> Vec<CameraPose> {
    let mut random = Pcg64::seed_from_u64(77_000 + seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    (0..count)
        .map(|k| {
            let time_s = 0.5 + 0.1 * k as f64;
            let truth = world_from_body(time_s) * camera_from_body().inverse();
            let pose = step_pose(&truth, &Vector6::from_fn(|_, _| SIGMA * normal()));
            CameraPose { time_s, pose: Uncertain { pose, covariance: Matrix6::identity() * SIGMA * SIGMA } }
        })
        .collect()
}

/// Biases as large as at switching on.
fn biases(seed: u64) -> Biases {
    let mut random = Pcg64::seed_from_u64(33_000 + seed);
    let mut normal = || Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut random) });
    Biases { gyro: normal() * noise().gyro_bias_sigma, accel: normal() * noise().accel_bias_sigma }
}

fn samples(count: usize, seed: u64) -> Vec<InertialSample> {
    measured([0.3, 0.8 + 0.1 * count as f64], 200.0, &noise(), &biases(seed), seed)
}

/// Error of biases, velocity in the middle and gravity's direction over their covariances.
fn normalised(found: &InertialSequence, seed: u64) -> [f64; 3] {
    let middle = &found.states[found.states.len() / 2];
    let bias = middle.biases.to_vector() - biases(seed).to_vector();
    let faster = middle.velocity - velocity(middle.time_s);
    let down = found.gravity - gravity();
    [
        bias.dot(&middle.bias_covariance().cholesky().unwrap().solve(&bias)) / 6.0,
        faster.dot(&middle.velocity_covariance().cholesky().unwrap().solve(&faster)) / 3.0,
        down.dot(&found.gravity_covariance.cholesky().unwrap().solve(&down)) / 3.0,
    ]
}

const RUNS: u64 = 400;

#[test]
fn errors_are_as_large_as_the_covariances_say() {
    require_true_covariances(5);
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn errors_of_long_sequences_are_as_large_as_the_covariances_say() {
    require_true_covariances(25);
}

/// A component's normalised square has mean 1; over 400 runs of three it scatters by 0.04. Constant biases walk less than stated, which
/// lowers theirs; gravity of exactly its stated length lowers its own.
fn require_true_covariances(count: usize) {
    let (mut sums, mut unit, mut beyond, mut doubted) = ([0.0; 3], 0.0, 0, 0);
    for seed in 0..RUNS {
        let found = estimate_sequence(&poses(count, seed), &samples(count, seed), &options()).unwrap();
        doubted += found.contradicting.len();
        let squares = normalised(&found, seed);
        sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square / RUNS as f64);
        unit += found.sigma0.unwrap().powi(2) / RUNS as f64;
        let state = &found.states[count / 2];
        let error = state.biases.to_vector() - biases(seed).to_vector();
        beyond += error
            .iter()
            .zip(state.bias_covariance().diagonal().iter())
            .filter(|(e, v)| e.abs() > 3.0 * v.sqrt())
            .count();
    }
    eprintln!("{count}: {sums:.3?} {unit:.3} {beyond}");
    assert!(sums[0] > 0.8 && sums[0] < 1.1, "{count}: biases {}", sums[0]);
    assert!((sums[1] - 1.0).abs() < 0.1, "{count}: velocity {}", sums[1]);
    assert!(sums[2] > 0.6 && sums[2] < 1.1, "{count}: gravity {}", sums[2]);
    assert!((unit - 1.0).abs() < 0.1, "{count}: {unit}");
    // One sequence in a thousand.
    assert!(doubted <= 2, "{count}: {doubted}");
    // 0.3 % of 2400 values.
    assert!(beyond < 20, "{count}: {beyond}");
}

#[test]
fn the_rotation_of_the_mounting_is_found_from_nothing() {
    let lever_arm = camera_from_body().translation.vector;
    let open = SequenceOptions { mounting: Mounting::UnknownRotation { lever_arm }, ..options() };
    let mut sum = 0.0;
    let runs = 100;
    for seed in 0..runs {
        let found = estimate_sequence(&poses(20, seed), &samples(20, seed), &open).unwrap();
        let error: SVector<f64, 3> =
            pose_difference(&camera_from_body(), &found.camera_from_body.pose).fixed_rows::<3>(3).into_owned();
        let covariance: SMatrix<f64, 3, 3> = found.camera_from_body.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        assert!(covariance.trace().sqrt() < 0.02);
        sum += error.dot(&covariance.cholesky().unwrap().solve(&error)) / (3.0 * runs as f64);
    }
    // Mean over 100 runs of three: 1 ± 0.08; a little more than two of these.
    assert!((sum - 1.0).abs() < 0.2, "{sum}");
}

#[test]
fn a_wild_sample_is_named() {
    let mut wild = samples(20, 1);
    let at = wild.iter().position(|sample| sample.timestamp_s > 1.23).unwrap();
    wild[at].specific_force.x += 300.0;
    let found = estimate_sequence(&poses(20, 1), &wild, &options()).unwrap();
    assert_eq!(found.contradicting, [7]);
    let clean = estimate_sequence(&poses(20, 1), &samples(20, 1), &options()).unwrap();
    let gap = found.states[3].biases.to_vector() - clean.states[3].biases.to_vector();
    let sigma = clean.states[3].bias_covariance().diagonal().map(f64::sqrt);
    assert!((0..6).all(|k| gap[k].abs() < 3.0 * sigma[k]), "{gap}");
}

#[test]
fn what_is_mixed_up_is_refused() {
    let (poses, good) = (poses(20, 2), samples(20, 2));
    let change = |change: fn(&mut InertialSample)| {
        let mut samples = good.clone();
        samples.iter_mut().for_each(change);
        estimate_sequence(&poses, &samples, &options())
    };
    let degrees = change(|sample| sample.angular_rate = sample.angular_rate.map(f64::to_degrees));
    assert!(matches!(degrees, Err(Error::Contradiction { angle_ratio, .. }) if angle_ratio > 40.0), "{degrees:?}");
    let left = change(|sample| sample.angular_rate = -sample.angular_rate);
    assert!(matches!(left, Err(Error::Contradiction { .. })), "{left:?}");
    let mirrored = change(|sample| {
        (sample.angular_rate.y, sample.specific_force.y) = (-sample.angular_rate.y, -sample.specific_force.y);
    });
    assert!(matches!(mirrored, Err(Error::Contradiction { .. })), "{mirrored:?}");
    let gravities = change(|sample| sample.specific_force /= 9.80665);
    assert!(gravities.is_err_and(|error| error.to_string().contains("units of gravity")));
    let taken_off = change(|sample| sample.specific_force *= 0.01);
    assert!(taken_off.is_err_and(|error| error.to_string().contains("gravity was taken off")));
    let milliseconds = change(|sample| sample.timestamp_s *= 1000.0);
    assert!(matches!(milliseconds, Err(Error::Gap { .. })));
    let late = change(|sample| sample.timestamp_s += 0.3);
    assert!(late.is_err(), "{late:?}");
    let identical: Vec<CameraPose> = poses.iter().map(|pose| CameraPose { pose: poses[0].pose, ..*pose }).collect();
    let still = estimate_sequence(&identical, &good, &options());
    assert!(matches!(still, Err(Error::Contradiction { .. })), "{still:?}");
    assert!(matches!(estimate_sequence(&poses[..1], &good, &options()), Err(Error::TooFewPoses { found: 1, .. })));
    assert!(matches!(estimate_sequence(&[], &good, &options()), Err(Error::TooFewPoses { found: 0, .. })));
    assert!(matches!(estimate_sequence(&poses, &[], &options()), Err(Error::Gap { .. })));
    let mut swapped = poses.clone();
    swapped.swap(3, 4);
    assert!(matches!(estimate_sequence(&swapped, &good, &options()), Err(Error::NotAscending { .. })));
    let mut broken = poses.clone();
    broken[5].pose.covariance.fill(0.0);
    assert!(matches!(estimate_sequence(&broken, &good, &options()), Err(Error::InvalidPose { index: 5, .. })));
    broken[5].pose.covariance[(0, 0)] = f64::NAN;
    assert!(matches!(estimate_sequence(&broken, &good, &options()), Err(Error::InvalidPose { index: 5, .. })));
    let bad = SequenceOptions { gravity_m_s2: -1.0, ..options() };
    assert!(matches!(estimate_sequence(&poses, &good, &bad), Err(Error::InvalidOption { name: "gravity_m_s2", .. })));
}

/// Pose, velocity, biases and gravity of a state together: 18 are expected. Gravity has its exact length and biases do not walk here,
/// so that somewhat less comes out.
#[test]
fn a_whole_state_is_off_as_its_covariance_says() {
    let runs = 100;
    let mut mean = 0.0;
    for seed in 0..runs {
        let found = estimate_sequence(&poses(8, seed), &samples(8, seed), &options()).unwrap();
        let state = found.states.last().unwrap();
        let truth = world_from_body(state.time_s) * camera_from_body().inverse();
        let mut off = SVector::<f64, 18>::zeros();
        off.fixed_rows_mut::<6>(0).copy_from(&pose_difference(&truth, &state.world_from_camera.pose));
        off.fixed_rows_mut::<3>(6).copy_from(&(state.velocity - velocity(state.time_s)));
        off.fixed_rows_mut::<6>(9).copy_from(&(state.biases.to_vector() - biases(seed).to_vector()));
        off.fixed_rows_mut::<3>(15).copy_from(&(found.gravity - gravity()));
        mean += off.dot(&state.covariance.cholesky().unwrap().solve(&off)) / runs as f64;
    }
    // Chi-squared of 18 over 100 runs scatters by 0.6.
    assert!((15.0..19.5).contains(&mean), "{mean}");
}

/// A unit that shakes: forces five times as noisy as its sheet says, rates as they are.
#[test]
fn noise_at_work_is_found_from_the_motions_and_stated() {
    let at_work = ImuNoise { accel_density: 5.0 * noise().accel_density, ..noise() };
    let (count, runs) = (60, 10);
    let (mut velocities, mut ratios, mut rates, mut contradicting) = (0.0, Vec::new(), 0, 0);
    for seed in 0..runs {
        let samples = measured([0.3, 0.8 + 0.1 * count as f64], 200.0, &at_work, &biases(seed), seed);
        let found = estimate_sequence(&poses(count, seed), &samples, &options()).unwrap();
        ratios.push(found.noise.accel_density / noise().accel_density);
        rates += usize::from(found.noise.gyro_density > noise().gyro_density);
        velocities += normalised(&found, seed)[1] / runs as f64;
        contradicting += found.contradicting.len();
    }
    let mean = ratios.iter().sum::<f64>() / runs as f64;
    eprintln!(
        "forces {mean:.2} times, rates raised in {rates}, velocities {velocities:.2}, contradicting {contradicting}"
    );
    assert!((4.0..6.0).contains(&mean), "{mean}");
    assert!((velocities - 1.0).abs() < 0.3, "{velocities}");
    assert!(rates <= 2 && contradicting <= 4, "{rates} {contradicting}");
}
