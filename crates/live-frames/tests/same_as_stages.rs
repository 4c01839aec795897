//! The same numbers as the stage functions give that a pipeline runs, pixel by pixel.

use live_frames::camera_model::RayTable;
use live_frames::error_models::InterpolatedModel;
use live_frames::phase_unwrap::{
    ImageGeometry, MultiFrequencyOptions, SpatialOptions, combine_frequencies, combined_interval_m,
    unwrap_multi_frequency, unwrap_spatial,
};
use live_frames::range_image::{ComplexChannel, ComplexFrame, Flags, RangeFrame, Raster, demodulate};
use live_frames::range_io::calibration::Calibration;
use live_frames::{Exposure, Limits, Processor};
use simulation::SimulatedFrame;
use simulation::scattering_deconvolution::{OutsideLightDetector, OutsideLightOptions, RestorationOptions, restore};

use crate::common::{Sequence, stages};

/// A frame through the stage functions, in the order and with the options of a pipeline.
pub fn reference(
    sequence: &Sequence,
    calibration: &Calibration,
    frame: &SimulatedFrame,
) -> (RangeFrame, Vec<[f64; 3]>) {
    let mut options = sequence.camera().demodulation;
    options.noise = calibration.noise.unwrap();
    let mut complex = demodulate(&frame.raw, &options).unwrap();
    if let Some(psf) = &calibration.scattering {
        restore(&mut complex, psf, &RestorationOptions::default()).unwrap();
        let (width, height) = (sequence.width, sequence.height);
        let detector = OutsideLightDetector::new(psf, width, height, &OutsideLightOptions::default()).unwrap();
        for channel in &complex.channels {
            detector.detect(channel, &mut complex.flags).unwrap();
        }
    }
    let (wraps, confidence) = counts(calibration, &complex);
    let camera = calibration.camera().unwrap();
    let set = calibration.model_set().unwrap();
    let models = set.at(frame.integration_time_s).unwrap();
    let mut channels = Vec::new();
    for ((channel, wraps), model) in complex.channels.iter().zip(&wraps).zip(&models) {
        let mut range = channel.phase();
        for (value, wraps) in range.as_mut_slice().iter_mut().zip(wraps.as_slice()) {
            let interval = channel.modulation.ambiguity_interval_m();
            *value = (channel.modulation.range_from_phase(f64::from(*value)) + f64::from(*wraps) * interval) as f32;
        }
        let (sigma, amplitude) = (channel.sigma_range(), channel.amplitude());
        let mut ranges = RangeFrame { range, sigma, amplitude, flags: complex.flags.clone() };
        for (flags, confidence) in ranges.flags.as_mut_slice().iter_mut().zip(confidence.as_slice()) {
            if confidence.is_nan() || f64::from(*confidence) < 0.5 {
                flags.insert(Flags::UNWRAP_UNSURE);
            }
        }
        correct(&mut ranges, model, calibration);
        channels.push(ranges);
    }
    let combined = combine(channels);
    let cloud = RayTable::new(&camera).unwrap().back_project(&combined).unwrap();
    let flags = Raster::from_vec(cloud.width, cloud.height, cloud.flags).unwrap();
    (RangeFrame { flags, ..combined }, cloud.points)
}

fn counts(calibration: &Calibration, complex: &ComplexFrame) -> (Vec<Raster<i32>>, Raster<f32>) {
    let mask = complex.flags.map(|flags| !flags.contains(Flags::NO_DATA));
    let camera = calibration.camera().unwrap();
    if let [channel] = complex.channels.as_slice() {
        let interval = channel.modulation.ambiguity_interval_m();
        let mut sigmas: Vec<f64> = channel.sigma.as_slice().iter().map(|sigma| f64::from(*sigma)).collect();
        let [column, row] = camera.format.pixel_from_image(camera.interior.principal_point_mm);
        let pitch = f64::midpoint(camera.format.pixel_pitch_mm[0], camera.format.pixel_pitch_mm[1]);
        let options = SpatialOptions {
            maximum_wraps: (15.0 / interval) as u16,
            amplitude_noise: Some(statistics::quantile(&mut sigmas, 0.5) as f32).filter(|noise| noise.is_finite()),
            geometry: Some(ImageGeometry {
                principal_distance_px: (camera.interior.principal_distance_mm / pitch) as f32,
                principal_point_px: [column as f32, row as f32],
            }),
            ..SpatialOptions::default()
        };
        let found = unwrap_spatial(&channel.phase(), Some(&channel.amplitude()), Some(&mask), &options).unwrap();
        return (vec![found.wraps], found.confidence);
    }
    let modulations: Vec<_> = complex.channels.iter().map(|channel| channel.modulation).collect();
    let phases: Vec<_> = complex.channels.iter().map(ComplexChannel::phase).collect();
    let sigmas = complex.channels.iter().map(|channel| {
        let systematic = channel.modulation.phase_from_range(0.02) as f32;
        channel.sigma_phase().map(|sigma| sigma.hypot(systematic))
    });
    let sigmas: Vec<_> = sigmas.collect();
    let maximum_range_m = Some(combined_interval_m(&modulations).unwrap().min(15.0));
    let options = MultiFrequencyOptions { maximum_range_m, ..MultiFrequencyOptions::default() };
    let found = unwrap_multi_frequency(&phases, &modulations, Some(&sigmas), Some(&mask), &options).unwrap();
    (found.wraps, found.confidence)
}

fn correct(frame: &mut RangeFrame, model: &InterpolatedModel, calibration: &Calibration) {
    let camera = calibration.camera().unwrap();
    let observed = frame.range.clone();
    let pattern = calibration.fixed_pattern.as_ref();
    model.correct_frame(frame, &camera.format, camera.interior.principal_point_mm, pattern).unwrap();
    let outside = |span: Option<[f64; 2]>, value: f64| span.is_some_and(|[low, high]| value < low || value > high);
    let pixels = observed.as_slice().iter().zip(frame.amplitude.as_slice()).zip(frame.flags.as_mut_slice());
    for ((range, amplitude), flags) in pixels {
        let left_out = outside(calibration.span.range_m, f64::from(*range))
            || outside(calibration.span.amplitude, f64::from(*amplitude));
        if range.is_finite() && left_out {
            flags.insert(Flags::OUTSIDE_SPAN);
        }
    }
}

fn combine(mut channels: Vec<RangeFrame>) -> RangeFrame {
    if channels.len() == 1 {
        return channels.remove(0);
    }
    let ranges: Vec<_> = channels.iter().map(|channel| channel.range.clone()).collect();
    let sigmas: Vec<_> = channels.iter().map(|channel| channel.sigma.clone()).collect();
    let combined = combine_frequencies(&ranges, &sigmas).unwrap();
    let mut flags = channels[0].flags.clone();
    for channel in &channels[1..] {
        for (flags, more) in flags.as_mut_slice().iter_mut().zip(channel.flags.as_slice()) {
            flags.insert(*more);
        }
    }
    let amplitude = channels[0].amplitude.clone();
    RangeFrame { range: combined.range, sigma: combined.sigma, amplitude, flags }
}

fn bits(values: &[f32]) -> Vec<u32> {
    // One pattern for all NaN.
    values.iter().map(|value| if value.is_nan() { u32::MAX } else { value.to_bits() }).collect()
}

/// Whether a point in single precision is one in double precision; a ray, its product and the range are rounded at up to 10 m.
pub fn is_same_point((single, double): (&[f32; 3], &[f64; 3])) -> bool {
    (0..3).all(|i| (f64::from(single[i]) - double[i]).abs() < 1.2e-6 || single[i].is_nan() && double[i].is_nan())
}

/// Compares two frames, all but the points to the bit.
fn check(sequence: &Sequence) {
    let calibration = sequence.calibration();
    let mut processor = Processor::new(&sequence.camera(), &calibration, stages(1), Limits::default()).unwrap();
    for number in [0, 20] {
        let frame = sequence.frame(number);
        let (expected, points) = reference(sequence, &calibration, &frame);
        let exposure = Exposure {
            timestamp_s: number as f64,
            integration_time_s: Some(frame.integration_time_s),
            temperature_c: None,
        };
        let found = processor.process(frame.raw.samples(), exposure).unwrap();
        for (name, found, expected) in [
            ("amplitude", &found.amplitude, &expected.amplitude),
            ("range", &found.range, &expected.range),
            ("sigma", &found.sigma, &expected.sigma),
        ] {
            assert_eq!(bits(found.as_slice()), bits(expected.as_slice()), "{name} of frame {number}");
        }
        assert_eq!(found.flags, expected.flags, "flags of frame {number}");
        assert!(found.points.iter().zip(&points).all(is_same_point), "points of frame {number}");
        assert!(found.flags.as_slice().iter().any(|flags| flags.contains(Flags::OUTSIDE_SPAN)));
        assert!(found.range.as_slice().iter().filter(|range| range.is_finite()).count() > found.range.len() / 2);
    }
}

#[test]
fn one_frequency_and_four_samples() {
    check(&Sequence::default());
}

#[test]
fn one_frequency_and_three_or_five_samples() {
    check(&Sequence { phase_steps: 3, ..Sequence::default() });
    check(&Sequence { phase_steps: 5, width: 101, height: 77, ..Sequence::default() });
}

#[test]
fn two_and_three_frequencies() {
    check(&Sequence { modulation_hz: vec![80e6, 60e6], ..Sequence::default() });
    check(&Sequence { modulation_hz: vec![100e6, 80e6, 20e6], width: 70, ..Sequence::default() });
}

#[test]
fn two_integration_times_are_blended() {
    let sequence = Sequence::default();
    let mut calibration = sequence.calibration();
    let mut longer = calibration.range_models.clone();
    for model in &mut longer {
        model.integration_time_s = 0.004;
        for parameter in &mut model.parameters {
            parameter.value *= if parameter.name == "d0" { 1.5 } else { 1.0 };
        }
    }
    calibration.range_models[0].integration_time_s = 0.001;
    calibration.range_models.extend(longer);
    let mut processor = Processor::new(&sequence.camera(), &calibration, stages(1), Limits::default()).unwrap();
    let frame = sequence.frame(3);
    let (expected, _) = reference(&sequence, &calibration, &frame);
    let exposure =
        Exposure { timestamp_s: 0.0, integration_time_s: Some(frame.integration_time_s), temperature_c: None };
    let found = processor.process(frame.raw.samples(), exposure).unwrap();
    assert_eq!(bits(found.range.as_slice()), bits(expected.range.as_slice()));
    assert_eq!(bits(found.sigma.as_slice()), bits(expected.sigma.as_slice()));
    assert_eq!(found.flags, expected.flags);
}

#[test]
fn the_threads_do_not_matter() {
    let sequence = Sequence { modulation_hz: vec![80e6, 60e6], ..Sequence::default() };
    let frame = sequence.frame(1);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut processor =
                Processor::new(&sequence.camera(), &sequence.calibration(), stages(1), Limits::default()).unwrap();
            processor.process(frame.raw.samples(), 0.0).unwrap().clone()
        })
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(bits(one.range.as_slice()), bits(two.range.as_slice()));
    assert_eq!(bits(one.sigma.as_slice()), bits(two.sigma.as_slice()));
    assert_eq!(one.flags, two.flags);
}
