//! Each error alone changes what it should, and the crate that knows it takes it off.

use crate::common::{INTERVAL_M, first, largest, plain, quantile, range_error, wrapped};
use error_models::{AmplitudeHyperbola, RangeErrorModel, RangeTerms};
use range_image::{Flags, Samples};
use simulation::{
    DigitisationSpec, FixedPatternSpec, GrossErrorsSpec, MixedPixelsSpec, SampleType, SimulationSpec, TextureSpec,
};

/// f32 rounding of samples, phase and truth; see `error_free.rs`.
const ROUNDING_M: f64 = 2e-6;

fn model() -> RangeErrorModel {
    RangeErrorModel {
        terms: RangeTerms { d0: 0.03, periodic: [0.01, -0.006, 0.004, 0.003, 0.008, -0.005], e1: 2e-3, e2: -1e-3 },
        hyperbola: Some(AmplitudeHyperbola { h1: 2.3e-4, h2: 0.0572, h3: 156.0, amplitude_span: [1.0, 1e5] }),
        ..RangeErrorModel::error_free(INTERVAL_M)
    }
}

/// Observed ranges, unwrapped with the true wrap counts.
fn observed(spec: &SimulationSpec) -> (Vec<f64>, simulation::SimulatedFrame, range_image::ComplexFrame) {
    let (frame, complex) = first(spec);
    let phase = complex.channels[0].phase();
    let ranges = phase.as_slice().iter().zip(frame.truth.wraps[0].as_slice());
    let unwrapped = ranges.map(|(phase, wraps)| {
        complex.channels[0].modulation.range_from_phase(f64::from(*phase)) + f64::from(*wraps) * INTERVAL_M
    });
    (unwrapped.collect(), frame, complex)
}

#[test]
fn range_errors_are_those_that_correction_takes_off() {
    let mut spec = plain();
    spec.errors.range = Some(vec![model()]);
    let (observed, frame, complex) = observed(&spec);
    let off = range_error(&complex, 0, &frame.truth.range);
    assert!(quantile(&off, 0.5) > 0.02, "the errors must matter: {}", quantile(&off, 0.5));
    let amplitude = complex.channels[0].amplitude();
    let geometry = spec.camera.geometry;
    let [xp, yp] = geometry.interior.principal_point_mm;
    for (i, range) in observed.iter().enumerate() {
        let [x, y] = geometry.format.image_from_pixel([(i % 48) as f64, (i / 48) as f64]);
        let corrected = model().corrected_range(*range, x - xp, y - yp, f64::from(amplitude.as_slice()[i]));
        let left = wrapped(corrected - f64::from(frame.truth.range.as_slice()[i]), INTERVAL_M);
        assert!(left.abs() < 2.0 * ROUNDING_M, "pixel {i} is off by {left} m");
    }
}

#[test]
fn a_fixed_pattern_is_the_same_in_all_frames_and_seeds() {
    let mut spec = plain();
    spec.errors.fixed_pattern = Some(FixedPatternSpec { sigma_m: 0.01, seed: 5 });
    let survey = simulation::simulate(&spec, 1, &|_, _| {}).unwrap();
    assert_eq!(survey.frames[0].raw, survey.frames[1].raw);
    let pattern = survey.fixed_pattern.unwrap();
    let (frame, complex) = first(&spec);
    let error = range_error(&complex, 0, &frame.truth.range);
    for (error, offset) in error.iter().zip(&pattern.offset_m) {
        assert!((error - f64::from(*offset)).abs() < 2.0 * ROUNDING_M);
    }
    let variance = pattern.offset_m.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / pattern.offset_m.len() as f64;
    // 1728 normal values: their deviation is known to 1 / sqrt(2 * 1728) = 1.7 %; four of these.
    assert!((variance.sqrt() / 0.01 - 1.0).abs() < 0.07, "{}", variance.sqrt());
}

#[test]
fn counts_are_whole_and_end_at_saturation() {
    let mut spec = plain();
    spec.scene.objects[1].albedo = 8.0;
    spec.errors.digitisation =
        Some(DigitisationSpec { sample_type: SampleType::U16, raw_scale: 0.5, saturation: Some(20_000.0) });
    let (frame, complex) = first(&spec);
    let Samples::U16(counts) = frame.raw.samples() else { unreachable!("asked for u16") };
    assert!(counts.iter().all(|count| *count <= 20_000) && counts.contains(&20_000));
    let error = range_error(&complex, 0, &frame.truth.range);
    let mut saturated = 0;
    for (i, error) in error.iter().enumerate() {
        if complex.flags.as_slice()[i].contains(Flags::SATURATED) {
            saturated += 1;
            continue;
        }
        // Each of two samples is off by a quarter unit at most; the phase by sqrt(2) times 0.25 / A.
        let amplitude = f64::from(frame.truth.amplitude[0].as_slice()[i]);
        assert!(error.abs() < INTERVAL_M / std::f64::consts::TAU * 0.25 * 1.5 / amplitude + ROUNDING_M);
    }
    assert!(saturated > 10 && saturated < error.len() / 2, "{saturated} pixels saturated");
    assert!(largest(&error) > 1e-4, "rounding must show");
}

#[test]
fn floating_samples_may_saturate_too() {
    let mut spec = plain();
    spec.errors.digitisation =
        Some(DigitisationSpec { sample_type: SampleType::F32, raw_scale: 2.0, saturation: Some(500.0) });
    let (frame, complex) = first(&spec);
    let Samples::F32(values) = frame.raw.samples() else { unreachable!("asked for f32") };
    let highest = values.iter().fold(0.0_f32, |most, value| most.max(*value));
    assert!((highest - 500.0).abs() < f32::EPSILON && values.iter().any(|value| value.fract() != 0.0));
    assert!(complex.flags.as_slice().iter().any(|flags| flags.contains(Flags::SATURATED)));
}

#[test]
fn mixed_pixels_lie_at_edges_and_between_their_ranges() {
    let mut spec = plain();
    spec.errors.mixed_pixels = Some(MixedPixelsSpec { rays_per_pixel_side: 4, threshold_m: 0.05 });
    let (frame, complex) = first(&spec);
    let truth = &frame.truth;
    let error = range_error(&complex, 0, &truth.range);
    let (mut elsewhere, mut mixed) = (Vec::new(), Vec::new());
    for row in 1..35 {
        for col in 1..47 {
            let off = error[row * 48 + col];
            if truth.mixed[(col, row)] {
                mixed.push(off);
                let around = (0..9).map(|k| f64::from(truth.range[(col + k % 3 - 1, row + k / 3 - 1)]));
                let (near, far) = around.fold((f64::MAX, 0.0), |(near, far), r| (r.min(near), r.max(far)));
                assert!(far - near > 0.05, "pixel {col}, {row} is called mixed in the middle of a surface");
                let shown = f64::from(truth.range[(col, row)]) + off;
                // The sum of phasors less than half a turn apart lies between them.
                let between = shown > near - 0.02 && shown < far + 0.02;
                assert!(between || far - near > 0.5 * INTERVAL_M, "{shown} m is not between {near} and {far} m");
            } else {
                elsewhere.push(off);
            }
        }
    }
    assert!(mixed.len() > 20 && mixed.len() < 300, "{} mixed pixels", mixed.len());
    assert!(quantile(&mixed, 0.9) > 0.1, "mixtures are far off: {}", quantile(&mixed, 0.9));
    // Elsewhere: what range curves over a pixel of 30 mrad, which is most on the floor at a grazing angle.
    assert!(quantile(&elsewhere, 0.95) < 0.01, "{}", quantile(&elsewhere, 0.95));
}

#[test]
fn a_single_ray_and_many_agree_on_a_plain_wall() {
    let mut spec = plain();
    spec.scene.objects.truncate(1);
    let single = first(&spec).0;
    spec.errors.mixed_pixels = Some(MixedPixelsSpec { rays_per_pixel_side: 3, threshold_m: 0.05 });
    let many = first(&spec).0;
    assert_eq!(single.truth.range, many.truth.range);
    let amplitude = |f: &simulation::SimulatedFrame| f.truth.amplitude[0][(20, 15)];
    assert!((amplitude(&many) / amplitude(&single) - 1.0).abs() < 0.01);
}

#[test]
fn vignetting_texture_and_ambient_light_change_light_and_no_range() {
    let plain_frame = first(&plain()).0;
    let mut spec = plain();
    spec.illumination.vignetting_exponent = 4.0;
    spec.illumination.ambient_power = 1e5;
    spec.scene.objects[0].texture = Some(TextureSpec::Checker { size_m: 0.5, factor: 0.3 });
    let (frame, complex) = first(&spec);
    assert!(largest(&range_error(&complex, 0, &frame.truth.range)) < 2.0 * ROUNDING_M);
    assert_eq!(frame.truth.range, plain_frame.truth.range);
    let ratio = |col, row| f64::from(frame.truth.amplitude[0][(col, row)] / plain_frame.truth.amplitude[0][(col, row)]);
    let corner = (-spec.camera.geometry.ray([0.0, 0.0]).z).powi(4);
    assert!([1.0, 0.3].iter().any(|factor| (ratio(0, 0) / (corner * factor) - 1.0).abs() < 1e-5), "{}", ratio(0, 0));
    // Mean = A / contrast + ambient light of 200 units times albedo and vignetting; pixel (24, 18) sees the ball.
    assert_eq!(frame.truth.object[(24, 18)], Some(1));
    let mean = f64::from(complex.channels[0].offset.as_ref().unwrap()[(24, 18)]);
    let vignetting = (-spec.camera.geometry.ray([24.0, 18.0]).z).powi(4);
    let expected = 2.0 * f64::from(frame.truth.amplitude[0][(24, 18)]) + 200.0 * 0.8 * vignetting;
    assert!((mean / expected - 1.0).abs() < 1e-5, "{mean} against {expected}");
}

#[test]
fn gross_errors_spoil_their_share_of_the_pixels_and_no_other() {
    let mut spec = plain();
    let (_, clean) = first(&spec);
    spec.errors.gross_errors = Some(GrossErrorsSpec { share: 0.2, seed: 3 });
    let survey = simulation::simulate(&spec, 1, &|_, _| {}).unwrap();
    assert_eq!(survey.frames[0].raw, survey.frames[1].raw, "the same in all frames of a station");
    let (frame, spoilt) = first(&spec);
    let [clean, spoilt] = [&clean, &spoilt].map(|complex| complex.channels[0].phase());
    let off = |(a, b): (&f32, &f32)| f64::from(a - b).abs() > 1e-6;
    let wrong = clean.as_slice().iter().zip(spoilt.as_slice()).filter(|&pair| off(pair)).count();
    let (count, share) = (clean.as_slice().len() as f64, 0.2);
    // Five standard deviations of the binomial distribution.
    assert!((wrong as f64 - share * count).abs() < 5.0 * (count * share * (1.0 - share)).sqrt(), "{wrong} of {count}");
    assert_eq!(frame.truth.range.as_slice(), first(&plain()).0.truth.range.as_slice(), "the truth is the scene's");
}
