//! Flags of a mean: what chance does to single frames does not add up, and what is wrong with the mean is found.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{
    ComplexChannel, ComplexFrame, ConsistencyOptions, DemodulationOptions, Demodulator, Flags, InterferenceOptions,
    Modulation, NoiseModel, RangeFrame, Raster, RawFrame, RestOptions, Samples, average, average_ranges, check_rest,
    check_rest_of_ranges, check_samples, tell_interference,
};

const SIZE: [usize; 2] = [80, 60];
const PIXELS: usize = SIZE[0] * SIZE[1];
const SIGMA: f32 = 4.0;

/// Frames of one pixel at rest with an amplitude of 100, saturated and far off in the first ones.
fn saturated_first(count: usize, saturated: usize) -> Vec<ComplexFrame> {
    let frame = |index: usize| {
        let cut_off = index < saturated;
        let channel = ComplexChannel {
            modulation: Modulation::new(30e6).unwrap(),
            real: Raster::filled(1, 1, if cut_off { 20.0 } else { 100.0 + (index % 2) as f32 }),
            imaginary: Raster::filled(1, 1, 0.0),
            offset: Some(Raster::filled(1, 1, if cut_off { 900.0 } else { 150.0 })),
            sigma: Raster::filled(1, 1, SIGMA),
        };
        let flags = if cut_off { Flags::SATURATED } else { Flags::empty() };
        ComplexFrame { channels: vec![channel], flags: Raster::filled(1, 1, flags) }
    };
    (0..count).map(frame).collect()
}

#[test]
fn saturated_frames_are_left_out_and_flagged_where_they_are_many() {
    for (count, saturated, flagged) in
        [(4, 1, false), (2, 1, true), (16, 1, false), (16, 2, true), (64, 4, true), (64, 3, false)]
    {
        let frames = saturated_first(count, saturated);
        let mean = average(&frames).unwrap();
        let (re, left) = (mean.channels[0].real[(0, 0)], (count - saturated) as f32);
        assert!((100.0..=101.0).contains(&re), "{saturated} of {count}: {re}");
        assert!((mean.channels[0].sigma[(0, 0)] - SIGMA / left.sqrt()).abs() < 1e-5);
        assert!((mean.channels[0].offset.as_ref().unwrap()[(0, 0)] - 150.0).abs() < 1e-4);
        assert_eq!(mean.flags[(0, 0)].contains(Flags::SATURATED), flagged, "{saturated} of {count}");
        if left > 1.0 {
            // What is left out does not count as motion either.
            assert_eq!(check_rest(&frames, &RestOptions::default()).unwrap().moved_pixels, 0);
        }
    }
    let all = average(&saturated_first(5, 5)).unwrap();
    assert_eq!(all.channels[0].real[(0, 0)].to_bits(), 20.0_f32.to_bits());
    assert_eq!(all.flags[(0, 0)], Flags::SATURATED);
}

/// The shift that saturation by noise alone leaves is at most one standard deviation of the mean where it is not flagged.
#[test]
fn what_saturated_frames_bias_is_flagged() {
    let mut random = Pcg64::seed_from_u64(4);
    for (count, limit) in [(16, 1.0), (64, 1.2), (64, 2.5), (256, 2.0), (1000, 2.4)] {
        let (mut sums, mut unflagged) = (0.0, 0_usize);
        for _ in 0..200 {
            let mut frames = saturated_first(count, 0);
            for frame in &mut frames {
                let noise: f64 = StandardNormal.sample(&mut random);
                frame.channels[0].real[(0, 0)] = 100.0 + SIGMA * noise as f32;
                frame.flags[(0, 0)].set(Flags::SATURATED, noise > limit);
            }
            let mean = average(&frames).unwrap();
            if mean.flags[(0, 0)].is_empty() {
                unflagged += 1;
                sums += f64::from((mean.channels[0].real[(0, 0)] - 100.0) / mean.channels[0].sigma[(0, 0)]);
            }
        }
        // A mean over so many errs by one over the root of their number; four times that.
        let bias = sums / unflagged.max(1) as f64;
        assert!(bias.abs() < 1.0 + 4.0 / (unflagged.max(1) as f64).sqrt(), "{count} frames, limit {limit}: {bias}");
    }
}

#[test]
fn other_flags_are_those_of_most_frames() {
    let flagged = |flags: &[Flags]| {
        let mut frames = saturated_first(flags.len(), 0);
        for (frame, flags) in frames.iter_mut().zip(flags) {
            frame.flags[(0, 0)] = *flags;
        }
        average(&frames).unwrap().flags[(0, 0)]
    };
    let (low, none) = (Flags::LOW_AMPLITUDE, Flags::empty());
    assert_eq!(flagged(&[low, none, none]), none);
    assert_eq!(flagged(&[low, none, low]), low);
    assert_eq!(flagged(&[low, none]), none);
    // A frame without a value says nothing, nor does a saturated one.
    assert_eq!(flagged(&[low, low, none, Flags::NO_DATA, Flags::NO_DATA]), low);
    assert_eq!(flagged(&[low, none, low, Flags::SATURATED]), low);
    // A single frame's own reasons to doubt its samples stay until values are tested.
    assert_eq!(flagged(&[Flags::MOTION, none, none, none]), Flags::MOTION);
    let range = |flags: Flags| RangeFrame {
        range: Raster::filled(1, 1, 2.0),
        sigma: Raster::filled(1, 1, 0.01),
        amplitude: Raster::filled(1, 1, 100.0),
        flags: Raster::filled(1, 1, flags),
    };
    let mut off = range(Flags::SATURATED);
    off.range[(0, 0)] = 7.0;
    let mean = average_ranges(&[range(none), range(Flags::MIXED_PIXEL), off, range(none), range(none)]).unwrap();
    assert!((mean.range[(0, 0)] - 2.0).abs() < 1e-6 && mean.flags[(0, 0)] == none, "{mean:?}");
}

/// Samples with amplitudes of 50 to 450, half as much again of light, and the noise that the options state; `shift` moves
/// the phase of a pixel from a step on.
fn sampled(frame: usize, seed: u64, shift: impl Fn(usize, usize) -> f64) -> RawFrame {
    let mut random = Pcg64::seed_from_u64(10_000 * seed + frame as u64);
    let mut samples = vec![0.0_f32; 4 * PIXELS];
    for (index, sample) in samples.iter_mut().enumerate() {
        let (step, pixel) = (index / PIXELS, index % PIXELS);
        let amplitude = 50.0 + 400.0 * (pixel % SIZE[0]) as f64 / SIZE[0] as f64;
        let angle = 1.0 + std::f64::consts::FRAC_PI_2 * step as f64 + shift(pixel, step);
        let light = amplitude * (1.5 + angle.cos());
        let noise: f64 = StandardNormal.sample(&mut random);
        *sample = (light + (0.5 * light + 9.0).sqrt() * noise) as f32;
    }
    RawFrame::new(SIZE[0], SIZE[1], 4, vec![Modulation::new(20e6).unwrap()], Samples::F32(samples)).unwrap()
}

/// A frame on the way that a pipeline takes: demodulated, its samples checked and told from interference.
fn processed(raw: &RawFrame, level: f64) -> ComplexFrame {
    let noise = NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 3.0 };
    let options = DemodulationOptions { noise, ..DemodulationOptions::default() };
    let mut frame = ComplexFrame::empty();
    Demodulator::new(&options).unwrap().demodulate_into(raw, &mut frame).unwrap();
    let check = ConsistencyOptions { false_alarm_probability: level, ..ConsistencyOptions::default() };
    check_samples(raw, &options, &check, &mut frame.flags).unwrap();
    tell_interference(&mut frame, &InterferenceOptions::default()).unwrap();
    frame
}

fn flags_of_mean(frames: &[ComplexFrame], level: f64) -> Raster<Flags> {
    let mut mean = average(frames).unwrap();
    check_rest(frames, &RestOptions { moved_probability: level, ..RestOptions::default() })
        .unwrap()
        .flag(&mut mean.flags);
    mean.flags
}

fn motion(flags: &Raster<Flags>, pixels: std::ops::Range<usize>) -> usize {
    flags.as_slice()[pixels].iter().filter(|flags| flags.intersects(Flags::MOTION | Flags::INTERFERENCE)).count()
}

#[test]
fn a_scene_at_rest_is_flagged_at_the_stated_level_whatever_the_number_of_frames() {
    // At a level of 1 % 48 pixels are expected, with a deviation of 7; four times that, and half as much for the two tests
    // of a pixel, which share what they are made of. Flags of single frames put together would be 188 with 4 frames.
    let level = 0.01;
    for count in [2, 3, 4, 16, 64, 200] {
        let frames: Vec<_> = (0..count).map(|frame| processed(&sampled(frame, 7, |_, _| 0.0), level)).collect();
        let found = motion(&flags_of_mean(&frames, level), 0..PIXELS);
        assert!((14..78).contains(&found), "{count} frames: {found}");
    }
}

#[test]
fn one_frame_that_moves_is_found_where_it_biases_the_mean() {
    // The phase of the first 960 pixels moves by ten of its standard deviations and more in one frame of 64, as a whole or
    // from the third sample on: 1.25 standard deviations of the mean. The first columns are the darkest: sigma 0.12 rad.
    for from in [0, 2] {
        let shift = |frame: usize| {
            move |pixel: usize, step: usize| if frame == 9 && pixel < 960 && step >= from { 1.3 } else { 0.0 }
        };
        let frames: Vec<_> = (0..64).map(|frame| processed(&sampled(frame, 11, shift(frame)), 1e-4)).collect();
        let flags = flags_of_mean(&frames, 1e-4);
        let (found, others) = (motion(&flags, 0..960), motion(&flags, 960..PIXELS));
        assert!(found > if from == 0 { 950 } else { 850 }, "from sample {from} on: {found}");
        assert!(others < 5, "one in ten thousand of 3840: {others}");
    }
}

#[test]
fn samples_that_contradict_each_other_in_most_frames_stay_flagged() {
    // From the third sample on the light comes from elsewhere, in all frames alike: the values do not change.
    let shift = |pixel: usize, step: usize| if pixel < 960 && step >= 2 { 1.3 } else { 0.0 };
    let frames: Vec<_> = (0..16).map(|frame| processed(&sampled(frame, 13, shift), 1e-4)).collect();
    let alone = motion(&frames[0].flags, 0..960);
    let found = motion(&flags_of_mean(&frames, 1e-4), 0..960);
    assert!(found + 20 > alone && alone > 800, "{alone} in a single frame, {found} in the mean");
}

#[test]
fn one_range_of_many_that_is_elsewhere_is_found() {
    let mut random = Pcg64::seed_from_u64(21);
    let mut frame = |index: usize| RangeFrame {
        range: Raster::from_fn(SIZE[0], SIZE[1], |col, _| {
            let unit: f64 = StandardNormal.sample(&mut random);
            // By eight standard deviations, which is one of the mean.
            (2.0 + 0.01 * unit + if col < 8 && index == 30 { 0.08 } else { 0.0 }) as f32
        }),
        sigma: Raster::filled(SIZE[0], SIZE[1], 0.01),
        amplitude: Raster::filled(SIZE[0], SIZE[1], 100.0),
        flags: Raster::filled(SIZE[0], SIZE[1], Flags::empty()),
    };
    let frames: Vec<_> = (0..64).map(&mut frame).collect();
    let rest = check_rest_of_ranges(&frames, &RestOptions::default()).unwrap();
    // 480 pixels; the limit lies at five standard deviations.
    assert!((470..486).contains(&rest.moved_pixels), "{}", rest.moved_pixels);
}
