//! Errors of a made trajectory: against the figures of another program (evo 1.38.1), and against what was put in.

use approx::assert_relative_eq;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rigid_pose::InputError;
use tracking::Error;
use tracking::{
    ErrorStatistics, RelativeStep, TrajectoryAlignment, TrajectoryErrorOptions, absolute_trajectory_error,
    relative_pose_error,
};

type Stamped = (f64, Isometry3<f64>);

/// A loop of 20 s, and an estimate 1.05 times as large, elsewhere, with wobbles, late stamps and missing frames.
fn made() -> (Vec<Stamped>, Vec<Stamped>) {
    let (mut truth, mut estimate) = (Vec::new(), Vec::new());
    for i in 0..200 {
        let (n, s) = (f64::from(i), 0.1 * f64::from(i));
        let p = Vector3::new(3.0 * (0.3 * s).cos(), 2.0 * (0.4 * s).sin(), 0.5 * (0.9 * s).sin());
        let q = UnitQuaternion::from_scaled_axis(Vector3::new(0.1 * s.sin(), 0.2 * (0.7 * s).cos(), 0.3 * s));
        truth.push((s, Isometry3::from_parts(p.into(), q)));
        if i % 7 == 3 {
            continue;
        }
        let wobble = Vector3::new(0.02 * (1.7 * n).sin(), 0.03 * (2.3 * n).cos(), 0.01 * (0.2 * n).sin());
        let turn = Vector3::new(0.01 * (3.1 * n).sin(), 0.02 * (1.3 * n).cos(), 0.001 * n);
        let position = 1.05 * p + wobble + Vector3::new(4.0, -1.0, 0.0);
        let attitude = q * UnitQuaternion::from_scaled_axis(turn);
        estimate.push((s + 0.004 * n.sin(), Isometry3::from_parts(position.into(), attitude)));
    }
    (estimate, truth)
}

/// Both programs work on the same numbers with f64: rounding only, the least for angles near 0 from quaternions.
fn assert_statistics(found: &ErrorStatistics, expected: [f64; 6]) {
    let found = [found.rms, found.mean, found.median, found.standard_deviation, found.min, found.max];
    for (found, expected) in found.into_iter().zip(expected) {
        assert_relative_eq!(found, expected, max_relative = 1e-9);
    }
}

#[test]
fn absolute_errors_are_those_of_another_program() {
    let (estimate, truth) = made();
    let error = absolute_trajectory_error(&estimate, &truth, &TrajectoryErrorOptions::default()).unwrap();
    assert_eq!(error.matched.len(), 171);
    let expected = [
        0.128_729_731_631_740_4,
        0.120_237_915_768_590_73,
        0.124_412_265_299_386_34,
        0.045_980_293_796_420_93,
        0.014_990_981_760_756_302,
        0.198_922_761_563_707_6,
    ];
    assert_statistics(&error.position_m, expected);
    let expected = [
        0.115_796_657_198_175_27,
        0.101_431_972_737_519_28,
        0.100_624_268_586_243_97,
        0.055_860_726_139_631_084,
        0.005_983_209_599_305_437,
        0.199_180_463_308_425_73,
    ];
    assert_statistics(&error.attitude_rad, expected);
    let options =
        TrajectoryErrorOptions { alignment: TrajectoryAlignment::Similarity, ..TrajectoryErrorOptions::default() };
    let error = absolute_trajectory_error(&estimate, &truth, &options).unwrap();
    assert_relative_eq!(error.scale, 0.952_269_343_912_825_7, max_relative = 1e-12);
    let expected = [
        0.025_319_495_456_329_34,
        0.024_322_572_086_395_47,
        0.025_848_282_486_359_352,
        0.007_034_865_831_355_861,
        0.004_233_551_365_228_071,
        0.035_525_080_040_723_77,
    ];
    assert_statistics(&error.position_m, expected);
    let worst = error.worst(3);
    assert_relative_eq!(worst[0].position_error_m, error.position_m.max);
    assert!(worst[1].position_error_m >= worst[2].position_error_m);
}

#[test]
fn relative_errors_are_those_of_another_program() {
    let (estimate, truth) = made();
    let options = TrajectoryErrorOptions::default();
    let error = relative_pose_error(&estimate, &truth, RelativeStep::Frames(10), &options).unwrap();
    assert_eq!(error.steps.len(), 161);
    let expected = [
        0.132_614_594_658_245_52,
        0.117_496_385_623_424_1,
        0.101_801_550_894_503_34,
        0.061_491_707_423_053_24,
        0.016_756_708_185_843_305,
        0.262_807_332_302_751_6,
    ];
    assert_statistics(&error.translation_m, expected);
    let expected = [
        0.031_071_134_166_131_41,
        0.029_377_918_731_463_924,
        0.029_275_089_828_998_02,
        0.010_116_979_261_481_153,
        0.012_380_249_538_156_033,
        0.055_707_253_158_248_76,
    ];
    assert_statistics(&error.rotation_rad, expected);
    let error = relative_pose_error(&estimate, &truth, RelativeStep::Metres(2.0), &options).unwrap();
    assert_eq!(error.steps.len(), 149);
    let expected = [
        0.210_517_620_015_288_2,
        0.193_724_256_240_564_1,
        0.167_602_461_252_856_13,
        0.082_392_844_840_687_05,
        0.072_118_252_775_680_7,
        0.370_734_319_803_888_16,
    ];
    assert_statistics(&error.translation_m, expected);
}

#[test]
fn a_moved_trajectory_has_no_error() {
    let (_, truth) = made();
    let moved = Isometry3::new(Vector3::new(5.0, -7.0, 2.0), Vector3::new(0.4, 1.0, -2.0));
    let mut estimate: Vec<Stamped> = truth.iter().map(|(time, pose)| (*time, moved * pose)).collect();
    // The order in which poses stand says nothing; their times do.
    estimate.reverse();
    for alignment in [TrajectoryAlignment::Rigid, TrajectoryAlignment::FirstPose, TrajectoryAlignment::Similarity] {
        let options = TrajectoryErrorOptions { alignment, ..TrajectoryErrorOptions::default() };
        let error = absolute_trajectory_error(&estimate, &truth, &options).unwrap();
        // Rounding of coordinates of 10 m; an angle from a quaternion is right to the root of it.
        assert!(error.position_m.max < 1e-13 && error.attitude_rad.max < 1e-7, "{alignment:?}: {error:?}");
    }
    let none = TrajectoryErrorOptions { alignment: TrajectoryAlignment::None, ..TrajectoryErrorOptions::default() };
    assert!(absolute_trajectory_error(&estimate, &truth, &none).unwrap().position_m.min > 1.0);
    for step in [RelativeStep::Frames(1), RelativeStep::Seconds(1.0), RelativeStep::Metres(0.5)] {
        let error = relative_pose_error(&estimate, &truth, step, &none).unwrap();
        assert!(error.translation_m.max < 1e-13, "{step:?}");
        assert!(error.steps.len() > 150, "{step:?}: steps begin at almost every pose");
    }
}

#[test]
fn drift_is_stated_for_the_step() {
    let pose = |x: f64| Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::identity());
    let truth: Vec<Stamped> = (0..100).map(|i| (0.1 * f64::from(i), pose(0.05 * f64::from(i)))).collect();
    let estimate: Vec<Stamped> = truth.iter().map(|(time, p)| (*time, pose(1.02 * p.translation.x))).collect();
    // At the end a step of nine poses would pass with a tolerance of a tenth.
    let options = TrajectoryErrorOptions { step_tolerance: 0.05, ..TrajectoryErrorOptions::default() };
    // 2 % of 0.5 m in a second, whichever way the second is asked for.
    for step in [RelativeStep::Frames(10), RelativeStep::Seconds(1.0), RelativeStep::Metres(0.5)] {
        let error = relative_pose_error(&estimate, &truth, step, &options).unwrap();
        assert_relative_eq!(error.translation_m.mean, 0.01, max_relative = 1e-9);
        assert_relative_eq!(error.worst(1)[0].path_m, 0.5, max_relative = 1e-9);
        assert_eq!(error.steps.len(), 90);
    }
    assert!(matches!(
        absolute_trajectory_error(&estimate, &truth, &options),
        Err(Error::Input(InputError::Collinear { .. }))
    ));
}

#[test]
fn each_pose_is_matched_once() {
    let pose = |x: f64, y: f64| Isometry3::translation(x, y, 0.0);
    let truth = [(0.0, pose(0.0, 0.0)), (0.02, pose(1.0, 0.0)), (1.0, pose(0.0, 1.0))];
    let estimate = [(0.009, pose(0.0, 0.0)), (0.012, pose(1.0, 0.0)), (1.004, pose(0.0, 1.0)), (2.0, pose(9.0, 9.0))];
    let error = absolute_trajectory_error(&estimate, &truth, &TrajectoryErrorOptions::default()).unwrap();
    let pairs: Vec<_> = error.matched.iter().map(|pose| (pose.estimate, pose.truth)).collect();
    assert_eq!(pairs, [(0, 0), (1, 1), (2, 2)]);
}

#[test]
fn bad_input_is_refused_by_name() {
    let (estimate, truth) = made();
    let options = TrajectoryErrorOptions::default();
    let fault = |e: &[Stamped], t: &[Stamped]| absolute_trajectory_error(e, t, &options).unwrap_err().to_string();
    assert_eq!(fault(&[], &truth), "the estimated trajectory is empty");
    assert_eq!(fault(&estimate, &[]), "the true trajectory is empty");
    let late: Vec<Stamped> = estimate.iter().map(|(time, pose)| (time + 1000.0, *pose)).collect();
    assert!(fault(&late, &truth).contains("(1000.000 s to 1019"), "{}", fault(&late, &truth));
    let mut broken = estimate.clone();
    broken[5].1.translation.vector.y = f64::NAN;
    assert!(fault(&broken, &truth).contains("entry 5"));
    assert!(matches!(
        absolute_trajectory_error(&estimate[..2], &truth, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));
    for step in [RelativeStep::Frames(0), RelativeStep::Seconds(f64::NAN), RelativeStep::Metres(-1.0)] {
        assert!(matches!(
            relative_pose_error(&estimate, &truth, step, &options),
            Err(Error::Input(InputError::InvalidOption { .. }))
        ));
    }
    let long = relative_pose_error(&estimate, &truth, RelativeStep::Metres(1e6), &options);
    assert!(matches!(long, Err(Error::Input(InputError::TooFewPoints { .. }))));
}
