//! Motions between frames by an inertial unit on a body whose way is known in closed form.

use approx::assert_relative_eq;
use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use rigid_pose::{pose_difference, step_pose};
use tracking::inertial::{self, Unrest};
use tracking::{Error, ImuIntegrator, ImuNoise, InertialSample, MotionPrior};

const GRAVITY: f64 = 9.80665;
const RADIUS: f64 = 0.8;
/// Growth of the angular acceleration on the circle, rad/s³.
const SPIN_UP: f64 = 3.0;

/// A body on a tilted mount that runs on a horizontal circle, from rest at t = 0.
fn world_from_body(t: f64) -> Isometry3<f64> {
    let angle = SPIN_UP * t.max(0.0).powi(3) / 6.0;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle) * mount();
    Isometry3::from_parts((Vector3::new(angle.cos(), angle.sin(), 0.0) * RADIUS).into(), turn)
}

fn mount() -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(0.4, -0.7, 0.2)
}

fn sample(t: f64) -> InertialSample {
    let (rate, angular) = (0.5 * SPIN_UP * t.max(0.0).powi(2), SPIN_UP * t.max(0.0));
    let pose = world_from_body(t);
    let out = pose.translation.vector;
    let acceleration = Vector3::z().cross(&out) * angular - out * rate * rate;
    InertialSample {
        timestamp_s: t,
        angular_rate: pose.rotation.inverse() * Vector3::new(0.0, 0.0, rate),
        specific_force: pose.rotation.inverse() * (acceleration + Vector3::z() * GRAVITY),
    }
}

fn samples(from: f64, to: f64, hertz: f64) -> Vec<InertialSample> {
    let count = ((to - from) * hertz).round() as usize;
    (0..=count).map(|i| sample(from + i as f64 / hertz)).collect()
}

/// The unit on the camera.
fn mounting() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.05, -0.02, 0.1), Vector3::new(0.3, 1.2, -0.4))
}

fn rested(camera_from_body: &Isometry3<f64>) -> ImuIntegrator {
    ImuIntegrator::from_rest(&samples(-0.6, 0.0, 200.0), camera_from_body, &ImuNoise::default()).unwrap()
}

#[test]
fn a_circle_comes_out_as_its_closed_form_says() {
    let camera_from_body = mounting();
    let mut imu = rested(&camera_from_body);
    let all = samples(0.0, 1.5, 200.0);
    // Frame times between samples, so that both ends are interpolated.
    for (previous, current) in [(0.0, 0.333), (0.333, 0.701), (0.701, 1.4)] {
        let prior = imu.motion(&all, current).unwrap();
        let camera = |t: f64| world_from_body(t) * camera_from_body.inverse();
        let truth = camera(current).inverse() * camera(previous);
        let error = pose_difference(&prior.current_from_previous, &truth);
        // At 200 Hz the trapezia leave t·dt²·(second derivative)/12 of rates (3 rad/s³) and accelerations (20 m/s⁴):
        // 1e-5 rad, and 4e-5 m/s², which with the tilt that the rates leave is below 0.1 mm.
        assert!(error.fixed_rows::<3>(0).norm() < 1e-4, "{error}");
        assert!(error.fixed_rows::<3>(3).norm() < 2e-5, "{error}");
        imu.frame(None).unwrap();
        let down = world_from_body(current).rotation.inverse() * -Vector3::z();
        assert_relative_eq!(imu.down(), down, epsilon = 1e-4);
        let speed = RADIUS * 0.5 * SPIN_UP * current * current;
        assert_relative_eq!(imu.velocity_m_s().norm(), speed, epsilon = 1e-3);
    }
}

#[test]
fn the_error_falls_with_the_square_of_the_interval() {
    let error = |hertz: f64| {
        let prior = rested(&Isometry3::identity()).motion(&samples(0.0, 1.0, hertz), 1.0).unwrap();
        let truth = world_from_body(1.0).inverse() * world_from_body(0.0);
        pose_difference(&prior.current_from_previous, &truth).norm()
    };
    let (coarse, fine) = (error(100.0), error(200.0));
    // Second order: a quarter; a first-order scheme would give a half.
    assert!(fine < 0.3 * coarse, "{coarse} {fine}");
}

/// Noise as the densities say, with biases as the options' standard deviations say.
fn disturbed(clean: &[InertialSample], hertz: f64, noise: &ImuNoise, seed: u64) -> Vec<InertialSample> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut random) });
    let (gyro_bias, accel_bias) = (normal() * 0.02, normal() * noise.accel_bias_sigma);
    let root = hertz.sqrt();
    clean
        .iter()
        .map(|s| InertialSample {
            angular_rate: s.angular_rate + gyro_bias + normal() * noise.gyro_density * root,
            specific_force: s.specific_force + accel_bias + normal() * noise.accel_density * root,
            ..*s
        })
        .collect()
}

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let hertz = 100.0;
    let noise = ImuNoise { gyro_density: 2e-3, accel_density: 2e-2, ..ImuNoise::default() };
    let (rest, moving) = (samples(-0.6, -0.01, hertz), samples(0.0, 0.6, hertz));
    let clean: Vec<_> = rest.iter().chain(&moving).copied().collect();
    let camera = |t: f64| world_from_body(t) * mounting().inverse();
    let truth = camera(0.6).inverse() * camera(0.3);
    let runs = 200;
    let mut sum = 0.0;
    for seed in 0..runs {
        let all = disturbed(&clean, hertz, &noise, seed);
        let mut imu = ImuIntegrator::from_rest(&all[..rest.len()], &mounting(), &noise).unwrap();
        imu.motion(&all, 0.3).unwrap();
        imu.frame(None).unwrap();
        let prior = imu.motion(&all, 0.6).unwrap();
        let error = pose_difference(&prior.current_from_previous, &truth);
        sum += error.dot(&prior.covariance.cholesky().unwrap().solve(&error));
    }
    // Mean of 200 chi-squared values of six components: 6 ± 0.25; three of these and a little for interpolation.
    let mean = sum / f64::from(runs as u32);
    assert!((5.2..6.8).contains(&mean), "{mean}");
}

#[test]
fn measured_motion_corrects_velocity_and_attitude() {
    let hertz = 200.0;
    let noise = ImuNoise::default();
    let all = disturbed(&samples(-0.6, 2.0, hertz), hertz, &noise, 3);
    let mut free = ImuIntegrator::from_rest(&all[..120], &Isometry3::identity(), &noise).unwrap();
    let mut corrected = free.clone();
    let sigma = Vector6::new(1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3);
    let mut random = Pcg64::seed_from_u64(9);
    let (mut free_error, mut corrected_error) = (0.0, 0.0);
    for frame in 1..=20 {
        let (previous, current) = (f64::from(frame - 1) * 0.1, f64::from(frame) * 0.1);
        let truth = world_from_body(current).inverse() * world_from_body(previous);
        for (imu, error) in [(&mut free, &mut free_error), (&mut corrected, &mut corrected_error)] {
            let prior = imu.motion(&all, current).unwrap();
            let miss = pose_difference(&prior.current_from_previous, &truth).fixed_rows::<3>(0).norm();
            *error += if frame > 10 { miss / 10.0 } else { 0.0 };
        }
        let noise = Vector6::from_fn(|k, _| {
            sigma[k] * {
                let n: f64 = StandardNormal.sample(&mut random);
                n
            }
        });
        let measured = MotionPrior {
            current_from_previous: step_pose(&truth, &noise),
            covariance: Matrix6::from_diagonal(&sigma.component_mul(&sigma)),
        };
        free.frame(None).unwrap();
        corrected.frame(Some(&measured)).unwrap();
    }
    // Biases and tilt left alone grow into several millimetres a tenth of a second; frames good to a millimetre leave
    // that millimetre.
    assert!(free_error > 2.0 * corrected_error, "{free_error} {corrected_error}");
    assert!(corrected_error < 3e-3, "{corrected_error}");
}

#[test]
fn what_cannot_be_used_is_refused() {
    let (here, noise) = (Isometry3::identity(), ImuNoise::default());
    let refused = |samples: &[InertialSample], noise: &ImuNoise| {
        ImuIntegrator::from_rest(samples, &here, noise).map(|_| ()).unwrap_err()
    };
    let rest = samples(-0.6, 0.0, 100.0);
    assert!(matches!(refused(&rest[..1], &noise), Error::Inertial(inertial::Error::Unrest(Unrest::TooShort { .. }))));
    assert!(matches!(refused(&samples(0.5, 1.5, 100.0), &noise), Error::Inertial(inertial::Error::Unrest(_))));
    let mut broken = rest.clone();
    broken[7].specific_force.y = f64::NAN;
    let not_finite = inertial::Error::NonFinite { what: "inertial sample", index: 7 };
    assert_eq!(refused(&broken, &noise), Error::Inertial(not_finite));
    let bad = ImuNoise { gyro_density: 0.0, ..noise };
    let named = |error| matches!(error, Error::Inertial(inertial::Error::InvalidOption { name: "gyro_density", .. }));
    assert!(named(refused(&rest, &bad)));
    let mut imu = rested(&here);
    for samples in [vec![], samples(0.3, 0.5, 100.0)] {
        let error = imu.motion(&samples, 0.5).unwrap_err();
        assert!(matches!(error, Error::Inertial(inertial::Error::Gap { .. })), "{error}");
    }
    assert!(matches!(imu.motion(&[], -1.0), Err(Error::NotAscending { .. })));
    assert_relative_eq!(imu.timestamp_s(), 0.0);
    // What was refused is not remembered.
    assert!(imu.motion(&samples(0.0, 0.5, 100.0), 0.5).is_ok());
}

#[test]
fn a_body_hung_upside_down_rests_as_well() {
    let down = InertialSample {
        timestamp_s: 0.0,
        angular_rate: Vector3::zeros(),
        specific_force: Vector3::new(0.0, 0.0, -GRAVITY),
    };
    let rest = [down, InertialSample { timestamp_s: 0.5, ..down }];
    let noise = ImuNoise { max_gap_s: 1.0, ..ImuNoise::default() };
    let mut imu = ImuIntegrator::from_rest(&rest, &Isometry3::identity(), &noise).unwrap();
    let prior = imu.motion(&[], 1.0).unwrap();
    assert!(pose_difference(&prior.current_from_previous, &Isometry3::identity()).norm() < 1e-9);
}
