//! Without errors, demodulation gives the scene back.

use crate::common::{INTERVAL_M, first, largest, plain, range_error};
use approx::assert_relative_eq;
use camera_model::euler_from_pose;
use nalgebra::Point3;
use range_image::PhaseSense;
use simulation::AttitudeSpec;

/// Samples are f32: B = 2 A rounds to 2^-23 of 4 A at worst, so the phase to about 5e-7 rad, 4e-7 m; the phase itself is
/// f32 below 2 pi (2.4e-7 rad), and the truth is f32 below 8 m (2.4e-7 m). Together below 2e-6 m.
const ROUNDING_M: f64 = 2e-6;

#[test]
fn ranges_and_amplitudes_come_back() {
    let spec = plain();
    let (frame, complex) = first(&spec);
    assert!(largest(&range_error(&complex, 0, &frame.truth.range)) < ROUNDING_M);
    let amplitude = complex.channels[0].amplitude();
    for (shown, truth) in amplitude.as_slice().iter().zip(frame.truth.amplitude[0].as_slice()) {
        assert_relative_eq!(shown, truth, max_relative = 1e-5);
    }
    assert!(frame.truth.range.as_slice().iter().any(|range| f64::from(*range) > INTERVAL_M));
    assert!(frame.truth.mixed.as_slice().iter().all(|mixed| !mixed));
}

#[test]
fn any_phase_sense_offset_step_count_and_frequency_comes_back() {
    for (steps, sense, offset) in
        [(3, PhaseSense::Negative, 0.7), (4, PhaseSense::Negative, -2.0), (5, PhaseSense::Positive, 9.0)]
    {
        let mut spec = plain();
        spec.camera.modulation_hz = vec![30.0e6, 80.0e6, 7.5e6];
        (spec.camera.phase_steps, spec.camera.phase_sense, spec.camera.phase_offset_rad) = (steps, sense, offset);
        let (frame, complex) = first(&spec);
        assert_eq!(complex.channels.len(), 3);
        // Rounding grows with the interval (20 m at 7.5 MHz), and with weights that are not zero and one.
        for channel in 0..3 {
            let error = largest(&range_error(&complex, channel, &frame.truth.range));
            assert!(
                error < 10.0 * ROUNDING_M,
                "{steps} steps, {sense:?}, {offset}: channel {channel} off by {error} m"
            );
        }
    }
}

#[test]
fn points_lie_on_the_surfaces_through_a_distorting_lens() {
    let spec = plain();
    let (frame, _) = first(&spec);
    let truth = &frame.truth;
    for row in 0..36 {
        for col in 0..48 {
            let in_camera = spec.camera.geometry.point([col as f64, row as f64], f64::from(truth.range[(col, row)]));
            let point: Point3<f64> = truth.world_from_camera * in_camera;
            let off = match truth.object[(col, row)] {
                Some(0) => {
                    let to_walls = [point.x, 7.0 - point.x, point.y, 5.0 - point.y, point.z, 3.0 - point.z];
                    to_walls.into_iter().fold(f64::INFINITY, |least, d| least.min(d.abs()))
                }
                Some(1) => (point - Point3::new(3.0, 2.5, 1.2)).norm() - 0.4,
                _ => continue,
            };
            // The truth is stored in f32.
            assert!(off.abs() < 1e-6, "pixel {col}, {row} off by {off} m");
        }
    }
    assert!((0..3).all(|object| truth.object.as_slice().contains(&Some(object))));
}

#[test]
fn wrap_counts_are_whole_intervals_of_the_true_range() {
    let (frame, _) = first(&plain());
    for (wraps, range) in frame.truth.wraps[0].as_slice().iter().zip(frame.truth.range.as_slice()) {
        assert_eq!(*wraps, (f64::from(*range) / INTERVAL_M).floor() as i32);
    }
}

#[test]
fn nothing_in_view_is_no_range_and_no_light() {
    let mut spec = plain();
    spec.scene.objects.remove(0);
    let (frame, complex) = first(&spec);
    let empty: Vec<usize> =
        (0..frame.truth.range.len()).filter(|i| frame.truth.object.as_slice()[*i].is_none()).collect();
    assert!(!empty.is_empty() && empty.len() < frame.truth.range.len());
    for i in empty {
        assert!(frame.truth.range.as_slice()[i].is_nan());
        assert_eq!(frame.truth.wraps[0].as_slice()[i], 0);
        assert!(complex.channels[0].real.as_slice()[i].abs() < 1e-20);
    }
}

#[test]
fn look_at_and_euler_angles_mean_the_same_pose() {
    let spec = plain();
    let pose = spec.stations[0].world_from_camera();
    let target = pose.inverse() * Point3::new(5.0, 2.4, 1.1);
    assert_relative_eq!(target.x, 0.0, epsilon = 1e-12);
    assert_relative_eq!(target.y, 0.0, epsilon = 1e-12);
    assert!(target.z < 0.0);
    // Rolled clockwise, the camera's x axis points below the horizon.
    assert_relative_eq!(
        (pose * nalgebra::Vector3::x()).z,
        -(3.0_f64.to_radians().sin()) * upward(&pose),
        epsilon = 1e-12
    );
    let [omega, phi, kappa] = euler_from_pose(&pose).map(f64::to_degrees);
    let mut by_angles = spec.clone();
    by_angles.stations[0].attitude = AttitudeSpec::Euler { omega_deg: omega, phi_deg: phi, kappa_deg: kappa };
    let difference = by_angles.stations[0].world_from_camera().rotation.angle_to(&pose.rotation);
    assert!(difference < 1e-7, "angles of the same pose differ by {difference} rad");
}

/// Cosine of the view's elevation: how upright the rolled axes can be.
fn upward(pose: &nalgebra::Isometry3<f64>) -> f64 {
    let view = pose * -nalgebra::Vector3::z();
    view.x.hypot(view.y)
}

#[test]
fn frames_carry_their_place_and_time() {
    let spec = plain();
    let survey = simulation::simulate(&spec, 1, &|_, _| {}).unwrap();
    assert_eq!(survey.frames.len(), 2);
    let second = &survey.frames[1];
    assert_eq!((second.station.as_str(), second.station_index, second.frame_index), ("A", 0, 1));
    assert_relative_eq!(second.timestamp_s, 0.1);
    assert_relative_eq!(second.integration_time_s, 0.002);
    assert_eq!(second.truth.world_from_camera, spec.stations[0].world_from_camera());
}
