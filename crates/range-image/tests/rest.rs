//! Whether repeated frames are at rest.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{
    ComplexChannel, ComplexFrame, Flags, Modulation, RangeFrame, Raster, RestOptions, RestVerdict, check_rest,
    check_rest_of_ranges,
};

const SIZE: [usize; 2] = [80, 60];
const SIGMA: f64 = 4.0;

/// Frames of amplitudes 100 to 500; `phase_at` gives what pixel and frame add to the phase.
fn complex(count: usize, seed: u64, sigma: f64, phase_at: impl Fn(usize, usize) -> f64) -> Vec<ComplexFrame> {
    let mut random = Pcg64::seed_from_u64(seed);
    let [width, height] = SIZE;
    let mut one = |frame: usize| {
        let mut channel = ComplexChannel {
            modulation: Modulation::new(30e6).unwrap(),
            real: Raster::filled(width, height, 0.0),
            imaginary: Raster::filled(width, height, 0.0),
            offset: None,
            sigma: Raster::filled(width, height, sigma as f32),
        };
        for pixel in 0..width * height {
            let amplitude = 100.0 + 400.0 * pixel as f64 / (width * height) as f64;
            let phase = 1.0 + phase_at(pixel, frame);
            let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
            channel.real.as_mut_slice()[pixel] = (amplitude * phase.cos() + SIGMA * noise()) as f32;
            channel.imaginary.as_mut_slice()[pixel] = (amplitude * phase.sin() + SIGMA * noise()) as f32;
        }
        ComplexFrame { channels: vec![channel], flags: Raster::filled(width, height, Flags::empty()) }
    };
    (0..count).map(&mut one).collect()
}

#[test]
fn noise_alone_is_at_rest() {
    let options = RestOptions { moved_probability: 1e-3, ..RestOptions::default() };
    let moved: usize = (0..20)
        .map(|seed| {
            let rest = check_rest(&complex(5, seed, SIGMA, |_, _| 0.0), &options).unwrap();
            assert_eq!(rest.verdict, RestVerdict::AtRest);
            rest.moved_pixels
        })
        .sum();
    // 96 000 pixels, one in a thousand: 96 with a deviation of 10; four times that.
    assert!((56..136).contains(&moved), "{moved}");
}

#[test]
fn what_moves_is_flagged_and_nothing_else() {
    // The first 100 pixels move by 0.3 rad between frames: at least seven of their sigmas.
    let frames = complex(4, 3, SIGMA, |pixel, frame| if pixel < 100 { 0.3 * (frame % 2) as f64 } else { 0.0 });
    let rest = check_rest(&frames, &RestOptions::default()).unwrap();
    assert_eq!(rest.verdict, RestVerdict::AtRest);
    let mut flags = Raster::filled(SIZE[0], SIZE[1], Flags::empty());
    rest.flag(&mut flags);
    let flagged = |range: std::ops::Range<usize>| {
        flags.as_slice()[range].iter().filter(|flags| flags.contains(Flags::MOTION)).count()
    };
    // The darkest have a step of 30 units against a noise of 4: a noncentrality of 56 against a limit of 28.
    assert!(flagged(0..100) > 90, "{}", flagged(0..100));
    assert!(flagged(100..SIZE[0] * SIZE[1]) < 6, "one in ten thousand of 4700");
    let most = complex(4, 3, SIGMA, |pixel, frame| if pixel > 1000 { 0.3 * (frame % 2) as f64 } else { 0.0 });
    let verdict = check_rest(&most, &RestOptions::default()).unwrap().verdict;
    assert!(matches!(verdict, RestVerdict::SceneMoved { share } if share > 0.7), "{verdict:?}");
}

#[test]
fn a_camera_that_warms_up_is_named() {
    // 1 mrad a frame is a tenth of a pixel's sigma, no pixel can show it.
    let frames = complex(8, 5, SIGMA, |_, frame| 1e-3 * frame as f64);
    let rest = check_rest(&frames, &RestOptions::default()).unwrap();
    assert!(rest.moved_pixels < 10, "{}", rest.moved_pixels);
    let RestVerdict::Drifts { frame, what: "phase", sigmas } = rest.verdict else { panic!("{:?}", rest.verdict) };
    assert!(frame == 0 || frame == 7, "{frame}");
    assert!((0.2..0.5).contains(&sigmas), "{sigmas}");
    for (index, found) in rest.frames.iter().enumerate() {
        let expected = 1e-3 * (index as f64 - 3.5);
        assert!((found.distance - expected).abs() < 4.5 * rest.deviation_sigma, "{index}: {}", found.distance);
    }
    let mut brighter = complex(8, 5, SIGMA, |_, _| 0.0);
    for part in [0, 1] {
        let channel = &mut brighter[4].channels[0];
        let plane = if part == 0 { &mut channel.real } else { &mut channel.imaginary };
        plane.as_mut_slice().iter_mut().for_each(|value| *value *= 1.02);
    }
    let verdict = check_rest(&brighter, &RestOptions::default()).unwrap().verdict;
    assert!(matches!(verdict, RestVerdict::Drifts { frame: 4, what: "amplitude", .. }), "{verdict:?}");
}

#[test]
fn the_common_deviation_is_as_precise_as_it_says() {
    let mut squares = 0.0;
    let runs = 40_u32;
    for seed in 0..runs {
        let rest = check_rest(&complex(3, u64::from(seed) + 50, SIGMA, |_, _| 0.0), &RestOptions::default()).unwrap();
        squares += (rest.frames[1].distance / rest.deviation_sigma).powi(2);
    }
    // The mean of 40 squares has a deviation of 0.22; four times that.
    assert!((squares / f64::from(runs) - 1.0).abs() < 0.9, "{}", squares / f64::from(runs));
}

#[test]
fn ranges_are_tested_in_the_same_way() {
    let mut random = Pcg64::seed_from_u64(2);
    let [width, height] = SIZE;
    let mut one = |frame: usize, sigma: f32, drift: f64| RangeFrame {
        range: Raster::from_fn(width, height, |col, _| {
            let unit: f64 = StandardNormal.sample(&mut random);
            let step = if col < 8 { 0.1 * (frame % 2) as f64 } else { 0.0 };
            (2.0 + 0.01 * unit + step + drift * frame as f64) as f32
        }),
        sigma: Raster::filled(width, height, sigma),
        amplitude: Raster::filled(width, height, 100.0),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    let still: Vec<_> = (0..4).map(|frame| one(frame, 0.01, 0.0)).collect();
    let rest = check_rest_of_ranges(&still, &RestOptions::default()).unwrap();
    assert_eq!(rest.verdict, RestVerdict::AtRest);
    assert!((470..490).contains(&rest.moved_pixels), "8 columns of 60 rows: {}", rest.moved_pixels);
    let warming: Vec<_> = (0..4).map(|frame| one(frame, 0.01, 0.003)).collect();
    let rest = check_rest_of_ranges(&warming, &RestOptions::default()).unwrap();
    assert!(matches!(rest.verdict, RestVerdict::Drifts { what: "range", .. }), "{:?}", rest.verdict);
    let unknown: Vec<_> = (0..4).map(|frame| one(frame, f32::NAN, 0.0)).collect();
    let rest = check_rest_of_ranges(&unknown, &RestOptions::default()).unwrap();
    assert_eq!(rest.verdict, RestVerdict::SigmaUnknown);
    assert!(check_rest_of_ranges(&still[..1], &RestOptions::default()).is_err());
    assert!(check_rest_of_ranges(&still, &RestOptions { moved_probability: 2.0, ..RestOptions::default() }).is_err());
}
