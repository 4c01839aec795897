//! Another camera's light in repeated frames and in the samples of one frame, told from noise, motion and drift.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;
use range_image::{
    ComplexFrame, ConsistencyOptions, DemodulationOptions, Flags, InterferenceOptions, InterferenceVerdict, Modulation,
    NoiseModel, Raster, RawFrame, RestOptions, Samples, check_interference, check_rest, check_samples, demodulate,
    tell_interference,
};

const SIZE: [usize; 2] = [80, 60];
const PIXELS: usize = SIZE[0] * SIZE[1];
const STEPS: usize = 4;

/// A second camera: its amplitude for each unit of this one's, and the beat by frame and phase step.
struct Second<'a> {
    ratio: f64,
    beat: &'a dyn Fn(usize, usize) -> f64,
}

fn demodulation() -> DemodulationOptions {
    let noise = NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 3.0 };
    DemodulationOptions { noise, ..DemodulationOptions::default() }
}

/// Samples of amplitudes from 50 to 450 with half as much again of light. The second camera stands aside: its phases run
/// over the image in another way. `shift` moves the phase of a pixel in a frame.
fn raw(seed: u64, frame: usize, second: Option<&Second<'_>>, shift: &dyn Fn(usize, usize) -> f64) -> RawFrame {
    let mut random = Pcg64::seed_from_u64(1000 * seed + frame as u64);
    let mut samples = vec![0.0_f32; STEPS * PIXELS];
    for pixel in 0..PIXELS {
        let (col, row) = ((pixel % SIZE[0]) as f64, (pixel / SIZE[0]) as f64);
        let amplitude = 50.0 + 400.0 * col / SIZE[0] as f64;
        let phase = 1.0 + 0.01 * row + shift(pixel, frame);
        for step in 0..STEPS {
            let theta = std::f64::consts::TAU * step as f64 / STEPS as f64;
            let mut sample = amplitude * (1.5 + (phase + theta).cos());
            if let Some(second) = second {
                let own = second.ratio * amplitude;
                sample += own * (1.5 + (0.05 * col + 0.03 * row + theta + (second.beat)(frame, step)).cos());
            }
            let noise: f64 = StandardNormal.sample(&mut random);
            samples[step * PIXELS + pixel] = (sample + (0.5 * sample + 9.0).sqrt() * noise) as f32;
        }
    }
    RawFrame::new(SIZE[0], SIZE[1], STEPS, vec![Modulation::new(20e6).unwrap()], Samples::F32(samples)).unwrap()
}

fn frames(
    count: usize,
    seed: u64,
    second: Option<&Second<'_>>,
    shift: &dyn Fn(usize, usize) -> f64,
) -> Vec<ComplexFrame> {
    (0..count).map(|frame| demodulate(&raw(seed, frame, second, shift), &demodulation()).unwrap()).collect()
}

const STILL: &dyn Fn(usize, usize) -> f64 = &|_, _| 0.0;

/// A beat that has nothing to do with the one before, the same for all steps of a frame (`within` 0) or not.
fn beat(frame: usize, step: usize, within: f64) -> f64 {
    let uniform = Uniform::new(0.0, std::f64::consts::TAU).unwrap();
    let phase: f64 = uniform.sample(&mut Pcg64::seed_from_u64(frame as u64));
    phase + within * step as f64
}

#[test]
fn noise_alone_is_no_interference() {
    let options = InterferenceOptions::default();
    for seed in 0..10 {
        let found = check_interference(&frames(6, seed, None, STILL), &options).unwrap();
        // The share of the pixels beyond the quantile is what the level says: 1e-4 of 2400.
        assert!(
            matches!(found.verdict, InterferenceVerdict::NotFound { share } if share < 2e-3),
            "{:?}",
            found.verdict
        );
        assert_eq!((found.disturbed_pixels, found.tested_pixels), (0, PIXELS));
    }
    // One in a hundred: 24 of the 2400 bright pixels a run, 240 in ten runs, with a deviation of 16; four times that, and
    // as much for the plane, which follows the noise of the pixels that it was taken from.
    let often = InterferenceOptions { false_alarm_probability: 0.01, ..options };
    let share = |seed| match check_interference(&frames(6, seed, None, STILL), &often).unwrap().verdict {
        InterferenceVerdict::NotFound { share } => share,
        verdict => panic!("{verdict:?}"),
    };
    let mean = (0..10).map(share).sum::<f64>() / 10.0;
    assert!((0.0073..0.0154).contains(&mean), "{mean}");
}

#[test]
fn another_camera_is_found_and_its_pixels_are_flagged() {
    // A beat of 1 rad from step to step averages out to 0.54 of itself: the sum of the four samples has 0.47 of it, and its
    // mirror image 0.26. A ratio that makes up for it is found as well.
    for (within, ratio, least) in [(0.0, 0.15, 0.9), (1.0, 0.28, 0.8)] {
        let second = Second { ratio, beat: &|frame, step| beat(frame, step, within) };
        let set = frames(8, 5, Some(&second), STILL);
        let found = check_interference(&set, &InterferenceOptions::default()).unwrap();
        // All but those in which the beat looks like a phase or an amplitude that the frames have in common: more of them
        // where half of it is a mirror image.
        assert!(
            matches!(found.verdict, InterferenceVerdict::Found { share } if share > least),
            "{within}: {:?}",
            found.verdict
        );
        let rest = check_rest(&set, &RestOptions::default()).unwrap();
        let mut flags = Raster::filled(SIZE[0], SIZE[1], Flags::empty());
        rest.flag(&mut flags);
        assert!(rest.moved_pixels > PIXELS / 2);
        found.flag(&mut flags);
        let count = |flag: Flags| flags.as_slice().iter().filter(|flags| flags.contains(flag)).count();
        assert_eq!(count(Flags::INTERFERENCE), found.disturbed_pixels);
        assert!(count(Flags::MOTION) < PIXELS / 50, "what is explained is no motion: {}", count(Flags::MOTION));
    }
}

#[test]
fn what_moves_or_drifts_is_no_interference() {
    let options = InterferenceOptions::default();
    // An object over a fifth of the image that comes and goes; a drift of all phases by a sigma a frame.
    let object = |pixel: usize, frame: usize| if pixel.is_multiple_of(5) { 0.3 * (frame % 2) as f64 } else { 0.0 };
    let found = check_interference(&frames(8, 6, None, &object), &options).unwrap();
    assert!(matches!(found.verdict, InterferenceVerdict::NotFound { share } if share < 0.25), "{:?}", found.verdict);
    let drift = |_: usize, frame: usize| 0.03 * frame as f64;
    let found = check_interference(&frames(8, 7, None, &drift), &options).unwrap();
    assert!(matches!(found.verdict, InterferenceVerdict::NotFound { share } if share < 0.1), "{:?}", found.verdict);
    // Something that moves away steadily over all of the image, nearer parts faster.
    let slide = |pixel: usize, frame: usize| 0.1 * frame as f64 * (pixel / SIZE[0]) as f64 / SIZE[1] as f64;
    let found = check_interference(&frames(8, 8, None, &slide), &options).unwrap();
    assert!(matches!(found.verdict, InterferenceVerdict::Steady { .. }), "{:?}", found.verdict);
    assert_eq!(found.disturbed_pixels, 0);
}

#[test]
fn too_few_frames_and_unknown_sigmas_are_not_tested() {
    let options = InterferenceOptions::default();
    let mut set = frames(3, 9, None, STILL);
    assert_eq!(check_interference(&set[..2], &options).unwrap().verdict, InterferenceVerdict::NotTested);
    for frame in &mut set {
        frame.channels[0].sigma = Raster::filled(SIZE[0], SIZE[1], f32::NAN);
    }
    assert_eq!(check_interference(&set, &options).unwrap().verdict, InterferenceVerdict::NotTested);
    assert!(check_interference(&[], &options).is_err());
    assert!(check_interference(&set, &InterferenceOptions { least_share: 1.5, ..options }).is_err());
}

#[test]
fn the_samples_of_one_frame_tell_another_camera_from_motion() {
    let check = |raw: &RawFrame| {
        let mut frame = demodulate(raw, &demodulation()).unwrap();
        check_samples(raw, &demodulation(), &ConsistencyOptions::default(), &mut frame.flags).unwrap();
        let share = tell_interference(&mut frame, &InterferenceOptions::default()).unwrap();
        let count = |flag: Flags| frame.flags.as_slice().iter().filter(|flags| flags.contains(flag)).count();
        (share, count(Flags::MOTION), count(Flags::INTERFERENCE))
    };
    let (share, motion, interference) = check(&raw(10, 0, None, STILL));
    assert!(share < 2e-3 && motion < 6 && interference == 0, "{share} {motion} {interference}");
    // The beat goes on from sample to sample: they contradict each other where there is light.
    let second = Second { ratio: 0.3, beat: &|frame, step| beat(frame, step, 2.0) };
    let (share, motion, interference) = check(&raw(10, 0, Some(&second), STILL));
    assert!(share > 0.4 && motion == 0 && interference > PIXELS / 5, "{share} {motion} {interference}");
    // An edge passes a tenth of the pixels between the second sample and the third.
    let still = raw(11, 0, None, STILL);
    let Samples::F32(mut samples) = still.samples().clone() else { panic!("single precision") };
    for pixel in (0..PIXELS).filter(|pixel| pixel.is_multiple_of(10)) {
        for step in [2, 3] {
            samples[step * PIXELS + pixel] *= 0.4;
        }
    }
    let moved = RawFrame::new(SIZE[0], SIZE[1], STEPS, still.modulations().to_vec(), Samples::F32(samples)).unwrap();
    let (share, motion, interference) = check(&moved);
    assert!(share < 0.15 && motion > PIXELS / 20 && interference == 0, "{share} {motion} {interference}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let second = Second { ratio: 0.1, beat: &|frame, step| beat(frame, step, 0.5) };
    let set = frames(5, 12, Some(&second), STILL);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| check_interference(&set, &InterferenceOptions::default()).unwrap())
    };
    assert_eq!(run(1), run(3));
}
