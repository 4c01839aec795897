//! The motion of one interval.

use inertial::{Biases, Error, ImuNoise, InertialSample, NavigationState, Preintegrated, Vector9};
use nalgebra::{Vector3, Vector6};
use rigid_pose::step_pose;

use crate::path::{clean, gravity, measured, velocity, world_from_body};

fn state(t: f64) -> NavigationState {
    NavigationState { world_from_body: world_from_body(t), velocity: velocity(t) }
}

fn samples(hertz: f64) -> Vec<InertialSample> {
    (0..=(2.0 * hertz) as usize).map(|k| clean(k as f64 / hertz)).collect()
}

fn biases() -> Biases {
    Biases { gyro: Vector3::new(0.01, -0.02, 0.015), accel: Vector3::new(0.1, 0.05, -0.08) }
}

#[test]
fn the_motion_is_that_of_the_closed_form_and_its_error_falls_with_the_square_of_the_interval() {
    let error = |hertz: f64| {
        // Ends between samples.
        let motion =
            Preintegrated::new(&samples(hertz), [0.3031, 0.9047], &Biases::zero(), &ImuNoise::default()).unwrap();
        let found = motion.predict(&state(0.3031), &gravity(), &Biases::zero());
        let truth = state(0.9047);
        assert!((motion.seconds - 0.6016).abs() < 1e-12);
        let residual = motion.residual(&state(0.3031), &truth, &gravity(), &Biases::zero());
        let turn = found.world_from_body.rotation.angle_to(&truth.world_from_body.rotation);
        assert!((residual.fixed_rows::<3>(0).norm() - turn).abs() < 1e-12);
        (turn, residual.fixed_rows::<6>(3).norm())
    };
    let (coarse, fine) = (error(100.0), error(200.0));
    assert!(fine.0 < 1e-5 && fine.1 < 2e-4, "{fine:?}");
    // Second order: a quarter; ends between samples keep it from being exact.
    assert!(fine.0 < 0.4 * coarse.0 && fine.1 < 0.4 * coarse.1, "{coarse:?} {fine:?}");
}

const STEP: f64 = 1e-6;

#[test]
fn all_jacobians_agree_with_differences() {
    let reference = biases();
    let motion = Preintegrated::new(&samples(200.0), [0.3, 0.9], &reference, &ImuNoise::default()).unwrap();
    let at = Biases { gyro: reference.gyro + Vector3::new(3e-3, 1e-3, -2e-3), accel: reference.accel * 1.1 };
    let start = state(0.3);
    let mut end = state(0.9);
    end.world_from_body = step_pose(&end.world_from_body, &Vector6::new(0.1, -0.2, 0.1, 0.2, -0.1, 0.3));
    let (_, by) = motion.residual_with_jacobians(&start, &end, &gravity(), &at);
    let check = |name: &str, column: Vector9, value: &dyn Fn(f64) -> Vector9| {
        let slope = (value(STEP) - value(-STEP)) / (2.0 * STEP);
        assert!((slope - column).norm() < 1e-7, "{name}: {slope} {column}");
    };
    for k in 0..6 {
        let e = |h: f64| Vector6::from_fn(|i, _| if i == k { h } else { 0.0 });
        let moved = |state: &NavigationState, h: f64| NavigationState {
            world_from_body: step_pose(&state.world_from_body, &e(h)),
            ..*state
        };
        let other = |h: f64| Biases::from_vector(&(at.to_vector() + e(h)));
        check("start", by.start_pose.column(k).into_owned(), &|h| {
            motion.residual(&moved(&start, h), &end, &gravity(), &at)
        });
        check("end", by.end_pose.column(k).into_owned(), &|h| {
            motion.residual(&start, &moved(&end, h), &gravity(), &at)
        });
        check("biases", by.biases.column(k).into_owned(), &|h| motion.residual(&start, &end, &gravity(), &other(h)));
    }
    for k in 0..3 {
        let e = |h: f64| Vector3::from_fn(|i, _| if i == k { h } else { 0.0 });
        let faster = |state: &NavigationState, h: f64| NavigationState { velocity: state.velocity + e(h), ..*state };
        check("v", by.start_velocity.column(k).into_owned(), &|h| {
            motion.residual(&faster(&start, h), &end, &gravity(), &at)
        });
        check("v'", by.end_velocity.column(k).into_owned(), &|h| {
            motion.residual(&start, &faster(&end, h), &gravity(), &at)
        });
        check("g", by.gravity.column(k).into_owned(), &|h| motion.residual(&start, &end, &(gravity() + e(h)), &at));
    }
    // The motion itself by the biases, against integration anew.
    for k in 0..6 {
        let e = |h: f64| Vector6::from_fn(|i, _| if i == k { h } else { 0.0 });
        let anew = |h: f64| motion.reintegrated(&Biases::from_vector(&(reference.to_vector() + e(h))));
        let (ahead, behind) = (anew(STEP), anew(-STEP));
        let turn = (behind.rotation.inverse() * ahead.rotation).scaled_axis() / (2.0 * STEP);
        let faster = (ahead.velocity - behind.velocity) / (2.0 * STEP);
        let moved = (ahead.position - behind.position) / (2.0 * STEP);
        let column = motion.by_biases.column(k);
        assert!((turn - column.fixed_rows::<3>(0)).norm() < 1e-7, "{k}");
        assert!((faster - column.fixed_rows::<3>(3)).norm() < 1e-6, "{k}");
        assert!((moved - column.fixed_rows::<3>(6)).norm() < 1e-6, "{k}");
    }
}

#[test]
fn first_order_is_good_for_small_changes_of_biases_and_integration_anew_for_all() {
    let motion = Preintegrated::new(&samples(200.0), [0.3, 0.9], &Biases::zero(), &ImuNoise::default()).unwrap();
    let truth = Preintegrated::new(&samples(200.0), [0.3, 0.9], &biases(), &ImuNoise::default()).unwrap();
    let anew = motion.reintegrated(&biases());
    assert_eq!(anew, truth);
    let predicted = |motion: &Preintegrated| motion.predict(&state(0.3), &gravity(), &biases());
    let gap = |share: f64| {
        let small = Biases::from_vector(&(biases().to_vector() * share));
        let first = motion.predict(&state(0.3), &gravity(), &small);
        let exact = motion.reintegrated(&small).predict(&state(0.3), &gravity(), &small);
        (first.velocity - exact.velocity).norm()
    };
    assert!((predicted(&anew).velocity - predicted(&truth).velocity).norm() < 1e-15);
    // What first order leaves grows with the square.
    let ratio = gap(1.0) / gap(0.1);
    assert!((60.0..160.0).contains(&ratio), "{ratio}");
}

/// Chi-squared of nine over 200 runs: 9 ± 0.3; 10 % are 0.9.
#[test]
fn the_covariance_is_that_of_repeated_samples() {
    let noise = ImuNoise { gyro_density: 2e-3, accel_density: 2e-2, ..ImuNoise::default() };
    for (from, to) in [(0.3, 0.9), (1.0, 1.1)] {
        let truth = Preintegrated::new(&samples(400.0), [from, to], &Biases::zero(), &noise).unwrap();
        let runs = 200;
        let mut sum = 0.0;
        for seed in 0..runs {
            let noisy = measured([0.0, 2.0], 400.0, &noise, &biases(), seed);
            let motion = Preintegrated::new(&noisy, [from, to], &biases(), &noise).unwrap();
            let turn = (truth.rotation.inverse() * motion.rotation).scaled_axis();
            let mut error = Vector9::zeros();
            error.fixed_rows_mut::<3>(0).copy_from(&turn);
            error.fixed_rows_mut::<3>(3).copy_from(&(motion.velocity - truth.velocity));
            error.fixed_rows_mut::<3>(6).copy_from(&(motion.position - truth.position));
            sum += error.dot(&motion.covariance.cholesky().unwrap().solve(&error)) / f64::from(runs as u32);
        }
        assert!((sum - 9.0).abs() < 0.9, "{from} {to}: {sum}");
    }
}

#[test]
fn what_cannot_be_used_is_refused() {
    let good = samples(100.0);
    let noise = ImuNoise::default();
    let solve = |samples: &[InertialSample], interval| Preintegrated::new(samples, interval, &Biases::zero(), &noise);
    for interval in [[0.5, 0.5], [0.6, 0.5], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        assert!(matches!(solve(&good, interval), Err(Error::NotAscending { .. })), "{interval:?}");
    }
    assert!(matches!(solve(&[], [0.0, 0.1]), Err(Error::Gap { .. })));
    assert!(matches!(solve(&good, [1.9, 2.2]), Err(Error::Gap { .. })));
    assert!(matches!(solve(&good, [-0.2, 0.1]), Err(Error::Gap { .. })));
    // Milliseconds for seconds.
    assert!(matches!(solve(&good, [300.0, 900.0]), Err(Error::Gap { .. })));
    let mut gap = good.clone();
    gap.drain(40..50);
    assert!(matches!(solve(&gap, [0.3, 0.6]), Err(Error::Gap { seconds, .. }) if (seconds - 0.11).abs() < 1e-9));
    assert!(solve(&gap, [0.0, 0.38]).is_ok());
    let mut broken = good.clone();
    broken[7].angular_rate.y = f64::NAN;
    assert!(matches!(solve(&broken, [0.3, 0.6]), Err(Error::NonFinite { index: 7, .. })));
    let mut swapped = good.clone();
    swapped.swap(30, 31);
    assert!(matches!(solve(&swapped, [0.3, 0.6]), Err(Error::NotAscending { index: 31, .. })));
    let bad = ImuNoise { accel_density: 0.0, ..noise };
    let answer = Preintegrated::new(&good, [0.3, 0.6], &Biases::zero(), &bad);
    assert!(matches!(answer, Err(Error::InvalidOption { name: "accel_density", .. })));
    let wild = Biases { gyro: Vector3::repeat(f64::NAN), ..Biases::zero() };
    assert!(Preintegrated::new(&good, [0.3, 0.6], &wild, &noise).is_err());
}
