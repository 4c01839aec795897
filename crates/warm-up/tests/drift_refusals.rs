//! What captures of a drift are refused for, each by its name.

use crate::drift_captures::{Capture, room_temperature_c, transients, with_temperature};
use warm_up::{DriftError, DriftOptions, DriftSample, TemperatureUse, estimate_drift};

fn capture() -> Capture {
    Capture::new(transients(&[(-0.003, 1200.0)]))
}

fn refusal(samples: &[DriftSample]) -> DriftError {
    estimate_drift(samples, &DriftOptions::default()).unwrap_err()
}

#[test]
fn ten_seconds_and_a_drift_that_goes_on_are_too_short() {
    let error = refusal(&Capture { duration_s: 10.0, ..capture() }.samples(1));
    assert!(matches!(error, DriftError::CaptureTooShort { .. }), "{error}");
    for (duration_s, seed) in [(2400.0, 2), (1200.0, 3), (700.0, 4)] {
        let error = refusal(&Capture { duration_s, sigma_m: 5e-5, ..capture() }.samples(seed));
        assert!(matches!(error, DriftError::ShorterThanTimeConstant { .. }), "{duration_s} s: {error}");
    }
    assert!(error.to_string().contains("too short"), "{error}");
}

#[test]
fn too_few_samples_are_refused() {
    let error = refusal(&Capture { count: 20, ..capture() }.samples(1));
    assert!(matches!(error, DriftError::TooFewBlocks { blocks: 20, .. }), "{error}");
    assert!(matches!(refusal(&[]), DriftError::TooFewBlocks { blocks: 0, .. }));
}

#[test]
fn samples_that_are_none_are_named() {
    let mut samples = capture().samples(1);
    samples[7].time_s = samples[6].time_s;
    assert!(matches!(refusal(&samples), DriftError::NotAscending { index: 7, .. }));
    for (name, change) in [
        ("mean change", (|one: &mut DriftSample| one.mean_change_m = f64::NAN) as fn(&mut DriftSample)),
        ("standard deviation", |one| one.sigma_m = 0.0),
        ("time since power-on", |one| one.time_s = f64::INFINITY),
        ("temperature", |one| one.temperature_c = Some(f64::NAN)),
    ] {
        let mut samples = capture().samples(1);
        change(&mut samples[9]);
        let error = refusal(&samples);
        assert!(matches!(error, DriftError::BadSample { index: 9, name: found, .. } if found == name), "{error}");
    }
    let mut samples = capture().samples(1);
    for sample in &mut samples {
        sample.time_s -= 100.0;
    }
    assert!(matches!(refusal(&samples), DriftError::BadSample { index: 0, .. }), "before power-on");
}

#[test]
fn a_jump_is_named_with_its_time_and_size() {
    for (seed, size_m, place) in [(1, 0.002, 500), (2, -0.001, 300), (3, 0.02, 800)] {
        let mut samples = capture().samples(seed);
        for sample in &mut samples[place..] {
            sample.mean_change_m += size_m;
        }
        let error = refusal(&samples);
        let DriftError::Jump { time_s, size_m: found, sigma_m } = error else { unreachable!("{error}") };
        // The length of a block, and four deviations of the size.
        assert!((time_s - samples[place].time_s).abs() < 100.0, "{error}");
        assert!((found - size_m).abs() < 4.0 * sigma_m, "{error}");
    }
}

#[test]
fn steep_transients_are_no_jumps() {
    for seed in 0..20 {
        let capture = Capture::new(transients(&[(-0.02, 150.0)]));
        assert!(estimate_drift(&capture.samples(seed), &DriftOptions::default()).is_ok(), "seed {seed}");
    }
}

#[test]
fn a_pause_is_named() {
    let mut samples = capture().samples(1);
    samples.retain(|sample| !(6000.0..8000.0).contains(&sample.time_s));
    let error = refusal(&samples);
    let DriftError::FrameRateUnknown { from_s, to_s } = error else { unreachable!("{error}") };
    // An interval on either side.
    assert!((from_s - 6000.0).abs() < 20.0 && (to_s - 8000.0).abs() < 20.0, "{error}");
    // Single frames that were lost are none.
    let mut samples = Capture { count: 3000, ..capture() }.samples(1);
    let mut index = 0;
    samples.retain(|_| {
        index += 1;
        index % 7 != 0
    });
    assert!(estimate_drift(&samples, &DriftOptions::default()).is_ok());
}

#[test]
fn a_temperature_that_tells_nothing_is_named() {
    let options = DriftOptions { temperature: TemperatureUse::Estimate, ..DriftOptions::default() };
    let error = estimate_drift(&capture().samples(1), &options).unwrap_err();
    assert!(matches!(error, DriftError::MissingTemperature { index: 0 }), "{error}");
    let constant = Capture { temperature_c: |_| Some(41.0), ..capture() };
    let error = estimate_drift(&constant.samples(1), &options).unwrap_err();
    assert!(matches!(error, DriftError::TemperatureConstant { .. }), "{error}");
    let varying =
        Capture { temperature_c: |time_s| Some(room_temperature_c(time_s)), ..Capture::new(with_temperature()) };
    assert!(estimate_drift(&varying.samples(1), &options).is_ok());
}

#[test]
fn what_wanders_is_not_explained() {
    // A random walk, as of a wall that creeps with the weather.
    let wandering = Capture { count: 400, sigma_m: 2e-3, correlation: 0.99, ..capture() };
    let error = refusal(&wandering.samples(5));
    let named = matches!(error, DriftError::NotExplained { .. } | DriftError::ShorterThanTimeConstant { .. });
    assert!(named, "{error}");
}

#[test]
fn options_outside_their_domain_are_named() {
    let samples = capture().samples(1);
    let default = DriftOptions::default();
    for (name, options) in [
        ("blocks", DriftOptions { blocks: 29, ..default }),
        ("level", DriftOptions { level: 1.0, ..default }),
        ("tolerance_m", DriftOptions { tolerance_m: Some(0.0), ..default }),
        ("least_duration_s", DriftOptions { least_duration_s: f64::NAN, ..default }),
        ("largest_autocorrelation", DriftOptions { largest_autocorrelation: 1.0, ..default }),
    ] {
        let error = estimate_drift(&samples, &options).unwrap_err();
        assert!(matches!(error, DriftError::OutOfDomain { name: found, .. } if found == name), "{error}");
    }
}
