//! Stations around a room, brought into one system.
use crate::common::stations::round;
use crate::common::{disturbance, pose_error};
use icp_registration::MotionKind;
use multiview_registration::Error;
use multiview_registration::{Datum, Start, StationRegistration, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::pose_difference;

fn registered(clouds: &[Cloud], start: Start<'_>, datum: Datum) -> StationRegistration {
    register_stations(clouds, start, datum, &StationRegistrationOptions::default(), &|_, _| {}).unwrap()
}

/// Poses 5 cm and 2 degrees off, the first one right.
fn approximate(truth: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let off = |k: usize| if k == 0 { Isometry3::identity() } else { disturbance(0.05, 2.0, 70 + k as u64) };
    truth.iter().enumerate().map(|(k, pose)| pose * off(k)).collect()
}

fn largest_errors(found: &StationRegistration, truth: &[Isometry3<f64>]) -> (f64, f64) {
    let world = truth[0] * found.world_from_station[0].inverse();
    let errors = found.world_from_station.iter().zip(truth).map(|(pose, truth)| pose_error(&(world * pose), truth));
    errors.fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), f64::max(a.1, b.1)))
}

#[test]
fn eight_stations_come_together_from_approximate_poses() {
    let (clouds, truth) = round(8, 0.01, 3);
    let found = registered(&clouds, Start::Poses(&approximate(&truth)), Datum::Station(0));
    let (mm, degrees) = largest_errors(&found, &truth);
    println!("{mm:.2} mm {degrees:.4} deg, {} pairs, sigma0 {:?}", found.surfaces.len(), found.sigma0);
    // Noise of 1 mm + 0.5 mm/m² range², a hundredth of the pixels wrong. Only furniture tells the stations that look along
    // the room and those that look across it where they stand along it: known to 0.6 mm there, three times that.
    assert!(found.settled && mm < 2.0 && degrees < 0.05, "{mm} mm {degrees} deg");
    assert!(found.undetermined.is_empty());
    // Tiles scatter as their points say.
    let sigma0 = found.sigma0.unwrap();
    assert!((0.9..1.1).contains(&sigma0), "{sigma0}");
    assert!(found.redundancy > 1000);
    for closure in &found.loops {
        assert!(closure.stations.len() >= 3 && closure.translation_m.is_finite());
    }
    let (pose, covariance) = found.relative_pose(2, 5).unwrap();
    let error = pose_difference(&(truth[2].inverse() * truth[5]), &pose);
    let distance = error.dot(&covariance.cholesky().unwrap().solve(&error));
    // Chi-squared with six degrees of freedom stays below 35 but once in 200,000; the covariance is itself estimated.
    assert!(distance < 35.0, "{distance}");
}

/// Squared errors of the poses of eight stations over their covariances, mean over runs and stations; `changed` is done to
/// the points of each.
fn normalised_squared_error(runs: u64, changed: impl Fn(usize, &mut Point3<f64>)) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for run in 0..runs {
        let (mut clouds, truth) = round(8, 0.01, 40 + run);
        for (k, cloud) in clouds.iter_mut().enumerate() {
            cloud.points.iter_mut().for_each(|point| changed(k, point));
        }
        let found = registered(&clouds, Start::Poses(&truth), Datum::Station(0));
        for station in 1..truth.len() {
            let (pose, covariance) = found.relative_pose(0, station).unwrap();
            let error = pose_difference(&pose, &(truth[0].inverse() * truth[station]));
            sum += error.dot(&covariance.cholesky().unwrap().solve(&error));
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn covariances_state_what_noise_leaves() {
    let mean = normalised_squared_error(4, |_, _| {});
    println!("{mean:.2}");
    // Six are expected; stations of a run share its datum, and runs scatter by 2.8.
    assert!((3.0..10.0).contains(&mean), "{mean}");
}

#[test]
fn errors_that_whole_walls_share_widen_the_covariances() {
    // A wave of the ranges of 3 mm, whose phase is another one at each station: places of a wall share it.
    let wavy = |k: usize, point: &mut Point3<f64>| {
        let range = point.coords.norm();
        point.coords *= 1.0 + 3e-3 * (range * 5.0 + k as f64 * 2.0).sin() / range;
    };
    let mean = normalised_squared_error(2, wavy);
    println!("{mean:.2}");
    assert!(mean < 20.0, "{mean}");
}

#[test]
fn inner_constraints_move_nothing_but_the_frame() {
    let (clouds, truth) = round(6, 0.0, 5);
    let start = approximate(&truth);
    let held = registered(&clouds, Start::Poses(&start), Datum::Station(0));
    let free = registered(&clouds, Start::Poses(&start), Datum::InnerConstraints);
    let trace = |found: &StationRegistration| -> f64 {
        found.covariance.iter().map(|c| c.fixed_view::<3, 3>(0, 0).trace()).sum()
    };
    for k in 1..truth.len() {
        let (a, b) = (held.relative_pose(0, k).unwrap(), free.relative_pose(0, k).unwrap());
        // The same solution in another frame: rounding.
        assert!(pose_difference(&a.0, &b.0).norm() < 1e-9);
        assert!((a.1 - b.1).norm() < 1e-6 * a.1.norm());
    }
    assert!(trace(&free) < trace(&held));
    let shift: Vector3<f64> =
        free.world_from_station.iter().zip(&start).map(|(a, b)| a.translation.vector - b.translation.vector).sum();
    // Positions are on average where they were.
    assert!(shift.norm() < 1e-9, "{shift}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (clouds, truth) = round(5, 0.01, 7);
    let start = approximate(&truth);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| registered(&clouds, Start::Poses(&start), Datum::Station(0)))
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.world_from_station, three.world_from_station);
    assert_eq!(one.joint_covariance.whole(), three.joint_covariance.whole());
    assert_eq!(one.surfaces, three.surfaces);
}

/// Points of a plane in the station's frame with noise of half a millimetre along its normal.
fn wall(width: usize, origin: [f64; 3], along: [f64; 3], up: [f64; 3], seed: u64) -> Vec<Point3<f64>> {
    let (origin, along, up) = (Vector3::from(origin), Vector3::from(along), Vector3::from(up));
    let normal = along.cross(&up).normalize();
    let mut random = Pcg64::seed_from_u64(seed);
    let mut place = |i: usize| {
        let (a, b) = ((i % width) as f64 * 0.02, (i / width) as f64 * 0.02);
        let noise: f64 = StandardNormal.sample(&mut random);
        Point3::from(origin + along * a + up * b + normal * (5e-4 * noise))
    };
    (0..width * width).map(&mut place).collect()
}

/// Three walls that meet.
fn corner(seed: u64) -> Cloud {
    let mut points = wall(80, [-0.8, -0.8, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], seed);
    points.extend(wall(60, [-0.8, -0.8, -2.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], seed + 1));
    points.extend(wall(60, [-0.8, -0.8, -2.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], seed + 2));
    Cloud::new(points)
}

#[test]
fn a_station_that_sees_one_wall_is_named_with_the_motions_it_leaves_open() {
    let only_wall = Cloud::new(wall(80, [-0.8, -0.8, -2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 30));
    let clouds = [corner(10), corner(20), only_wall];
    let poses = [Isometry3::identity(); 3];
    let found = registered(&clouds, Start::Poses(&poses), Datum::Station(0));
    assert_eq!(found.undetermined.len(), 1, "{:?}", found.undetermined);
    let open = &found.undetermined[0];
    assert_eq!(open.station, 2);
    let kinds: Vec<MotionKind> = open.motions.iter().map(|motion| motion.kind).collect();
    // A wall leaves two translations along it and the rotation about its normal.
    assert_eq!(kinds.iter().filter(|kind| **kind == MotionKind::Translation).count(), 2, "{:?}", open.motions);
    assert_eq!(kinds.len(), 3);
    for motion in &open.motions {
        let along_normal = motion.axis.z.abs();
        match motion.kind {
            MotionKind::Translation => assert!(along_normal < 0.1, "{motion:?}"),
            MotionKind::Rotation => assert!(along_normal > 0.9, "{motion:?}"),
        }
    }
    // It kept its start along them, but for the noise of the wall.
    assert!(found.world_from_station[2].translation.vector.norm() < 0.005);
    // Across the wall it is known; along it the deviation says that nothing holds it.
    let sigma = |axis: usize| found.covariance[2][(axis, axis)].sqrt();
    assert!(sigma(2) < 0.01 && sigma(0) > 0.1 && sigma(1) > 0.1, "{} {} {}", sigma(0), sigma(1), sigma(2));
}

#[test]
fn stations_without_partner_are_named() {
    let (mut clouds, truth) = round(3, 0.0, 9);
    clouds.push(Cloud::new(wall(60, [50.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 40)));
    let mut start = approximate(&truth);
    start.push(Isometry3::identity());
    let options = StationRegistrationOptions::default();
    let error = register_stations(&clouds, Start::Poses(&start), Datum::Station(0), &options, &|_, _| {}).unwrap_err();
    match &error {
        Error::UnconnectedStations { stations, to, .. } => {
            assert_eq!((stations.as_slice(), *to), (&[3][..], 0));
        }
        other => panic!("{other}"),
    }
    assert!(error.to_string().contains("station 0"));
}

#[test]
fn halves_of_a_round_that_see_no_surface_from_both_sides_are_named() {
    // Six stations: three look at one end of the room and three at the other, and what stands between shows each its own
    // side. How far the halves are apart is known to no better than decimetres, and said so.
    let (clouds, truth) = round(6, 0.0, 11);
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, Start::Poses(&truth), Datum::Station(0), &options, &|_, _| {}).unwrap();
    assert!(found.settled);
    let named: Vec<usize> = found.undetermined.iter().map(|station| station.station).collect();
    assert_eq!(named, [2, 3, 4]);
    for station in &found.undetermined {
        let [motion] = station.motions.as_slice() else { panic!("{:?}", station.motions) };
        assert_eq!(motion.kind, MotionKind::Translation);
        // Along the axis that the halves look along.
        assert!(motion.axis.x.abs() > 0.99 && motion.sigma_m > 0.1, "{motion:?}");
    }
}
