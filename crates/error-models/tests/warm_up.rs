//! Drift by time since power-on and by temperature.

use error_models::{Error, TemperatureDrift, Transient, WarmUp};
use nalgebra::DMatrix;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

fn two_transients() -> WarmUp {
    WarmUp {
        transients: vec![
            Transient { amplitude_m: -0.006, time_constant_s: 240.0 },
            Transient { amplitude_m: 0.004, time_constant_s: 1200.0 },
        ],
        temperature: Some(TemperatureDrift {
            coefficient_m_per_k: 0.0008,
            reference_c: 36.0,
            span_c: Some([20.0, 40.0]),
        }),
        frame_rate: None,
        time_span_s: Some([10.0, 6000.0]),
    }
}

#[test]
fn values_follow_the_formula_and_vanish_without_end() {
    let drift = two_transients();
    let expected = -0.006 * (-1.0_f64).exp() + 0.004 * (-0.2_f64).exp() + 0.0008 * (30.0 - 36.0);
    // A few roundings of numbers of some millimetres.
    assert!((drift.value(Some(240.0), Some(30.0)).unwrap() - expected).abs() < 1e-17);
    // The end of the span is five time constants: the model goes on there, and ends at zero.
    assert!(drift.value(Some(1e6), Some(36.0)).unwrap().abs() < 1e-300);
}

#[test]
fn nothing_is_said_outside_the_spans() {
    let drift = two_transients();
    let refused = |time_s, temperature_c| drift.value(Some(time_s), Some(temperature_c)).unwrap_err();
    assert!(matches!(refused(9.0, 30.0), Error::OutsideDriftSpan { name: "time since power-on", .. }));
    assert!(matches!(refused(f64::NAN, 30.0), Error::OutsideDriftSpan { .. }));
    assert!(matches!(refused(100.0, 41.0), Error::OutsideDriftSpan { name: "temperature", .. }));
    assert!(matches!(drift.value(Some(100.0), None).unwrap_err(), Error::MissingForDrift { name: "temperature" }));
    assert!(matches!(drift.value(None, Some(30.0)).unwrap_err(), Error::MissingForDrift { .. }));
    // Two time constants only: what comes behind is not known.
    let short = WarmUp { time_span_s: Some([10.0, 2400.0]), ..two_transients() };
    assert!(matches!(short.value(Some(2401.0), Some(30.0)).unwrap_err(), Error::OutsideDriftSpan { .. }));
    // A drift by temperature alone asks for no time.
    let warm = WarmUp { transients: Vec::new(), ..two_transients() };
    assert!((warm.value(None, Some(37.0)).unwrap() - 0.0008).abs() < 1e-18);
}

#[test]
fn bad_drifts_are_refused() {
    let bad = |change: fn(&mut WarmUp)| {
        let mut drift = two_transients();
        change(&mut drift);
        drift.validate().unwrap_err()
    };
    assert!(matches!(bad(|d| d.transients[0].time_constant_s = 0.0), Error::OutOfDomain { .. }));
    assert!(matches!(bad(|d| d.transients[1].amplitude_m = f64::NAN), Error::OutOfDomain { .. }));
    assert!(matches!(bad(|d| d.time_span_s = Some([5.0, 5.0])), Error::OutOfDomain { .. }));
    two_transients().validate().unwrap();
}

#[test]
fn the_deviation_is_that_of_sampled_parameters() {
    let drift = two_transients();
    let count = drift.parameter_values().len();
    // Correlated parameters: a factor with deviations of some percent of each.
    let scale = [2e-4, 8.0, 1e-4, 30.0, 2e-5];
    let factor = DMatrix::from_fn(count, count, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => scale[i],
        std::cmp::Ordering::Greater => 0.3 * scale[i],
    });
    let predicted = drift.sigma_m(Some(300.0), Some(30.0), &(&factor * factor.transpose())).unwrap();
    let mut generator = Pcg64::seed_from_u64(11);
    let runs = 20_000;
    let centre = drift.value(Some(300.0), Some(30.0)).unwrap();
    let squares: f64 = (0..runs)
        .map(|_| {
            let draws: Vec<f64> = (0..count).map(|_| StandardNormal.sample(&mut generator)).collect();
            let step = &factor * DMatrix::from_column_slice(count, 1, &draws);
            let mut sampled = drift.clone();
            for (index, part) in sampled.transients.iter_mut().enumerate() {
                part.amplitude_m += step[2 * index];
                part.time_constant_s += step[2 * index + 1];
            }
            sampled.temperature.as_mut().unwrap().coefficient_m_per_k += step[4];
            (sampled.value(Some(300.0), Some(30.0)).unwrap() - centre).powi(2)
        })
        .sum();
    let sampled = (squares / f64::from(runs)).sqrt();
    // A deviation of 20 000 runs is known to 0.5 %; the curvature in tau adds less than that.
    assert!((sampled / predicted - 1.0).abs() < 0.02, "sampled {sampled}, predicted {predicted}");
    assert!(matches!(
        drift.sigma_m(Some(300.0), Some(30.0), &DMatrix::zeros(2, 2)).unwrap_err(),
        Error::WrongLength { found: 2, expected: 5, .. }
    ));
}

proptest! {
    #[test]
    fn jacobians_are_those_of_differences(
        amplitudes in prop::array::uniform2(-0.05..0.05_f64),
        constants in prop::array::uniform2(30.0..3000.0_f64),
        time_s in 0.0..5000.0_f64,
        temperature_c in 15.0..45.0_f64,
    ) {
        let drift = |values: &[f64]| WarmUp {
            transients: vec![
                Transient { amplitude_m: values[0], time_constant_s: values[1] },
                Transient { amplitude_m: values[2], time_constant_s: values[3] },
            ],
            temperature: Some(TemperatureDrift { coefficient_m_per_k: values[4], reference_c: 30.0, span_c: None }),
            frame_rate: None,
            time_span_s: None,
        };
        let values = [amplitudes[0], constants[0], amplitudes[1], constants[1], 0.001];
        let model = drift(&values);
        prop_assert_eq!(model.parameter_values(), values.to_vec());
        let row = model.jacobian(Some(time_s), Some(temperature_c)).unwrap();
        for index in 0..5 {
            let step = 1e-5 * values[index].abs().max(1e-3);
            let moved = |sign: f64| {
                let mut moved = values;
                moved[index] += sign * step;
                drift(&moved).value(Some(time_s), Some(temperature_c)).unwrap()
            };
            let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            // Central differences: 1e-10 of the value over the step, and the square of the relative step.
            prop_assert!((row[index] - difference).abs() < 1e-7 * (1.0 + row[index].abs()), "{}", model.parameter_names()[index]);
        }
    }

    #[test]
    fn a_drift_has_settled_at_its_settling_time_and_not_before(
        amplitudes in prop::array::uniform2(-0.05..0.05_f64),
        constants in prop::array::uniform2(30.0..3000.0_f64),
    ) {
        let transients: Vec<_> = amplitudes.into_iter().zip(constants)
            .map(|(amplitude_m, time_constant_s)| Transient { amplitude_m, time_constant_s }).collect();
        let drift = WarmUp { transients, ..WarmUp::default() };
        let settled = drift.settling_time_s(0.001);
        let at = |time_s: f64| drift.value(Some(time_s), None).unwrap().abs();
        for part in 0..100 {
            prop_assert!(at(settled + 50.0 * f64::from(part)) <= 0.001 + 1e-12);
        }
        if settled > 0.0 {
            // Just before, within the millionth of a time constant that the search ends at.
            prop_assert!(at((settled - 0.01).max(0.0)) > 0.001 - 1e-5);
        }
    }
}
