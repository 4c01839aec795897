//! What is refused, and what is flagged.

use live_frames::error_models::{TemperatureDrift, Transient, WarmUp};
use live_frames::range_image::{Flags, SampleSlice, Samples};
use live_frames::range_io::calibration::{CalibratedDrift, Calibration};
use live_frames::{DriftStage, Error, Exposure, Limits, Processor, Stages};

use crate::common::{Sequence, stages};

fn processor(sequence: &Sequence, calibration: &Calibration) -> Processor {
    Processor::new(&sequence.camera(), calibration, stages(1), Limits::default()).unwrap()
}

fn floats(samples: &Samples) -> Vec<f32> {
    match samples {
        Samples::F32(values) => values.clone(),
        Samples::U16(values) => values.iter().map(|value| f32::from(*value)).collect(),
        Samples::I16(values) => values.iter().map(|value| f32::from(*value)).collect(),
    }
}

#[test]
fn frames_of_another_size_and_times_that_go_back() {
    let sequence = Sequence::default();
    let mut processor = processor(&sequence, &sequence.calibration());
    let samples = floats(sequence.frame(0).raw.samples());
    let short = processor.process(&samples[1..], 0.0);
    assert!(matches!(short, Err(Error::Size { found, expected, .. }) if found + 1 == expected), "{short:?}");
    processor.process(samples.as_slice(), 1.0).unwrap();
    for time in [1.0, 0.5, f64::NAN, f64::INFINITY] {
        assert!(matches!(processor.process(samples.as_slice(), time), Err(Error::Time { .. })), "{time}");
    }
    processor.restart();
    processor.process(samples.as_slice(), 0.5).unwrap();
}

#[test]
fn samples_that_are_not_finite() {
    let sequence = Sequence::default();
    let mut processor = processor(&sequence, &sequence.calibration());
    let mut samples = floats(sequence.frame(0).raw.samples());
    let good = samples.clone();
    samples[500] = f32::NAN;
    let frame = processor.process(samples.as_slice(), 0.0).unwrap();
    assert!(frame.flags.as_slice()[500].contains(Flags::NO_DATA | Flags::UNWRAP_UNSURE));
    assert!(frame.range.as_slice()[500].is_nan() && frame.points[500][0].is_nan());
    assert!(frame.range.as_slice()[501].is_finite());
    samples.fill(f32::NAN);
    let refused = processor.process(samples.as_slice(), 1.0);
    assert!(matches!(refused, Err(Error::Missing { .. })), "{refused:?}");
    // The next frame may come.
    processor.process(good.as_slice(), 1.0).unwrap();
}

#[test]
fn exposures_that_are_not_calibrated() {
    let sequence = Sequence::default();
    let calibration = sequence.calibration();
    let mut processor = processor(&sequence, &calibration);
    let raw = sequence.frame(0).raw;
    let at = |time_s: f64, integration_time_s: f64| Exposure {
        integration_time_s: Some(integration_time_s),
        ..Exposure::from(time_s)
    };
    let refused = processor.process(raw.samples(), at(0.0, 0.004));
    assert!(matches!(&refused, Err(Error::Exposure { reason, .. }) if !reason.is_empty()), "{refused:?}");
    processor.process(raw.samples(), at(0.0, 0.002)).unwrap();
    // Of several times, one has to be named.
    let mut two = calibration.clone();
    two.range_models.push(calibration.range_models[0].clone());
    two.range_models[1].integration_time_s = 0.004;
    let mut processor = self::processor(&sequence, &two);
    assert!(matches!(processor.process(raw.samples(), 0.0), Err(Error::Unstated { .. })));
    processor.process(raw.samples(), at(0.0, 0.003)).unwrap();
    // Without models it is the span that speaks.
    let mut bare = calibration;
    bare.warm_up = Some(drift());
    bare.range_models.clear();
    bare.span.integration_time_s = Some([0.001, 0.003]);
    let mut processor = self::processor(&sequence, &bare);
    let warm = |exposure: Exposure| Exposure { temperature_c: Some(40.0), ..exposure };
    assert!(matches!(processor.process(raw.samples(), warm(at(0.0, 0.004))), Err(Error::Exposure { .. })));
    processor.process(raw.samples(), warm(at(0.0, 0.002))).unwrap();
}

fn drift() -> CalibratedDrift {
    let temperature = TemperatureDrift { coefficient_m_per_k: 0.001, reference_c: 30.0, span_c: None };
    let model = WarmUp { temperature: Some(temperature), ..WarmUp::default() };
    CalibratedDrift { model, deviations: vec![0.0], correlation: None }
}

#[test]
fn temperature_is_taken_off_and_flagged_outside_of_its_span() {
    let sequence = Sequence::default();
    let mut calibration = sequence.calibration();
    calibration.warm_up = Some(drift());
    calibration.span.temperature_c = Some([20.0, 45.0]);
    let mut processor = processor(&sequence, &calibration);
    let raw = sequence.frame(0).raw;
    let at =
        |time_s: f64, temperature_c: f64| Exposure { temperature_c: Some(temperature_c), ..Exposure::from(time_s) };
    let reference = processor.process(raw.samples(), at(0.0, 30.0)).unwrap().clone();
    let warm = processor.process(raw.samples(), at(0.1, 40.0)).unwrap();
    assert!((warm.drift_m - 0.01).abs() < 1e-12);
    let pixel = warm.flags.as_slice().iter().position(Flags::is_empty).unwrap();
    let moved = f64::from(reference.range.as_slice()[pixel]) - f64::from(warm.range.as_slice()[pixel]);
    assert!((moved - 0.01).abs() < 2e-6, "{moved}");
    let hot = processor.process(raw.samples(), at(0.2, 50.0)).unwrap();
    let measured = hot.range.as_slice().iter().zip(hot.flags.as_slice()).filter(|(range, _)| range.is_finite());
    assert!(measured.clone().count() > 1000 && measured.clone().all(|(_, flags)| flags.contains(Flags::OUTSIDE_SPAN)));
    assert!(matches!(processor.process(raw.samples(), 0.3), Err(Error::Unstated { .. })));
    // Told to leave the drift, it asks for nothing.
    let ignoring = Stages { drift: DriftStage::Ignore, ..stages(1) };
    let mut processor = Processor::new(&sequence.camera(), &calibration, ignoring, Limits::default()).unwrap();
    assert_eq!(processor.process(raw.samples(), 0.0).unwrap().drift_m, 0.0);
}

#[test]
fn times_since_power_on() {
    let sequence = Sequence::default();
    let mut calibration = sequence.calibration();
    let transients = vec![Transient { amplitude_m: 0.02, time_constant_s: 600.0 }];
    let model = WarmUp { transients, ..WarmUp::default() };
    calibration.warm_up = Some(CalibratedDrift { model, deviations: vec![0.0; 2], correlation: None });
    let raw = sequence.frame(0).raw;
    let mut without = processor(&sequence, &calibration);
    assert!(matches!(without.process(raw.samples(), 0.0), Err(Error::Unstated { .. })));
    let mut camera = sequence.camera();
    camera.power_on_s = Some(-600.0);
    let mut with = Processor::new(&camera, &calibration, stages(1), Limits::default()).unwrap();
    let frame = with.process(raw.samples(), 0.0).unwrap();
    assert!((frame.drift_m - 0.02 / std::f64::consts::E).abs() < 1e-12);
}

#[test]
fn cameras_and_options_that_are_none() {
    let sequence = Sequence::default();
    let calibration = sequence.calibration();
    let refused = |camera, stages, limits| Processor::new(&camera, &calibration, stages, limits).unwrap_err();
    let mut camera = sequence.camera();
    camera.phase_steps = 2;
    assert!(matches!(refused(camera, stages(1), Limits::default()), Error::OutOfDomain { name: "phase_steps", .. }));
    let mut camera = sequence.camera();
    camera.modulations.clear();
    assert!(matches!(refused(camera, stages(1), Limits::default()), Error::OutOfDomain { .. }));
    let other = Sequence { modulation_hz: vec![20e6], ..Sequence::default() };
    assert!(matches!(
        refused(other.camera(), stages(1), Limits::default()),
        Error::OtherCamera { what: "modulation", .. }
    ));
    assert!(matches!(refused(sequence.camera(), stages(0), Limits::default()), Error::Unwrapping(_)));
    let limits = Limits { longest_gap_s: f64::NAN, ..Limits::default() };
    assert!(matches!(refused(sequence.camera(), stages(1), limits), Error::OutOfDomain { name: "longest_gap_s", .. }));
    let mut unsure = stages(1);
    unsure.unwrap.minimum_confidence = 2.0;
    assert!(matches!(refused(sequence.camera(), unsure, Limits::default()), Error::OutOfDomain { .. }));
    let nothing: [u16; 0] = [];
    let mut processor = processor(&sequence, &calibration);
    assert!(matches!(processor.process(SampleSlice::U16(&nothing), 0.0), Err(Error::Size { .. })));
}
