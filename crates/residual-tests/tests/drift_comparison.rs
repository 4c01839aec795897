//! Drifts of one camera do not differ, those of a changed one do, and the band covers what sampling says.

use error_models::{FrameRateDrift, TemperatureDrift, Transient, WarmUp};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use residual_tests::{DriftSide, compare_drifts};

const SIGMAS: [f64; 3] = [0.0005, 15.0, 0.00005];

fn drift(values: [f64; 3]) -> WarmUp {
    WarmUp {
        transients: vec![Transient { amplitude_m: values[0], time_constant_s: values[1] }],
        temperature: Some(TemperatureDrift {
            coefficient_m_per_k: values[2],
            reference_c: 36.0,
            span_c: Some([20.0, 40.0]),
        }),
        frame_rate: None,
        time_span_s: Some([10.0, 3000.0]),
    }
}

fn covariance() -> DMatrix<f64> {
    DMatrix::from_fn(3, 3, |i, j| {
        SIGMAS[i]
            * SIGMAS[j]
            * if i == j {
                1.0
            } else if i + j == 1 {
                -0.6
            } else {
                0.0
            }
    })
}

#[test]
fn equal_cameras_differ_as_seldom_as_the_level_says() {
    let factor = covariance().cholesky().unwrap().l();
    let mut generator = Pcg64::seed_from_u64(3);
    let mut sample = || {
        let draws = DMatrix::from_fn(3, 1, |_, _| StandardNormal.sample(&mut generator));
        let step: DMatrix<f64> = &factor * draws;
        drift([0.03 + step[0], 600.0 + step[1], 0.0008 + step[2]])
    };
    let runs = 300;
    let mut significant = 0;
    for _ in 0..runs {
        let (one, other) = (sample(), sample());
        let side = |model| DriftSide { model, covariance: covariance() };
        let found = compare_drifts(&side(&one), &side(&other), 0.05).unwrap();
        significant += usize::from(found.significant);
        assert!(found.rms_m <= found.largest.difference_m.abs() && found.along_time.len() == 96);
    }
    // 5 % of 300 are 15 with a deviation of 4; the band, which holds for any function of three parameters, is wider than
    // these need.
    assert!(significant <= 27, "{significant} of {runs}");
}

#[test]
fn another_drift_is_found_also_with_more_exponentials() {
    let side = |model| DriftSide { model, covariance: covariance() };
    let (one, other) = (drift([0.03, 600.0, 0.0008]), drift([0.024, 600.0, 0.0008]));
    let found = compare_drifts(&side(&one), &side(&other), 0.01).unwrap();
    assert!(found.significant && (found.largest.difference_m + 0.006 * f64::exp(-10.0 / 600.0)).abs() < 1e-12);
    assert_eq!(found.largest.time_s, Some(10.0));
    let same = compare_drifts(&side(&one), &side(&one), 0.01).unwrap();
    assert!(!same.significant && same.rms_m < 1e-15);
    // The same curve in two halves.
    let mut halves = one.clone();
    halves.transients = vec![Transient { amplitude_m: 0.015, time_constant_s: 600.0 }; 2];
    let wide = DriftSide { model: &halves, covariance: DMatrix::from_diagonal_element(5, 5, 1e-9) };
    assert!(!compare_drifts(&side(&one), &wide, 0.01).unwrap().significant);
    let late = WarmUp { time_span_s: Some([4000.0, 5000.0]), ..one.clone() };
    let message = compare_drifts(&side(&one), &side(&late), 0.01).unwrap_err().to_string();
    assert!(message.contains("times that both calibrations cover"), "{message}");
}

#[test]
fn drifts_that_follow_the_frame_rate_are_compared_at_the_rates_of_both() {
    let part = |coefficient_m_per_hz: f64, span_hz: [f64; 2]| {
        let span_hz = Some(span_hz);
        FrameRateDrift { coefficient_m_per_hz, time_constant_s: 500.0, reference_hz: 1.0, span_hz }
    };
    let with = |frame_rate| WarmUp { frame_rate: Some(frame_rate), ..drift([0.03, 600.0, 0.0008]) };
    let (one, other) = (with(part(0.003, [1.0, 10.0])), with(part(0.002, [1.0, 8.0])));
    let wide = DMatrix::from_fn(5, 5, |i, j| match (i, j) {
        (i, j) if i < 3 && j < 3 => covariance()[(i, j)],
        (3, 3) => 5e-5_f64.powi(2),
        (4, 4) => 20.0_f64.powi(2),
        _ => 0.0,
    });
    let side = |model| DriftSide { model, covariance: wide.clone() };
    let found = compare_drifts(&side(&one), &side(&other), 0.01).unwrap();
    // At the end of the times and the highest rate of both: 1 mm/Hz of 7 Hz.
    let expected = -0.001 * 7.0 * (1.0 - f64::exp(-3000.0 / 500.0));
    assert!(found.significant && (found.largest.difference_m - expected).abs() < 1e-12, "{:?}", found.largest);
    assert_eq!((found.largest.rate_hz, found.largest.time_s), (Some(8.0), Some(3000.0)));
    assert_eq!(found.along_time.len(), 96);
    assert!(!compare_drifts(&side(&one), &side(&one), 0.01).unwrap().significant);
    // One that does not follow it differs from one that does.
    let plain = drift([0.03, 600.0, 0.0008]);
    let plain = DriftSide { model: &plain, covariance: covariance() };
    assert!(compare_drifts(&plain, &side(&one), 0.01).unwrap().significant);
    let apart = with(part(0.003, [20.0, 30.0]));
    let message = compare_drifts(&side(&one), &side(&apart), 0.01).unwrap_err().to_string();
    assert!(message.contains("frame rates that both calibrations cover"), "{message}");
}
