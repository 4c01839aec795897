//! `calibration.ron`: bit-exact round trips, models in and out, and what is refused.
#![cfg(feature = "calibration")]
// What goes through a file comes back to the last bit.

use crate::common;
use std::path::Path;

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use error_models::{
    AmplitudeHyperbola, AmplitudeScale, FixedPattern, FrameRateDrift, FurtherShape, ModelSet, NamedParameter,
    ParameterStatus, PolynomialShape, RangeErrorModel, RangeNoise, RangeTerms, SharedNoise, SurfaceShape,
    TemperatureDrift, Transient, WarmUp,
};
use proptest::prelude::*;
use range_image::{Modulation, NoiseModel};
use range_io::Error;
use range_io::calibration::{CalibratedDrift, Calibration, Correlation, Provenance, ValidSpan};
use scattering_deconvolution::{
    CompositePsf, FieldPolynomial, FieldTerm, GaussianTerm, Ghost, GhostDelay, GhostPlace, Psf,
};

fn camera() -> Camera {
    let format = ImageFormat::new(4, 3, [0.04, 0.041]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.1, -0.2], principal_distance_mm: 8.1 };
    let lens = LensDistortion { k1: 1e-3, k2: -2e-5, k3: 0.0, p1: 1e-5, p2: -3e-5, b1: 2e-4, b2: -1e-4 };
    Camera::new(format, interior, lens).unwrap()
}

fn model(hz: f64) -> RangeErrorModel {
    RangeErrorModel {
        terms: RangeTerms { d0: 0.024, periodic: [0.01, -0.02, 0.003, 0.0, 0.005, 0.006], e1: 1e-3, e2: -2e-4 },
        hyperbola: Some(AmplitudeHyperbola { h1: -1e-4, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 3000.0] }),
        range_span_m: Some([0.5, 7.0]),
        ..RangeErrorModel::error_free(Modulation::new(hz).unwrap().ambiguity_interval_m())
    }
}

fn models() -> ModelSet {
    ModelSet { entries: vec![(0.001, vec![model(20e6), model(30e6)]), (0.004, vec![model(20e6), model(30e6)])] }
}

fn psf() -> Psf {
    Psf::Gaussians(vec![GaussianTerm { weight: 0.05, sigma_px: [20.0, 15.0] }])
}

/// Scattering that changes over the field, and a late ghost of `weight`.
fn composite(weight: f64) -> Psf {
    let gaussian = GaussianTerm { weight: 0.02, sigma_px: [2.0, 1.5] };
    let received = FieldPolynomial { linear: [0.3, -0.1], ..FieldPolynomial::default() };
    let place = GhostPlace::Mirrored([1.6, 1.1]);
    Psf::Composite(CompositePsf {
        stationary: vec![gaussian],
        field_terms: vec![FieldTerm { gaussian, received, sent: FieldPolynomial::default() }],
        ghosts: vec![Ghost { weight, place, sigma_px: [3.0, 3.0], delay: GhostDelay::ExtraPath(0.043) }],
    })
}

fn drift() -> CalibratedDrift {
    let names = ["A1", "tau1", "cT"].map(str::to_owned).to_vec();
    let matrix = vec![vec![1.0, -0.6, 0.1], vec![-0.6, 1.0, 0.0], vec![0.1, 0.0, 1.0]];
    CalibratedDrift {
        model: WarmUp {
            transients: vec![Transient { amplitude_m: -0.03, time_constant_s: 600.0 }],
            temperature: Some(TemperatureDrift {
                coefficient_m_per_k: 0.0008,
                reference_c: 36.0,
                span_c: Some([20.0, 40.0]),
            }),
            frame_rate: None,
            time_span_s: Some([10.0, 6000.0]),
        },
        deviations: vec![0.0004, 12.0, 0.00002],
        correlation: Some(Correlation { names, matrix }),
    }
}

fn full() -> Calibration {
    let mut calibration = Calibration::from_models(&camera(), &models(), Some(&psf())).unwrap();
    calibration.parameters[2].status = ParameterStatus::Estimated;
    calibration.parameters[2].sigma = 0.004;
    calibration.range_models[1].parameters[0].status = ParameterStatus::Estimated;
    calibration.range_models[1].parameters[0].sigma = 0.002;
    calibration.warm_up = Some(drift());
    calibration.noise = Some(NoiseModel { shot_variance_per_unit: 0.3, dark_sigma: 5.0 });
    calibration.fixed_pattern = Some(FixedPattern {
        width: 4,
        height: 3,
        offset_m: (0..12).map(|i| i as f32 * 1e-4).collect(),
        sigma_m: vec![2e-4; 12],
    });
    calibration.range_noise = Some(RangeNoise {
        sigma_times_amplitude_m: 2.5,
        floor_m: 0.003,
        amplitude_scale: AmplitudeScale::TimesSquaredRange,
        shared: Some(SharedNoise { share: 0.6, width_px: 8.0 }),
    });
    calibration.noise_parameters = vec![NamedParameter {
        name: "dark_sigma".into(),
        value: 5.0,
        sigma: 0.1,
        unit: "amplitude".into(),
        status: ParameterStatus::Estimated,
    }];
    calibration.correlation =
        Some(Correlation { names: vec!["c".into(), "d0[1]".into()], matrix: vec![vec![1.0, 0.9], vec![0.9, 1.0]] });
    calibration.span = ValidSpan { range_m: Some([0.5, 7.0]), temperature_c: Some([20.0, 40.0]), ..Default::default() };
    calibration.provenance = Provenance {
        survey: "surveys/wall \"north\"".into(),
        method: "one step".into(),
        redundancy: Some(1317),
        sigma0: Some(0.98),
        created: Some("2026-11-21".into()),
    };
    calibration
}

fn back(calibration: &Calibration) -> Calibration {
    Calibration::parse(Path::new("calibration.ron"), &calibration.to_text().unwrap()).unwrap()
}

#[test]
fn models_come_back_from_a_calibration() {
    let calibration = full();
    assert_eq!(back(&calibration), calibration);
    assert_eq!(calibration.camera().unwrap(), camera());
    assert_eq!(calibration.scattering, Some(psf()));
    let set = calibration.model_set().unwrap();
    assert_eq!(set.entries.len(), 2);
    set.validate().unwrap();
    for ((time, found), (expected_time, expected)) in set.entries.iter().zip(&models().entries) {
        assert_eq!(time, expected_time);
        for (found, expected) in found.iter().zip(expected) {
            assert_eq!(found, expected);
        }
    }
    let frequencies: Vec<_> = calibration.modulations().unwrap().iter().map(Modulation::frequency_hz).collect();
    assert_eq!(frequencies, [20e6, 30e6]);
}

#[test]
fn further_range_terms_come_back() {
    let further = FurtherShape {
        spline_knots: Some(8),
        polynomial: Some(PolynomialShape { order: 2, range_span_m: [0.5, 7.0] }),
        surface: Some(SurfaceShape { order: 2, x_span_mm: [-0.08, 0.06], y_span_mm: [-0.04, 0.05] }),
    };
    let mut wavy = model(20e6).with_further(&further).unwrap();
    let values: Vec<f64> = (0..wavy.parameter_count()).map(|i| 1e-3 / (i as f64 + 3.0)).collect();
    wavy.set_parameter_values(&values).unwrap();
    let set = ModelSet { entries: vec![(0.001, vec![wavy])] };
    let calibration = Calibration::from_models(&camera(), &set, None).unwrap();
    let text = calibration.to_text().unwrap();
    for part in ["spline_knots: 8", "order: 2", "x_span_mm: (-0.08, 0.06)", "\"s6\"", "\"q2\"", "\"g02\""] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    assert_eq!(back(&calibration).model_set().unwrap(), set);
    // Without its shape a coefficient has no meaning.
    let shapeless = Calibration::parse(Path::new("c.ron"), &text.replace("spline_knots: 8", "spline_knots: 7"));
    assert!(shapeless.unwrap_err().to_string().contains("'s6' is no range-error parameter"));
}

#[test]
fn a_file_of_before_affinity_reads_as_without() {
    let mut older = full();
    older.parameters.truncate(8);
    assert!(!older.to_text().unwrap().contains("b1") && !older.to_text().unwrap().contains("further"));
    let lens = LensDistortion { b1: 0.0, b2: 0.0, ..camera().lens };
    assert_eq!(back(&older).camera().unwrap(), Camera { lens, ..camera() });
    assert_eq!(older.camera_covariance().unwrap()[(9, 9)], 0.0);
}

#[test]
fn a_file_of_version_1_is_read_and_written_as_the_present_one() {
    let present = Calibration { warm_up: None, ..full() };
    let text = present.to_text().unwrap();
    assert!(text.contains("format_version: 2") && !text.contains("warm_up"), "{text}");
    let older = text.replace("format_version: 2", "format_version: 1");
    let read = Calibration::parse(Path::new("c.ron"), &older).unwrap();
    assert_eq!(read, present);
    assert_eq!(read.to_text().unwrap(), text);
    // What version 1 did not know is no part of it.
    let mixed = full().to_text().unwrap().replace("format_version: 2", "format_version: 1");
    let message = Calibration::parse(Path::new("c.ron"), &mixed).unwrap_err().to_string();
    assert!(message.contains("`warm_up`: needs `format_version: 2`"), "{message}");
}

#[test]
fn the_drift_has_a_covariance() {
    let covariance = drift().covariance().unwrap();
    // Products of decimal numbers in double precision.
    assert!((covariance[(0, 1)] + 0.6 * 0.0004 * 12.0).abs() < 1e-18);
    assert!((covariance[(2, 2)] - 4e-10).abs() < 1e-24);
    let uncorrelated = CalibratedDrift { correlation: None, ..drift() };
    assert_eq!(uncorrelated.covariance().unwrap()[(0, 1)], 0.0);
    let short = CalibratedDrift { deviations: vec![0.1], ..drift() };
    assert!(matches!(short.covariance(), Err(Error::Value { field, .. }) if field == "warm_up.deviations"));
}

#[test]
fn a_drift_that_follows_the_frame_rate_is_kept_and_files_without_are_read() {
    let part = FrameRateDrift {
        coefficient_m_per_hz: 0.003,
        time_constant_s: 900.0,
        reference_hz: 0.5,
        span_hz: Some([0.5, 10.0]),
    };
    let mut calibration = full();
    let drift = calibration.warm_up.as_mut().unwrap();
    drift.model.frame_rate = Some(part);
    drift.deviations.extend([1e-5, 20.0]);
    let text = calibration.to_text().unwrap();
    assert!(text.contains("format_version: 2") && text.contains("frame_rate"), "{text}");
    let again = Calibration::parse(Path::new("c.ron"), &text).unwrap();
    assert_eq!(again, calibration);
    let parameters = again.warm_up.unwrap().parameters();
    let named: Vec<(&str, &str)> = parameters.iter().map(|one| (one.name.as_str(), one.unit.as_str())).collect();
    assert_eq!(named[3..], [("cF", "m/Hz"), ("tauF", "s")]);
    assert!(!full().to_text().unwrap().contains("frame_rate"));
}

#[test]
fn bad_drifts_are_refused_by_name() {
    let refused = |expected: &str, change: fn(&mut CalibratedDrift)| {
        let message = refusal(|c| change(c.warm_up.as_mut().unwrap()));
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    };
    refused("`warm_up.deviations`: has 2 values, expected 3: A1, tau1, cT", |d| d.deviations.truncate(2));
    refused("`warm_up.deviations[1]`: standard deviation of `tau1` is -1", |d| d.deviations[1] = -1.0);
    refused("standard deviation of `A1` is NaN", |d| d.deviations[0] = f64::NAN);
    refused("`warm_up.model`: time_constant_s = 0", |d| d.model.transients[0].time_constant_s = 0.0);
    refused("`warm_up.model`: has neither a transient", |d| d.model = WarmUp::default());
    refused("`warm_up.correlation.names[2]`: `cT` is no parameter", |d| {
        d.model.temperature = None;
        d.deviations.truncate(2);
    });
    refused("`warm_up.correlation.matrix[0][1]`: correlation of `A1` and `tau1` is 0.5, but", |d| {
        d.correlation.as_mut().unwrap().matrix[0][1] = 0.5;
    });
    // Three parameters cannot all run against each other.
    refused("`warm_up.correlation.matrix`: has the eigenvalue -0.8", |d| {
        let row = |own: usize| (0..3).map(|other| if other == own { 1.0 } else { -0.9 }).collect();
        d.correlation.as_mut().unwrap().matrix = (0..3).map(row).collect();
    });
}

#[test]
fn a_file_is_written_and_read() {
    let folder = tempfile::tempdir().unwrap();
    full().write(folder.path().join(Calibration::FILE_NAME)).unwrap();
    assert_eq!(Calibration::read(folder.path()).unwrap(), full());
}

#[test]
fn covariances_follow_from_deviations_and_correlations() {
    let calibration = full();
    let names = calibration.parameter_names();
    assert_eq!((names[0].as_str(), names[10].as_str(), names.len()), ("xp", "d0[0]", 10 + 4 * 12));
    let covariance = calibration.covariance(&["c", "d0[1]", "k1"]).unwrap();
    // Products of two decimal numbers in double precision.
    assert!((covariance[(0, 1)] - 0.9 * 0.004 * 0.002).abs() < 1e-18);
    assert!((covariance[(0, 0)] - 0.004 * 0.004).abs() < 1e-18);
    assert_eq!(covariance[(2, 2)], 0.0);
    let camera = calibration.camera_covariance().unwrap();
    assert_eq!(camera[(2, 2)], covariance[(0, 0)]);
    let mut unknown = calibration;
    unknown.parameters[0].sigma = f64::NAN;
    assert!(matches!(unknown.camera_covariance(), Err(Error::Value { field, .. }) if field == "xp"));
}

proptest! {
    #![proptest_config(common::cases(32))]

    #[test]
    fn every_bit_comes_back(
        values in prop::collection::vec(prop::num::f64::NORMAL, 10),
        sigma in prop::num::f64::POSITIVE | prop::num::f64::ZERO,
        pattern in prop::collection::vec(prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO, 12),
        r in -1.0..1.0_f64,
    ) {
        let mut calibration = full();
        for (parameter, value) in calibration.parameters.iter_mut().zip(&values) {
            parameter.value = if parameter.name == "c" { value.abs() } else { *value };
            parameter.sigma = sigma;
        }
        calibration.fixed_pattern.as_mut().unwrap().offset_m = pattern;
        let matrix = &mut calibration.correlation.as_mut().unwrap().matrix;
        (matrix[0][1], matrix[1][0]) = (r, r);
        let again = back(&calibration);
        let bits = |calibration: &Calibration| {
            let parameters = calibration.parameters.iter().flat_map(|p| [p.value.to_bits(), p.sigma.to_bits()]);
            let pattern = calibration.fixed_pattern.iter().flat_map(|p| p.offset_m.iter().map(|v| u64::from(v.to_bits())));
            parameters.chain(pattern).collect::<Vec<_>>()
        };
        prop_assert_eq!(bits(&again), bits(&calibration));
        prop_assert_eq!(again, calibration);
    }
}

#[test]
fn composite_scattering_goes_through_a_file() {
    let calibration = Calibration { scattering: Some(composite(0.01)), ..full() };
    assert_eq!(back(&calibration), calibration);
}

fn refusal(change: impl FnOnce(&mut Calibration)) -> String {
    let mut calibration = full();
    change(&mut calibration);
    // The same answer in memory and, with its place, from a file.
    let in_memory = calibration.validate().unwrap_err().to_string();
    assert!(in_memory.starts_with("calibration: "), "{in_memory}");
    assert!(calibration.to_text().is_err());
    let text = range_io::ron_text::to_text(&calibration).unwrap();
    let error = Calibration::parse(Path::new("c.ron"), &text).unwrap_err();
    assert!(matches!(error, Error::Text { line: 2.., .. }), "{error}");
    assert_eq!(error.to_string().split_once(": ").unwrap().1, in_memory.split_once(": ").unwrap().1);
    in_memory
}

#[test]
fn invalid_calibrations_are_refused_by_name() {
    let said = |message: String, expected: &str| assert!(message.contains(expected), "{message}\nexpected: {expected}");
    said(refusal(|c| c.parameters[2].value = 0.0), "`parameters[2].value`: `c` is 0, expected a positive");
    said(refusal(|c| c.parameters[3].value = f64::NAN), "`k1` is NaN");
    said(refusal(|c| c.parameters[1] = c.parameters[0].clone()), "`parameters[1].name`: `xp` is given twice");
    said(refusal(|c| c.parameters.retain(|p| p.name != "c")), "`c` is missing");
    said(refusal(|c| c.parameters[0].name = "cx".into()), "`cx` is no parameter, expected one of xp, yp, c, k1");
    said(refusal(|c| c.parameters[0].unit = "px".into()), "`xp` is in `px`, expected `mm`");
    said(refusal(|c| c.parameters[0].sigma = -1.0), "standard deviation of `xp` is -1");
    said(refusal(|c| c.format_version = 3), "`format_version`: is 3, expected 2 (version 1 is read as well)");
    said(refusal(|c| c.camera.width = 0), "`camera`: ");
    said(refusal(|c| c.fixed_pattern.as_mut().unwrap().width = 5), "`fixed_pattern`: is 5 x 3 pixels, expected 4 x 3");
    said(refusal(|c| c.fixed_pattern.as_mut().unwrap().offset_m.truncate(11)), "has 11 values, expected 12");
    said(refusal(|c| c.span.range_m = Some([7.0, 0.5])), "`span.range_m`: is (7, 0.5)");
    said(
        refusal(|c| c.scattering = Some(Psf::Kernel { width: 2, height: 1, values: vec![0.0; 2] })),
        "kernel of 2 x 1",
    );
    said(refusal(|c| c.scattering = Some(composite(-0.1))), "`scattering`: weight = -0.1");
    said(refusal(|c| c.noise.as_mut().unwrap().dark_sigma = -1.0), "dark_sigma");
    said(refusal(|c| c.range_models[3].integration_time_s = 0.001), "range_models");
    said(refusal(|c| c.range_models[0].modulation_hz = 0.0), "`range_models[0].modulation_hz`: ");
    said(refusal(|c| c.range_models[2].amplitude_span = None), "`range_models[2]`: ");
    said(
        refusal(|c| {
            c.range_models[2].parameters[1] =
                NamedParameter { name: "d1".into(), ..c.range_models[2].parameters[1].clone() }
        }),
        "`range_models[2].parameters[1].name`: `d1` is no parameter, expected one of d0, d2",
    );
    let correlation = |change: fn(&mut Correlation)| refusal(|c| change(c.correlation.as_mut().unwrap()));
    said(correlation(|r| r.matrix[0][1] = 0.8), "correlation of `c` and `d0[1]` is 0.8, but 0.9 the other way round");
    said(correlation(|r| r.matrix[1][1] = 0.9), "correlation of `d0[1]` and `d0[1]` is 0.9, expected 1");
    said(correlation(|r| r.matrix[0][1] = 1.5), "is 1.5, expected -1 to 1");
    said(correlation(|r| r.matrix[0][1] = f64::NAN), "is NaN, expected -1 to 1");
    said(correlation(|r| r.matrix.truncate(1)), "has 1 rows for 2 names");
    said(correlation(|r| r.matrix[1].truncate(1)), "`correlation.matrix[1]`: has 1 values for 2 names");
    said(correlation(|r| r.names[0] = "d0".into()), "`d0` is no parameter of this calibration");
    said(correlation(|r| r.names[1] = "c".into()), "`c` is given twice");
}

#[test]
fn unknown_fields_are_refused_with_their_place() {
    let text = full().to_text().unwrap().replace("provenance: (", "provenance: (operator: \"x\", ");
    let error = Calibration::parse(Path::new("c.ron"), &text).unwrap_err().to_string();
    assert!(error.contains("operator"), "{error}");
}
