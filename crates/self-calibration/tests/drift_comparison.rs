//! Drifts of one camera do not differ, those of a changed one do, and the band covers what sampling says.

use error_models::{TemperatureDrift, Transient, WarmUp};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use self_calibration::{DriftSide, compare_drifts};

const SIGMAS: [f64; 3] = [0.0005, 15.0, 0.00005];

fn drift(values: [f64; 3]) -> WarmUp {
    WarmUp {
        transients: vec![Transient { amplitude_m: values[0], time_constant_s: values[1] }],
        temperature: Some(TemperatureDrift {
            coefficient_m_per_k: values[2],
            reference_c: 36.0,
            span_c: Some([20.0, 40.0]),
        }),
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
