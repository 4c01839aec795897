//! Drift that follows the frame rate, and rates from the times of frames.

use error_models::{Error, FrameRateDrift, RateHistory, RatePhase, Transient, WarmUp};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const DRIFT: FrameRateDrift =
    FrameRateDrift { coefficient_m_per_hz: 0.004, time_constant_s: 900.0, reference_hz: 0.5, span_hz: None };

fn history(phases: &[(f64, f64)]) -> RateHistory {
    RateHistory::new(phases.iter().map(|&(since_s, rate_hz)| RatePhase { since_s, rate_hz }).collect()).unwrap()
}

/// Slow, fast (as in Fig. 6 of the chapter), slow again.
fn low_high_low() -> RateHistory {
    history(&[(0.0, 0.5), (3600.0, 10.0), (7200.0, 0.5)])
}

fn drift(part: FrameRateDrift) -> WarmUp {
    WarmUp {
        transients: vec![Transient { amplitude_m: -0.01, time_constant_s: 600.0 }],
        frame_rate: Some(part),
        time_span_s: Some([60.0, 10_000.0]),
        ..WarmUp::default()
    }
}

#[test]
fn the_closed_form_solves_the_differential_equation() {
    // Another rate than the reference from power-on on, too.
    let rates = history(&[(0.0, 2.0), (3600.0, 10.0), (7200.0, 0.0)]);
    let (mut u, step_s) = (0.0, 0.5);
    for step in 0..20_000 {
        let time_s = f64::from(step) * step_s;
        assert!((DRIFT.value(time_s, &rates) - u).abs() < 1e-9, "{time_s} s");
        // Exact for a rate that is constant over the step, and changes lie at its ends.
        let limit = DRIFT.coefficient_m_per_hz * (rates.rate_hz(time_s) - DRIFT.reference_hz);
        u = limit + (u - limit) * (-step_s / DRIFT.time_constant_s).exp();
    }
    // At the reference rate there is nothing, and after a long time all of it.
    assert_eq!(DRIFT.value(5000.0, &history(&[(0.0, 0.5)])), 0.0);
    assert!((DRIFT.value(1e6, &history(&[(0.0, 10.0)])) - 0.004 * 9.5).abs() < 1e-15);
    assert!((DRIFT.limit(4000.0, &low_high_low()) - 0.004 * 9.5).abs() < 1e-15);
}

#[test]
fn a_drift_that_follows_the_rate_asks_for_it() {
    let model = drift(DRIFT);
    assert!(matches!(
        model.value(Some(100.0), None).unwrap_err(),
        Error::MissingForDrift { name: "frame rate since power-on" }
    ));
    let rates = low_high_low();
    let value = model.value_at_rates(Some(4500.0), None, Some(&rates)).unwrap();
    let expected = -0.01 * (-7.5_f64).exp() + 0.004 * 9.5 * (1.0 - (-1.0_f64).exp());
    assert!((value - expected).abs() < 1e-16, "{value} for {expected}");
    assert!(matches!(model.value_at_rates(Some(-1.0), None, Some(&rates)), Err(Error::OutsideDriftSpan { .. })));
    // Without a part that follows it, the rate does not matter.
    let plain = WarmUp { frame_rate: None, ..model.clone() };
    assert_eq!(
        plain.value(Some(4500.0), None).unwrap(),
        plain.value_at_rates(Some(4500.0), None, Some(&rates)).unwrap()
    );
    for (part, name) in [
        (FrameRateDrift { time_constant_s: 0.0, ..DRIFT }, "time_constant_s"),
        (FrameRateDrift { coefficient_m_per_hz: f64::NAN, ..DRIFT }, "coefficient_m_per_hz"),
        (FrameRateDrift { reference_hz: f64::INFINITY, ..DRIFT }, "reference_hz"),
        (FrameRateDrift { span_hz: Some([2.0, 1.0]), ..DRIFT }, "span_hz"),
    ] {
        let error = drift(part).validate().unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    model.validate().unwrap();
}

#[test]
fn rates_outside_the_span_are_refused_as_long_as_they_matter() {
    let part = FrameRateDrift { span_hz: Some([0.5, 10.0]), ..DRIFT };
    let at = |time_s: f64, rates: &RateHistory| drift(part).value_at_rates(Some(time_s), None, Some(rates));
    let fast = history(&[(0.0, 0.5), (3600.0, 25.0), (5000.0, 10.0)]);
    assert!(at(3600.0, &fast).is_ok(), "the fast phase has not begun to matter");
    let error = at(4500.0, &fast).unwrap_err();
    assert!(matches!(error, Error::OutsideDriftSpan { name: "frame rate", value: 25.0, .. }), "{error}");
    assert!(at(5100.0, &fast).is_err());
    // Three time constants later it is forgotten.
    assert!(at(5000.0 + 3.0 * 900.0, &fast).is_ok());
    // Rates of frames are not exact: a tenth of the span's width is nothing.
    assert!(at(9000.0, &history(&[(0.0, 0.49), (4000.0, 10.4)])).is_ok());
    assert!(at(9000.0, &history(&[(0.0, 12.0)])).is_err());
}

#[test]
fn unknown_rates_are_refused_as_long_as_they_matter_and_make_deviations_wider() {
    let part = FrameRateDrift { span_hz: Some([0.5, 10.0]), ..DRIFT };
    let at = |time_s: f64, rates: &RateHistory| drift(part).value_at_rates(Some(time_s), None, Some(rates));
    let late = history(&[(600.0, 0.5), (3600.0, 10.0)]);
    let error = at(700.0, &late).unwrap_err();
    assert!(matches!(error, Error::UnknownFrameRate { from_s: 0.0, to_s: 600.0 }), "{error}");
    assert!(at(600.0 + 3.0 * 900.0, &late).is_ok());
    let share = (-2700.0_f64 / 900.0).exp() - (-3300.0_f64 / 900.0).exp();
    let expected = 0.004 * 9.5 * share / 12.0_f64.sqrt();
    assert!((part.unknown_sigma_m(3300.0, &late) - expected).abs() < 1e-15);
    assert_eq!(part.unknown_sigma_m(3300.0, &low_high_low()), 0.0);
}

#[test]
fn bad_rates_are_refused() {
    let new = |phases: &[(f64, f64)]| {
        let phases = phases.iter().map(|&(since_s, rate_hz)| RatePhase { since_s, rate_hz });
        RateHistory::new(phases.collect()).unwrap_err().to_string()
    };
    assert!(new(&[]).contains("at least one"));
    assert!(new(&[(0.0, -1.0)]).contains("rate_hz = -1"));
    assert!(new(&[(0.0, 1.0), (0.0, 2.0)]).contains("after that of the rate before"));
    assert!(new(&[(f64::NAN, 1.0)]).contains("since_s"));
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    assert!(matches!(RateHistory::of_frames(&times, 0.0), Err(Error::NoFrameStream { frames: 10, needed: 11 })));
    let mut times: Vec<f64> = (0..20).map(f64::from).collect();
    times[7] = times[6];
    assert!(matches!(RateHistory::of_frames(&times, 0.0), Err(Error::OutOfDomain { .. })));
}

/// Times of frames at rates, each from a time on, with jitter of the intervals.
fn stream(rates: &[(f64, f64)], end_s: f64, jitter: f64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(3);
    let (mut times, mut time_s) = (Vec::new(), rates[0].0);
    for (place, (_, rate_hz)) in rates.iter().enumerate() {
        let end_s = rates.get(place + 1).map_or(end_s, |next| next.0);
        while time_s < end_s {
            times.push(time_s);
            time_s += (1.0 + jitter * (2.0 * random.random::<f64>() - 1.0)) / rate_hz;
        }
    }
    times
}

#[test]
fn phases_are_those_of_the_frames() {
    for jitter in [0.0, 0.2] {
        let times = stream(&[(20.0, 0.1), (2000.0, 5.0), (4000.0, 1.0), (6000.0, 1.5)], 8000.0, jitter);
        let found = RateHistory::of_frames(&times, 60.0).unwrap();
        assert!(found.unknown().is_empty(), "{:?}", found.unknown());
        assert_eq!(found.phases().len(), 4, "{:?}", found.phases());
        for (phase, (since_s, rate_hz)) in
            found.phases().iter().zip([(0.0, 0.1), (2000.0, 5.0), (4000.0, 1.0), (6000.0, 1.5)])
        {
            // The change lies within an interval of the slower rate.
            assert!((phase.since_s - since_s).abs() <= 12.0, "{phase:?}");
            // Four deviations of the mean of n uniform intervals, and one interval that counts with the other phase.
            let n = 1980.0 * rate_hz;
            let bar = 4.0 * jitter / f64::sqrt(3.0 * n) + 1.0 / n;
            assert!((phase.rate_hz / rate_hz - 1.0).abs() < bar, "{phase:?}");
        }
    }
}

#[test]
fn lost_frames_are_no_change_and_pauses_are_unknown() {
    let mut times = stream(&[(30.0, 1.0)], 3000.0, 0.05);
    let mut index = 0;
    times.retain(|time_s| {
        index += 1;
        index % 7 != 0 && !(1000.0..1400.0).contains(time_s)
    });
    let found = RateHistory::of_frames(&times, 0.0).unwrap();
    assert_eq!(found.phases().len(), 1, "{:?}", found.phases());
    assert!((found.phases()[0].rate_hz - 1.0).abs() < 0.01, "lost frames were taken: {:?}", found.phases());
    // From power-on to the first frame, and the pause.
    assert_eq!(found.unknown().len(), 2, "{:?}", found.unknown());
    assert_eq!(found.unknown()[0], [0.0, 30.0]);
    assert!((found.unknown()[1][1] - found.unknown()[1][0] - 400.0).abs() < 3.0);
    assert_eq!(found.rate_hz(-5.0), found.phases()[0].rate_hz);
}

proptest! {
    #[test]
    fn jacobians_are_those_of_differences(
        coefficient_m_per_hz in -0.01..0.01_f64,
        time_constant_s in 60.0..3000.0_f64,
        change_s in 100.0..4000.0_f64,
        time_s in 0.0..9000.0_f64,
    ) {
        let rates = history(&[(0.0, 2.0), (change_s, 8.0), (change_s + 1500.0, 0.3)]);
        let model = |values: [f64; 2]| drift(FrameRateDrift {
            coefficient_m_per_hz: values[0],
            time_constant_s: values[1],
            ..DRIFT
        });
        let values = [coefficient_m_per_hz, time_constant_s];
        let names = model(values).parameter_names();
        prop_assert_eq!(&names[2..], ["cF", "tauF"]);
        prop_assert_eq!(&model(values).parameter_values()[2..], values);
        prop_assert_eq!((WarmUp::parameter_unit("cF"), WarmUp::parameter_unit("tauF")), (Some("m/Hz"), Some("s")));
        let all = WarmUp { time_span_s: None, ..model(values) };
        let row = all.jacobian_at_rates(Some(time_s), None, Some(&rates)).unwrap();
        for index in 0..2 {
            let step = 1e-5 * values[index].abs().max(1e-3);
            let moved = |sign: f64| {
                let mut moved = values;
                moved[index] += sign * step;
                WarmUp { time_span_s: None, ..model(moved) }.value_at_rates(Some(time_s), None, Some(&rates)).unwrap()
            };
            let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            // Central differences: 1e-10 of the value over the step, and the square of the relative step.
            prop_assert!((row[2 + index] - difference).abs() < 1e-7 * (1.0 + row[2 + index].abs()), "{}", names[2 + index]);
        }
    }
}
