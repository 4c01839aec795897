//! Streams of simulated frames: what is tracked, what is told to be lost, and what is found again.

use crate::common;
use crate::common::{Pinhole, Scene, frame, look_at, pose_error};
use crate::sequence::{HERTZ, absolute_error, around, frame_at, normalised_error, poses, projection};
use nalgebra::{Isometry3, Matrix6, Vector6};
use projective_registration::Error as FrameError;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::InputError;
use rigid_pose::step_pose;
use tracking::Error;
use tracking::{LossReason, MotionPrior, Relocalisation, TrackedPose, Tracker, TrackerOptions, TrackingState};

/// Everything here runs with few pixels: 88 x 72 of the same field of view.
fn camera() -> Pinhole {
    Pinhole { width: 88, height: 72, focal_px: 76.0 }
}

fn tracker(options: TrackerOptions) -> Tracker {
    Tracker::new(&projection(&camera()), options).unwrap()
}

/// Tracks frames seen from `path`; those that are `None` see nothing.
fn run(tracker: &mut Tracker, path: &[Option<Isometry3<f64>>]) -> Vec<TrackedPose> {
    let camera = camera();
    let blank = vec![[f64::NAN; 3]; camera.width * camera.height];
    let first = tracker.trajectory().len();
    for (k, pose) in path.iter().enumerate() {
        let time = (first + k) as f64 / HERTZ;
        match pose {
            Some(pose) => {
                let (points, sigma) = frame_at(&camera, pose, 60_000 + (first + k) as u64);
                tracker.track(time, &points, Some(&sigma), None).unwrap();
            }
            None => {
                tracker.track(time, &blank, None, None).unwrap();
            }
        }
    }
    tracker.trajectory()[first..].to_vec()
}

fn seen(frames: impl Iterator<Item = usize>) -> Vec<Option<Isometry3<f64>>> {
    frames.map(|k| Some(around(k))).collect()
}

fn from_first(frame: usize) -> Isometry3<f64> {
    around(0).inverse() * around(frame)
}

#[test]
fn sixty_frames_stay_within_millimetres() {
    let mut tracker = tracker(TrackerOptions::default());
    let tracked = run(&mut tracker, &seen(0..60));
    assert_eq!(tracked[0].state, TrackingState::Started);
    assert!(tracked[1..].iter().all(|pose| pose.state == TrackingState::Tracked));
    let truth: Vec<_> = (0..60).map(from_first).collect();
    let (rms, largest) = absolute_error(&poses(&tracked), &truth);
    // One registration of such frames is good to a millimetre or two, and a few keyframes follow each other.
    assert!(rms < 5e-3 && largest < 12e-3, "{rms} {largest}");
    // Errors of one run are correlated from frame to frame: its mean scatters by far more than that of 59 draws.
    let nees = normalised_error(&tracked, &truth);
    assert!((0.5..20.0).contains(&nees), "{nees}");
    assert!(tracker.keyframes() > 1 && tracker.keyframes() < 20, "{}", tracker.keyframes());
}

/// Somebody who walks to and fro across the room, seen by a camera that sways in place: frame `k` of 40, played forth and back.
fn with_somebody(k: usize) -> (Vec<[f64; 3]>, Vec<f32>) {
    let at = if k % 78 < 40 { k % 78 } else { 78 - k % 78 };
    let (along, swing) = (-1.3 + 0.065 * at as f64, 0.08 * (at as f64 / 9.0).sin());
    let mut scene = Scene::furnished();
    scene.boxes.push(common::Cuboid::new([0.1, along - 0.35, 0.0], [0.5, along + 0.35, 1.8]));
    let pose = look_at([-1.7 + 0.3 * swing, swing, 1.4], [1.5, 2.0 * swing, 0.9]);
    common::frame_with_mixed_pixels(&scene, &camera(), &pose, 70_000 + k as u64)
}

#[test]
fn where_somebody_walks_a_camera_in_one_place_soon_makes_no_more_keyframes() {
    let mut tracker = tracker(TrackerOptions::default());
    let mut keyframes = Vec::new();
    for k in 0..3 * 78 {
        let (points, sigma) = with_somebody(k);
        let pose = tracker.track(k as f64 / HERTZ, &points, Some(&sigma), None).unwrap();
        assert!(pose.state.has_pose(), "{k}: {:?}", pose.state);
        if k % 78 == 77 {
            keyframes.push(tracker.keyframes());
        }
    }
    assert!(keyframes[0] > 3 && keyframes[2] == keyframes[1], "{keyframes:?}");
}

#[test]
fn the_way_back_is_tracked_from_the_keyframes_of_the_way_there() {
    let mut tracker = tracker(TrackerOptions::default());
    run(&mut tracker, &seen(0..40));
    let there = tracker.keyframes();
    let back = run(&mut tracker, &seen((0..40).rev()));
    assert!(back.iter().all(|pose| pose.state == TrackingState::Tracked));
    // The map is there already; views between keyframes may ask for one more.
    assert!(tracker.keyframes() <= there + 2, "{there} {}", tracker.keyframes());
    let (millimetre, degree) = pose_error(&back[39].world_from_camera, &from_first(0));
    // Back at the first keyframe: the error of one registration, not of a chain.
    assert!(millimetre < 6.0 && degree < 0.2, "{millimetre} {degree}");
}

#[test]
fn a_camera_carried_elsewhere_is_lost_and_found_again() {
    for relocalisation in [Relocalisation::Projective, Relocalisation::Coarse, Relocalisation::Beside] {
        let mut tracker = tracker(TrackerOptions { relocalisation, ..TrackerOptions::default() });
        run(&mut tracker, &seen(0..60));
        // Into a corner that was never seen: under the ceiling, looking up.
        let elsewhere = look_at([2.0, -1.2, 2.0], [2.45, -1.9, 2.55]);
        let lost = run(&mut tracker, &[Some(elsewhere); 2]);
        assert!(lost.iter().all(|pose| matches!(pose.state, TrackingState::Lost(_))), "{:?}", lost[0].state);
        // And put down where it had been early on its way, turned a little.
        let found = run(&mut tracker, &seen(12..18));
        let at = found.iter().position(|pose| pose.state.has_pose()).expect("the camera is found again");
        assert_eq!(found[at].state, TrackingState::Relocalised);
        for (k, pose) in found.iter().enumerate().skip(at) {
            let (millimetre, degree) = pose_error(&pose.world_from_camera, &from_first(12 + k));
            assert!(millimetre < 15.0 && degree < 0.5, "{k}: {millimetre} mm {degree} deg");
        }
        assert!(found[at + 1..].iter().all(|pose| pose.state == TrackingState::Tracked));
    }
}

#[test]
fn a_camera_on_its_side_is_found_beside_the_frames() {
    let run_once = || {
        let mut tracker =
            tracker(TrackerOptions { relocalisation: Relocalisation::Beside, ..TrackerOptions::default() });
        run(&mut tracker, &seen(0..30));
        // Small images do not look like those of the keyframes then.
        let roll = Isometry3::rotation(nalgebra::Vector3::new(0.0, 0.0, 1.5));
        run(&mut tracker, &[Some(around(10) * roll); 32])
    };
    let found = run_once();
    let at = found.iter().position(|pose| pose.state.has_pose()).expect("the camera is found again");
    assert!(at >= 10 && found[at].state == TrackingState::Relocalised, "{at} {:?}", found[at].state);
    let roll = Isometry3::rotation(nalgebra::Vector3::new(0.0, 0.0, 1.5));
    let (millimetre, degree) = pose_error(&found[at].world_from_camera, &(from_first(10) * roll));
    assert!(millimetre < 15.0 && degree < 0.5, "{millimetre} mm {degree} deg");
    assert_eq!(found, run_once(), "the same frames give the same poses, however long the search takes");
}

#[test]
fn loops_are_closed_beside_the_frames_as_well() {
    let frames = || (0..312).step_by(3);
    let truth: Vec<_> = frames().map(from_first).collect();
    let closed = |relocalisation| {
        let mut tracker = tracker(TrackerOptions { relocalisation, ..TrackerOptions::default() });
        let tracked = run(&mut tracker, &seen(frames()));
        assert!(tracked[1..].iter().all(|pose| pose.state == TrackingState::Tracked), "{relocalisation:?}");
        let (rms, _) = absolute_error(&poses(&tracker.adjusted_trajectory()), &truth);
        assert!(rms < 5e-3, "{relocalisation:?}: {rms}");
        (tracker.registrations() + 1).saturating_sub(tracker.keyframes())
    };
    let (at_once, beside) = (closed(Relocalisation::Coarse), closed(Relocalisation::Beside));
    // One registration a frame: those of the last keyframe may still be due.
    assert!(at_once > 4 && beside + 4 >= at_once, "{at_once} {beside}");
}

#[test]
fn blank_frames_are_lost_and_do_no_harm() {
    let mut tracker = tracker(TrackerOptions::default());
    let mut path = vec![None, None];
    path.extend(seen(0..20));
    path.extend([None; 4]);
    path.extend(seen(24..34));
    let tracked = run(&mut tracker, &path);
    let blank = TrackingState::Lost(LossReason::TooFewPoints);
    assert!(tracked[..2].iter().all(|pose| pose.state == blank));
    assert_eq!(tracked[2].state, TrackingState::Started);
    assert!(tracked[22..26].iter().all(|pose| pose.state == blank));
    assert_eq!(tracked[26].state, TrackingState::Relocalised);
    assert!(tracked[27..].iter().all(|pose| pose.state == TrackingState::Tracked));
    let finite = |pose: &TrackedPose| {
        pose.covariance.iter().all(|v| v.is_finite()) && pose.world_from_camera.translation.vector.norm().is_finite()
    };
    assert!(tracked.iter().all(finite));
    let (millimetre, degree) = pose_error(&tracked[35].world_from_camera, &from_first(33));
    assert!(millimetre < 12.0 && degree < 0.4, "{millimetre} {degree}");
}

/// A room whose one wall is 30 m long and bare.
fn along_a_wall(frame: usize) -> Isometry3<f64> {
    let x = 0.02 * frame as f64;
    look_at([x, 0.0, 0.0], [x, 3.0, 0.0])
}

/// Something to hold on to at the start, bare wall after 1.5 m.
fn wall() -> Scene {
    Scene {
        room: common::Cuboid::new([-30.0, -30.0, -30.0], [60.0, 2.0, 30.0]),
        boxes: vec![
            common::Cuboid::new([-1.2, 1.2, -0.6], [-0.8, 2.0, 0.2]),
            common::Cuboid::new([-0.3, 1.5, -1.0], [0.2, 2.0, -0.5]),
            common::Cuboid::new([-0.5, 1.6, 0.4], [-0.1, 2.0, 0.9]),
        ],
    }
}

/// Tracks along the wall with or without a prior of 1 mm and 1 mrad a frame.
fn tracked_along_the_wall(frames: usize, with_prior: bool) -> Vec<TrackedPose> {
    let (camera, scene) = (camera(), wall());
    // A bare wall gives alignment without a guess nothing to find, at a hundred times the price.
    let options = TrackerOptions { relocalisation: Relocalisation::Projective, ..TrackerOptions::default() };
    let mut tracker = tracker(options);
    let mut random = Pcg64::seed_from_u64(77);
    let sigma = 1e-3;
    for k in 0..frames {
        let (points, sigmas) = frame(&scene, &camera, &along_a_wall(k), 1.0, 80_000 + k as u64);
        let noise = Vector6::from_fn(|_, _| {
            let n: f64 = StandardNormal.sample(&mut random);
            sigma * n
        });
        let motion = along_a_wall(k).inverse() * along_a_wall(k.saturating_sub(1));
        let prior = MotionPrior {
            current_from_previous: step_pose(&motion, &noise),
            covariance: Matrix6::identity() * sigma * sigma,
        };
        let prior = (with_prior && k > 0).then_some(&prior);
        tracker.track(k as f64 / HERTZ, &points, Some(&sigmas), prior).unwrap();
    }
    tracker.trajectory().to_vec()
}

#[test]
fn a_bare_wall_loses_the_camera_without_a_prior() {
    let tracked = tracked_along_the_wall(110, false);
    assert!(tracked[1..20].iter().all(|pose| pose.state == TrackingState::Tracked));
    let last = tracked[109].state;
    assert!(matches!(last, TrackingState::Lost(_)), "{last:?}");
    assert!(tracked.iter().any(|pose| pose.state == TrackingState::Lost(LossReason::Undetermined)));
    // No pose that was given slid along the wall unnoticed.
    for (k, pose) in tracked.iter().enumerate().filter(|(_, pose)| pose.state.has_pose()) {
        let truth = along_a_wall(0).inverse() * along_a_wall(k);
        let (millimetre, _) = pose_error(&pose.world_from_camera, &truth);
        assert!(millimetre < 40.0, "frame {k}: {millimetre} mm");
    }
}

#[test]
fn a_prior_carries_the_camera_along_a_bare_wall() {
    let tracked = tracked_along_the_wall(110, true);
    assert!(tracked[1..].iter().all(|pose| pose.state == TrackingState::Tracked));
    let pose = tracked[109];
    let truth = along_a_wall(0).inverse() * along_a_wall(109);
    let error = rigid_pose::pose_difference(&pose.world_from_camera, &truth);
    // Along the wall the priors add up: about √60 mm, with lever arms more. Across it the wall holds the camera.
    let sigma = |k: usize| pose.covariance[(k, k)].sqrt();
    assert!(error[0].abs() < 4.0 * sigma(0) && sigma(0) < 60e-3, "{} {}", error[0], sigma(0));
    assert!(sigma(0) > 4e-3, "{}", sigma(0));
    assert!(error[2].abs() < 8e-3 && sigma(2) < 0.3 * sigma(0), "{} {}", error[2], sigma(2));
}

#[test]
fn the_number_of_threads_leaves_every_bit() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut tracker = tracker(TrackerOptions::default());
            run(&mut tracker, &seen((0..24).step_by(3)))
        })
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn few_keyframes_are_enough_to_go_on() {
    let mut tracker = tracker(TrackerOptions { max_keyframes: 3, ..TrackerOptions::default() });
    let tracked = run(&mut tracker, &seen((0..90).step_by(2)));
    assert!(tracked[1..].iter().all(|pose| pose.state == TrackingState::Tracked));
    assert_eq!(tracker.keyframes(), 3);
    let adjusted = tracker.adjusted_trajectory();
    for (k, pose) in adjusted.iter().enumerate() {
        // Poses that hang on keyframes which are gone are still led back to the first one.
        let (millimetre, degree) = pose_error(&pose.world_from_camera, &from_first(2 * k));
        assert!(millimetre < 15.0 && degree < 0.5, "{k}: {millimetre} {degree}");
        // So they are by who keeps what he needs of each.
        let world = tracker.world_from_keyframe(pose.keyframe).unwrap();
        assert_eq!(world * pose.keyframe_from_camera, pose.world_from_camera);
    }
    assert!(tracker.world_from_keyframe(1000).is_none());
}

#[test]
fn what_is_no_frame_is_refused_and_changes_nothing() {
    let camera = camera();
    let mut tracker = tracker(TrackerOptions::default());
    run(&mut tracker, &seen(0..2));
    let before = tracker.trajectory().to_vec();
    let (points, sigma) = frame_at(&camera, &around(2), 1);
    assert!(matches!(tracker.track(0.0, &points, None, None), Err(Error::NotAscending { .. })));
    assert!(matches!(tracker.track(f64::NAN, &points, None, None), Err(Error::NotAscending { .. })));
    assert!(matches!(
        tracker.track(1.0, &points[1..], None, None),
        Err(Error::Frames(FrameError::Input(InputError::LengthMismatch { .. })))
    ));
    assert!(matches!(
        tracker.track(1.0, &points, Some(&sigma[1..]), None),
        Err(Error::Frames(FrameError::Input(InputError::LengthMismatch { .. })))
    ));
    let bad = MotionPrior { current_from_previous: Isometry3::identity(), covariance: Matrix6::zeros() };
    assert!(matches!(tracker.track(1.0, &points, None, Some(&bad)), Err(Error::Input(InputError::Numerical { .. }))));
    assert_eq!(tracker.trajectory(), before);
    assert_eq!(tracker.track(1.0, &points, Some(&sigma), None).unwrap().state, TrackingState::Tracked);
    let options = TrackerOptions { max_keyframes: 1, ..TrackerOptions::default() };
    assert!(matches!(Tracker::new(&projection(&camera), options), Err(Error::Input(InputError::InvalidOption { .. }))));
}
