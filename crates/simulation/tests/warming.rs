//! A camera that warms up, several integration times, and the optical reference.
// Times are handed through as they are.

use crate::common::{INTERVAL_M, largest, plain, range_error, wrapped};
use error_models::{FrameRateDrift, ModelSet, RangeErrorModel, RangeTerms, TemperatureDrift, Transient, WarmUp};
use range_image::{ComplexFrame, Flags, Samples, demodulate};
use simulation::{
    DigitisationSpec, IntervalChange, ReferencePathSpec, SampleType, SimulatedFrame, SimulationSpec, TemperatureSpec,
    simulate, simulate_frame,
};

/// f32 rounding of samples, phase and truth; see `error_free.rs`.
const ROUNDING_M: f64 = 2e-6;

fn complex(spec: &SimulationSpec, frame: &SimulatedFrame) -> ComplexFrame {
    demodulate(&frame.raw, &spec.demodulation_options()).unwrap()
}

fn warming() -> SimulationSpec {
    let mut spec = plain();
    (spec.exposure.frame_interval_s, spec.exposure.start_s, spec.exposure.power_on_s) = (300.0, 500.0, Some(440.0));
    spec.exposure.temperature = Some(TemperatureSpec { cold_c: 20.0, warm_c: 40.0, time_constant_s: 600.0 });
    let temperature = TemperatureDrift { coefficient_m_per_k: 0.001, reference_c: 40.0, span_c: None };
    spec.errors.warm_up = Some(WarmUp {
        transients: vec![Transient { amplitude_m: 0.03, time_constant_s: 600.0 }],
        temperature: Some(temperature),
        frame_rate: None,
        time_span_s: None,
    });
    spec
}

#[test]
fn every_frame_is_off_by_the_drift_of_its_time() {
    let spec = warming();
    let survey = simulate(&spec, 1, &|_, _| {}).unwrap();
    for (frame, time_s) in survey.frames.iter().zip([60.0, 360.0]) {
        let left = f64::exp(-time_s / 600.0);
        assert!((frame.temperature_c.unwrap() - (40.0 - 20.0 * left)).abs() < 1e-12);
        let expected = 0.03 * left - 0.001 * 20.0 * left;
        let error = range_error(&complex(&spec, frame), 0, &frame.truth.range);
        let off: Vec<f64> = error.iter().map(|error| wrapped(error - expected, INTERVAL_M)).collect();
        assert!(largest(&off) < 2.0 * ROUNDING_M, "{} m", largest(&off));
    }
    // One frame alone is the same; without a drift the second frame is that of always.
    assert_eq!(simulate_frame(&spec, 1, 0, 1).unwrap(), survey.frames[1]);
    let still = SimulationSpec { errors: plain().errors, ..spec };
    assert_eq!(simulate_frame(&still, 1, 0, 1).unwrap().raw, simulate_frame(&plain(), 1, 0, 1).unwrap().raw);
}

#[test]
fn ranges_follow_the_frame_rate() {
    let mut spec = plain();
    spec.exposure.frames_per_station = 5;
    (spec.exposure.frame_interval_s, spec.exposure.start_s, spec.exposure.power_on_s) = (100.0, 500.0, Some(440.0));
    let change = |from_frame, frame_interval_s| IntervalChange { from_frame, frame_interval_s };
    spec.exposure.interval_changes = vec![change(2, 10.0), change(3, 100.0)];
    spec.errors.warm_up = Some(WarmUp {
        frame_rate: Some(FrameRateDrift {
            coefficient_m_per_hz: 0.5,
            time_constant_s: 200.0,
            reference_hz: 0.02,
            span_hz: None,
        }),
        ..WarmUp::default()
    });
    let survey = simulate(&spec, 1, &|_, _| {}).unwrap();
    let times: Vec<f64> = survey.frames.iter().map(|frame| frame.timestamp_s).collect();
    assert_eq!(times, [500.0, 600.0, 700.0, 710.0, 810.0]);
    // Half of the reference rate from power-on on, ten times that rate for ten seconds.
    let gone = |time_s: f64| 1.0 - f64::exp(-time_s.max(0.0) / 200.0);
    for (frame, time_s) in survey.frames.iter().zip(times) {
        let expected = 0.5 * (-0.01 * gone(time_s - 440.0) + 0.09 * (gone(time_s - 700.0) - gone(time_s - 710.0)));
        let error = range_error(&complex(&spec, frame), 0, &frame.truth.range);
        let off: Vec<f64> = error.iter().map(|error| wrapped(error - expected, INTERVAL_M)).collect();
        assert!(largest(&off) < 2.0 * ROUNDING_M, "{} m at {time_s} s", largest(&off));
    }
}

#[test]
fn each_integration_time_has_its_own_light_errors_and_saturation() {
    let mut spec = plain();
    spec.exposure.further_integration_times_s = vec![0.008];
    let model = |d0| RangeErrorModel {
        terms: RangeTerms { d0, ..RangeTerms::default() },
        ..RangeErrorModel::error_free(INTERVAL_M)
    };
    // Equal ratios: 2 ms and 8 ms are a quarter and three quarters of the way from 1 ms to 16 ms.
    let entries = vec![(0.001, vec![model(0.0)]), (0.016, vec![model(0.04)])];
    spec.errors.range_by_integration_time = Some(ModelSet { entries });
    let survey = simulate(&spec, 1, &|_, _| {}).unwrap();
    let times: Vec<f64> = survey.frames.iter().map(|frame| frame.integration_time_s).collect();
    assert_eq!(times, [0.002, 0.002, 0.008, 0.008]);
    let frames: Vec<ComplexFrame> = survey.frames.iter().map(|frame| complex(&spec, frame)).collect();
    for (index, expected) in [(0, 0.01), (2, 0.03)] {
        let error = range_error(&frames[index], 0, &survey.frames[index].truth.range);
        let off: Vec<f64> = error.iter().map(|error| error - expected).collect();
        assert!(largest(&off) < 2.0 * ROUNDING_M, "{} m", largest(&off));
    }
    let [short, long] = [0, 2].map(|index| frames[index].channels[0].amplitude());
    for (short, long) in short.as_slice().iter().zip(long.as_slice()) {
        // Rounding of samples in single precision.
        assert!((long / short - 4.0).abs() < 1e-3, "{short} {long}");
    }
    // Counts end where the longer time has too much light.
    spec.errors.digitisation =
        Some(DigitisationSpec { sample_type: SampleType::U16, raw_scale: 1.0, saturation: Some(8000.0) });
    let saturated = |frame: usize| {
        let frame = simulate_frame(&spec, 1, 0, frame).unwrap();
        let Samples::U16(counts) = frame.raw.samples() else { unreachable!("asked for u16") };
        assert!(counts.iter().all(|count| *count <= 8000));
        complex(&spec, &frame).flags.as_slice().iter().filter(|flags| flags.contains(Flags::SATURATED)).count()
    };
    let (short, long) = (saturated(0), saturated(2));
    assert!(long > 10 + 2 * short, "{short} pixels saturated at 2 ms, {long} at 8 ms");
}

#[test]
fn the_reference_shows_its_length_and_the_errors_of_the_camera() {
    let mut spec = warming();
    spec.camera.reference_path =
        Some(ReferencePathSpec { columns: [2, 4], rows: [30, 35], length_m: 0.75, power: 1e6 });
    let frame = simulate_frame(&spec, 1, 0, 0).unwrap();
    let plain = simulate_frame(&warming(), 1, 0, 0).unwrap();
    let shown = complex(&spec, &frame);
    let expected = 0.75 + 0.01 * f64::exp(-0.1);
    for row in 0..36 {
        for col in 0..48 {
            let pixel = (col, row);
            if (2..=4).contains(&col) && (30..=35).contains(&row) {
                let range = shown.channels[0].modulation.range_from_phase(f64::from(shown.channels[0].phase()[pixel]));
                assert!((range - expected).abs() < 2.0 * ROUNDING_M, "{range} instead of {expected}");
                assert!(frame.truth.range[pixel].is_nan() && frame.truth.object[pixel].is_none());
                assert!((f64::from(frame.truth.amplitude[0][pixel]) - 2000.0).abs() < 1e-3);
            } else {
                assert_eq!(frame.truth.range[pixel].to_bits(), plain.truth.range[pixel].to_bits());
            }
        }
    }
}
