//! States carried on, corrected, and turned into their own axes, against repeated noise.

use inertial::{Biases, Error, ImuNoise, InertialSample, InertialState, NavigationState, StateCovariance};
use nalgebra::{Isometry3, Matrix6, SVector, UnitQuaternion, Vector3, Vector6};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::{Uncertain, pose_difference, step_pose};

use crate::path::{clean, gravity, velocity, world_from_body};

const HERTZ: f64 = 200.0;
const START_S: f64 = 0.5;
const END_S: f64 = 1.3;

/// Noise and walks that all count after a second.
fn noise() -> ImuNoise {
    ImuNoise { gyro_density: 1e-3, accel_density: 1e-2, gyro_walk: 3e-3, accel_walk: 3e-2, ..ImuNoise::default() }
}

fn true_state(time_s: f64, biases: Biases) -> InertialState {
    let navigation = NavigationState { world_from_body: world_from_body(time_s), velocity: velocity(time_s) };
    InertialState { time_s, navigation, biases, gravity: gravity(), covariance: StateCovariance::zeros() }
}

/// What the estimate lacks.
fn error(estimate: &InertialState, truth: &InertialState) -> SVector<f64, 18> {
    let (a, b) = (&estimate.navigation, &truth.navigation);
    let mut error = SVector::<f64, 18>::zeros();
    error.fixed_rows_mut::<6>(0).copy_from(&pose_difference(&a.world_from_body, &b.world_from_body));
    error.fixed_rows_mut::<3>(6).copy_from(&(b.velocity - a.velocity));
    error.fixed_rows_mut::<6>(9).copy_from(&(truth.biases.to_vector() - estimate.biases.to_vector()));
    error.fixed_rows_mut::<3>(15).copy_from(&(truth.gravity - estimate.gravity));
    error
}

fn normalised(estimate: &InertialState, truth: &InertialState, from: usize) -> f64 {
    let count = 18 - from;
    let error = error(estimate, truth).rows(from, count).into_owned();
    let covariance = estimate.covariance.view((from, from), (count, count)).into_owned();
    error.dot(&covariance.cholesky().unwrap().solve(&error)) / count as f64
}

/// A component's normalised square has mean 1; over 200 runs of 18 it scatters by 0.024.
#[test]
fn errors_of_a_state_carried_and_corrected_are_as_large_as_its_covariance_says() {
    let sigmas: [f64; 6] = [5e-3, 5e-3, 2e-2, 1e-2, 2e-2, 0.05];
    let mut start = StateCovariance::zeros();
    for (part, sigma) in sigmas.iter().enumerate() {
        (0..3).for_each(|k| start[(3 * part + k, 3 * part + k)] = sigma.powi(2));
    }
    // Errors of velocity and position go together.
    (0..3).for_each(|k| start[(k, 6 + k)] = 0.7 * sigmas[0] * sigmas[2]);
    (0..3).for_each(|k| start[(6 + k, k)] = start[(k, 6 + k)]);
    let root = start.cholesky().unwrap().l();
    let runs = 200;
    let mut means = [0.0; 3];
    for seed in 0..runs {
        let mut random = Pcg64::seed_from_u64(51_000 + seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut biases = Biases { gyro: Vector3::new(0.01, -0.02, 0.005), accel: Vector3::new(0.1, 0.05, -0.2) };
        let first = true_state(START_S, biases);
        let off = root * SVector::<f64, 18>::from_fn(|_, _| normal());
        let mut state = InertialState { covariance: start, ..first.clone() };
        let pose = &mut state.navigation;
        // The truth is the state's pose with the error as a step.
        let back = step_pose(&Isometry3::identity(), &off.fixed_rows::<6>(0).into_owned());
        let rotation = pose.world_from_body.rotation * back.rotation.inverse();
        let place = pose.world_from_body.translation.vector - off.fixed_rows::<3>(0);
        pose.world_from_body = Isometry3::from_parts(place.into(), rotation);
        pose.velocity -= off.fixed_rows::<3>(6);
        state.biases = Biases::from_vector(&(biases.to_vector() - off.fixed_rows::<6>(9)));
        state.gravity -= off.fixed_rows::<3>(15);
        let (mut samples, count) = (Vec::new(), ((END_S - START_S) * HERTZ).round() as usize);
        let walk = noise();
        for k in 0..=count {
            let sample = clean(START_S + k as f64 / HERTZ);
            let mut three = |sigma: f64| Vector3::new(normal(), normal(), normal()) * sigma;
            samples.push(InertialSample {
                angular_rate: sample.angular_rate + biases.gyro + three(walk.gyro_density * HERTZ.sqrt()),
                specific_force: sample.specific_force + biases.accel + three(walk.accel_density * HERTZ.sqrt()),
                ..sample
            });
            if k < count {
                biases.gyro += three(walk.gyro_walk / HERTZ.sqrt());
                biases.accel += three(walk.accel_walk / HERTZ.sqrt());
            }
        }
        let truth = true_state(END_S, biases);
        let mut found = state.carried(&samples, END_S, &noise()).unwrap();
        means[0] += normalised(&found, &truth, 0) / runs as f64;
        let sigma = 3e-3;
        let measured = step_pose(&world_from_body(END_S), &Vector6::from_fn(|_, _| sigma * normal()));
        found.learn(&Uncertain { pose: measured, covariance: Matrix6::identity() * sigma * sigma }).unwrap();
        means[1] += normalised(&found, &truth, 0) / runs as f64;
        let own = found.in_own_axes();
        assert_eq!((own.pose().pose, own.pose().covariance), (Isometry3::identity(), Matrix6::zeros()));
        means[2] += normalised(&own, &truth.in_own_axes(), 6) / runs as f64;
    }
    eprintln!("carried, corrected, in its own axes: {means:.3?}");
    assert!(means.iter().all(|mean| (mean - 1.0).abs() < 0.1), "{means:?}");
}

fn resting(seconds: f64, up: &Vector3<f64>, biases: &Biases, seed: u64) -> Vec<InertialSample> {
    let mut random = Pcg64::seed_from_u64(52_000 + seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let noise = ImuNoise::default();
    let sample = |k: i32| InertialSample {
        timestamp_s: f64::from(k) / HERTZ,
        angular_rate: biases.gyro + Vector3::new(normal(), normal(), normal()) * noise.gyro_density * HERTZ.sqrt(),
        specific_force: up
            + biases.accel
            + Vector3::new(normal(), normal(), normal()) * noise.accel_density * HERTZ.sqrt(),
    };
    (0..=(seconds * HERTZ) as i32).map(sample).collect()
}

/// Over 200 runs of nine; the velocity is exactly zero, which is left out.
#[test]
fn a_rest_tells_biases_and_gravity_as_well_as_it_says() {
    let (noise, runs) = (ImuNoise::default(), 200);
    let rotation = UnitQuaternion::from_euler_angles(0.4, -0.7, 0.2);
    let pose = Uncertain::exact(Isometry3::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), rotation));
    let mut mean = 0.0;
    for seed in 0..runs {
        let mut random = Pcg64::seed_from_u64(53_000 + seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut three = |sigma: f64| Vector3::new(normal(), normal(), normal()) * sigma;
        let biases = Biases { gyro: three(noise.gyro_bias_sigma), accel: three(noise.accel_bias_sigma) };
        let gravity = Vector3::new(0.0, 0.0, -9.80665 - 0.02 * normal());
        let samples = resting(2.0, &(rotation.inverse() * -gravity), &biases, seed);
        let state = InertialState::at_rest(&samples, 2.0, &pose, &noise).unwrap();
        let navigation = NavigationState { world_from_body: pose.pose, velocity: Vector3::zeros() };
        let truth = InertialState { navigation, biases, gravity, ..state.clone() };
        mean += normalised(&state, &truth, 9) / runs as f64;
        // The length of gravity tells the bias along it.
        let up = rotation.inverse() * -state.gravity.normalize();
        let along = state.covariance.fixed_view::<3, 3>(12, 12) * up;
        assert!((up.dot(&along).sqrt() - 0.02).abs() < 2e-3, "{}", up.dot(&along).sqrt());
    }
    eprintln!("after a rest: {mean:.3}");
    assert!((mean - 1.0).abs() < 0.1, "{mean}");
}

#[test]
fn what_is_no_rest_and_no_pose_is_refused() {
    let noise = ImuNoise::default();
    let here = Uncertain::exact(Isometry3::identity());
    let samples = resting(2.0, &(Vector3::z() * 9.80665), &Biases::zero(), 0);
    assert!(matches!(InertialState::at_rest(&samples, 0.3, &here, &noise), Err(Error::Unrest(_))));
    let moving: Vec<InertialSample> = (0..400).map(|k| clean(f64::from(k) / HERTZ)).collect();
    assert!(matches!(InertialState::at_rest(&moving, 2.0, &here, &noise), Err(Error::Unrest(_))));
    let mut state = InertialState::at_rest(&samples, 1.0, &here, &noise).unwrap();
    assert!(matches!(state.carried(&samples, 3.0, &noise), Err(Error::Gap { .. })));
    let before = state.clone();
    assert_eq!(state.carried(&samples, 0.5, &noise).unwrap(), before);
    for variance in [f64::NAN, f64::INFINITY, -1.0] {
        let pose = Uncertain { covariance: Matrix6::identity() * variance, ..here };
        assert!(matches!(state.learn(&pose), Err(Error::InvalidCovariance)), "{variance}");
        assert_eq!(state, before);
    }
}
