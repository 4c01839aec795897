//! A calibration exchanged between two frames.

use live_frames::{Error, Limits, PreparedCalibration, Processor};

use crate::common::{INTERVAL_S, Sequence, stages};
use crate::same_as_stages::{is_same_point, reference};

#[test]
fn the_frame_after_has_the_new_calibration() {
    let sequence = Sequence::default();
    let (first, mut second) = (sequence.calibration(), sequence.calibration());
    for parameter in &mut second.range_models[0].parameters {
        parameter.value += if parameter.name == "d0" { 0.1 } else { 0.0 };
    }
    for parameter in &mut second.parameters {
        parameter.value += if parameter.name == "c" { 0.05 } else { 0.0 };
    }
    second.scattering = None;
    let (camera, stages) = (sequence.camera(), stages(100));
    let mut processor = Processor::new(&camera, &first, stages.clone(), Limits::default()).unwrap();
    let frames = [0, 1].map(|number| sequence.frame(number));
    processor.process(frames[0].raw.samples(), 0.0).unwrap();
    // Made ready on another thread, as one would while frames go on.
    let prepared = std::thread::scope(|scope| {
        let handle = scope.spawn(|| PreparedCalibration::new(&camera, &second, &stages).unwrap());
        handle.join().unwrap()
    });
    processor.set_calibration(prepared).unwrap();
    let found = processor.process(frames[1].raw.samples(), INTERVAL_S).unwrap();
    assert!(found.counts.whole.is_none(), "counts go on over the exchange");
    let (expected, points) = reference(&sequence, &second, &frames[1]);
    // Counts of a pixel in a hundred may differ, since they come from the frame before.
    let same = found.range.as_slice().iter().zip(expected.range.as_slice()).filter(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same.count() as f64 > 0.97 * found.range.len() as f64);
    let alike = |pair: &(&[f32; 3], &[f64; 3])| is_same_point(*pair);
    assert!(found.points.iter().zip(&points).filter(alike).count() as f64 > 0.97 * points.len() as f64);
}

#[test]
fn another_camera_is_refused_and_changes_nothing() {
    let sequence = Sequence::default();
    let mut processor =
        Processor::new(&sequence.camera(), &sequence.calibration(), stages(1), Limits::default()).unwrap();
    let other = Sequence { width: 64, height: 48, ..Sequence::default() };
    let prepared = PreparedCalibration::new(&other.camera(), &other.calibration(), &stages(1)).unwrap();
    assert!(matches!(processor.set_calibration(prepared), Err(Error::OtherCamera { .. })));
    assert!(processor.process(sequence.frame(0).raw.samples(), 0.0).is_ok());
    let refused = PreparedCalibration::new(&sequence.camera(), &other.calibration(), &stages(1));
    assert!(matches!(refused, Err(Error::OtherCamera { what: "size", .. })));
}
