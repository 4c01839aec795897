//! By an inertial unit: how it grows worse, and what is wrong with its data.

use std::path::{Path, PathBuf};

use inertial::ImuNoise;
use nalgebra::{Isometry3, Vector3};
use orientation_tasks::pipeline::{Failure, Judged};
use orientation_tasks::{OrientBy, OrientSummary};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use range_io::tables::{ImuSample, write_imu};

use crate::scene::{noisy, oriented, path, stations, timed};

const STEP_S: f64 = 0.005;
/// The unit rests until then.
const REST_S: f64 = 2.0;

/// A path that begins at rest and speeds up without a jump.
fn moving(t: f64) -> Isometry3<f64> {
    let since = (t - REST_S).max(0.0);
    // Grows like t² at first and like t afterwards.
    path(since * since / (since + 1.0))
}

fn samples(seed: u64, until_s: f64, biased: bool) -> Vec<ImuSample> {
    let mut random = Pcg64::seed_from_u64(seed);
    let noise = ImuNoise::default();
    let mut normal = |sigma: f64| {
        Vector3::from_fn(|_, _| {
            let n: f64 = StandardNormal.sample(&mut random);
            sigma * n
        })
    };
    let (mut gyro, mut accel) = (Vector3::new(0.01, -0.008, 0.012), normal(noise.accel_bias_sigma));
    if !biased {
        accel = Vector3::zeros();
        gyro = Vector3::zeros();
    }
    let (root, h) = (STEP_S.sqrt(), 1e-3);
    (0..=(until_s / STEP_S) as usize)
        .map(|index| {
            let t = STEP_S * index as f64;
            let [before, here, after] = [t - h, t, t + h].map(moving);
            let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * h);
            let at = |pose: &Isometry3<f64>| pose.translation.vector;
            let pull = (at(&after) - 2.0 * at(&here) + at(&before)) / (h * h) + Vector3::new(0.0, 0.0, 9.80665);
            gyro += normal(noise.gyro_walk * root);
            accel += normal(noise.accel_walk * root);
            let rate = rate + gyro + normal(noise.gyro_density / root);
            let force = here.rotation.inverse() * pull + accel + normal(noise.accel_density / root);
            ImuSample { timestamp_s: t, angular_rate: rate.into(), acceleration: force.into() }
        })
        .collect()
}

fn survey(folder: &Path, seed: u64, known: &[usize], change: impl Fn(&mut ImuSample)) -> PathBuf {
    let times: Vec<f64> = (0..8).map(|index| REST_S + 0.5 * f64::from(index)).collect();
    let mut random = Pcg64::seed_from_u64(1000 + seed);
    let known: Vec<(usize, Isometry3<f64>)> =
        known.iter().map(|index| (*index, noisy(&moving(times[*index]), [0.002, 0.001], &mut random))).collect();
    let survey = timed(folder, &times, &known);
    let mut samples = samples(seed, 6.0, true);
    samples.iter_mut().for_each(change);
    write_imu(survey.join("imu.csv"), &samples).unwrap();
    survey
}

fn orient(survey: &Path) -> Result<OrientSummary, String> {
    oriented(survey, OrientBy::Imu { known: None }).map_err(|error| {
        assert_eq!(error.failure(), Failure::Usage, "{error}");
        error.to_string()
    })
}

/// Mean square of errors over their variances: positions and attitudes of the stations from `first` on.
fn squares(survey: &Path, first: usize) -> [f64; 2] {
    let mut sums = [0.0; 2];
    let found = stations(survey);
    let stations: Vec<_> = found.iter().filter(|station| station.station >= format!("S{first:02}")).collect();
    for station in &stations {
        let index: u32 = station.station[1..].parse().unwrap();
        let truth = moving(REST_S + 0.5 * f64::from(index));
        let off = station.world_from_camera.translation.vector - truth.translation.vector;
        let sigma = station.sigma_position_m.unwrap();
        sums[0] += (0..3).map(|axis| (off[axis] / sigma[axis]).powi(2)).sum::<f64>() / 3.0;
        let turn = station.world_from_camera.rotation.angle_to(&truth.rotation);
        let sigma = station.sigma_attitude_rad.unwrap();
        sums[1] += turn.powi(2) / sigma.iter().map(|sigma| sigma * sigma).sum::<f64>();
    }
    sums.map(|sum| sum / stations.len() as f64)
}

#[test]
fn deviations_after_a_rest_are_those_of_repeated_noise() {
    let mut sums = [0.0; 2];
    for seed in 0..40 {
        let folder = tempfile::tempdir().unwrap();
        let survey = survey(folder.path(), seed, &[0], |_| ());
        let summary = orient(&survey).unwrap();
        assert_eq!(summary.stations.len(), 8, "{summary}");
        let growth = &summary.inertial.as_ref().unwrap().growth;
        assert!(growth.windows(2).all(|pair| pair[0].position_m < pair[1].position_m), "{growth:?}");
        sums.iter_mut().zip(squares(&survey, 1)).for_each(|(sum, square)| *sum += square / 40.0);
    }
    println!("normalised squares {sums:?}");
    // Those of one survey go together: some three independent ones each.
    assert!(sums.iter().all(|sum| (0.6..1.5).contains(sum)), "{sums:?}");
}

#[test]
fn four_known_poses_give_velocity_and_biases_without_a_rest() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), 3, &[1, 2, 3, 4, 5], |_| ());
    let summary = orient(&survey).unwrap();
    println!("{summary}");
    assert_eq!(summary.inertial.as_ref().unwrap().start, "sequence");
    assert_eq!((summary.stations.len(), summary.not_oriented.len()), (7, 1));
    // Biases of the forces and gravity are hardly told apart, what they make of the motion is: an error as large as stated.
    let mut sums = [0.0; 2];
    for seed in 0..40 {
        let folder = tempfile::tempdir().unwrap();
        let survey = self::survey(folder.path(), seed, &[1, 2, 3, 4, 5], |_| ());
        orient(&survey).unwrap();
        sums.iter_mut().zip(squares(&survey, 6)).for_each(|(sum, square)| *sum += square / 40.0);
    }
    println!("normalised squares after a sequence {sums:?}");
    assert!(sums.iter().all(|sum| (0.6..1.5).contains(sum)), "{sums:?}");
    let last = stations(&survey).pop().unwrap();
    let off = (last.world_from_camera.translation.vector - moving(REST_S + 3.5).translation.vector).norm();
    assert!(off < 0.1 && summary.not_oriented[0].station == "S00", "{off}");
}

#[test]
fn wrong_data_of_the_unit_are_named() {
    type Change = fn(&mut ImuSample);
    let slips: [(Change, &str); 4] = [
        (|sample| sample.acceleration = sample.acceleration.map(|value| value / 9.80665), "units of gravity"),
        (|sample| sample.angular_rate = sample.angular_rate.map(f64::to_degrees), "degrees"),
        (|sample| sample.timestamp_s += 100.0, "clocks differ"),
        (|sample| sample.acceleration = [0.01, 0.02, -0.01], "gravity was taken off"),
    ];
    for (slip, words) in slips {
        let folder = tempfile::tempdir().unwrap();
        let survey = survey(folder.path(), 1, &[0], slip);
        let error = orient(&survey).unwrap_err();
        assert!(error.contains(words), "{words}: {error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let moved = survey(folder.path(), 1, &[3], |_| ());
    let error = orient(&moved).unwrap_err();
    assert!(error.contains("does not rest"), "{error}");
}

#[test]
fn a_gap_leaves_the_stations_behind_it_without_a_pose() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), 1, &[0], |_| ());
    let kept: Vec<ImuSample> =
        samples(1, 6.0, true).into_iter().filter(|s| !(3.1..3.3).contains(&s.timestamp_s)).collect();
    write_imu(survey.join("imu.csv"), &kept).unwrap();
    let summary = orient(&survey).unwrap();
    assert_eq!((summary.stations.len(), summary.not_oriented.len()), (3, 5), "{summary}");
    assert!(summary.doubts().iter().any(|doubt| doubt.words.contains("gaps")), "{:?}", summary.doubts());
}
