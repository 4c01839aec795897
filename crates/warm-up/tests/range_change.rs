//! Mean changes of range from frames, against planted ones.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Flags, RangeFrame, Raster};
use warm_up::{ChangeMeter, ChangeOptions, DriftError, PixelMeans, RangeChange};

const SIZE: [usize; 2] = [16, 12];
const SIGMA_M: f64 = 0.01;
const FRAMES: usize = 60;

/// A slow drift of all pixels by 30 mm.
fn drift(frame: usize) -> f64 {
    0.03 * (-(frame as f64) / 15.0).exp()
}

/// A tilted wall whose right half is twice as noisy.
fn frames(seed: u64) -> Vec<RangeFrame> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut one = |frame: usize| RangeFrame {
        range: Raster::from_fn(SIZE[0], SIZE[1], |col, row| {
            let unit: f64 = StandardNormal.sample(&mut random);
            let sigma = if col < SIZE[0] / 2 { SIGMA_M } else { 2.0 * SIGMA_M };
            (2.0 + 0.05 * row as f64 + drift(frame) + sigma * unit) as f32
        }),
        sigma: Raster::filled(SIZE[0], SIZE[1], f32::NAN),
        amplitude: Raster::filled(SIZE[0], SIZE[1], 100.0),
        flags: Raster::filled(SIZE[0], SIZE[1], Flags::empty()),
    };
    (0..FRAMES).map(&mut one).collect()
}

fn all() -> Raster<bool> {
    Raster::filled(SIZE[0], SIZE[1], true)
}

fn meter(frames: &[RangeFrame], mask: &Raster<bool>, options: &ChangeOptions) -> Result<ChangeMeter, DriftError> {
    let mut means = PixelMeans::new(mask, options)?;
    frames.iter().try_for_each(|frame| means.add(frame))?;
    means.finish()
}

fn changes(frames: &[RangeFrame], options: &ChangeOptions) -> Result<(Vec<RangeChange>, f64), DriftError> {
    let mut meter = meter(frames, &all(), options)?;
    let changes = frames.iter().map(|frame| meter.measure(frame)).collect::<Result<_, _>>()?;
    Ok((changes, meter.moved_share()?))
}

/// Mean square of the errors over their deviations, about their mean, which is the reference's.
fn normalised_square(changes: &[RangeChange]) -> f64 {
    let errors: Vec<f64> = changes.iter().enumerate().map(|(k, change)| change.mean_m - drift(k)).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let square = errors.iter().zip(changes).map(|(error, change)| ((error - mean) / change.sigma_m).powi(2));
    square.sum::<f64>() / (errors.len() as f64 - 1.0)
}

#[test]
fn the_change_of_each_frame_is_the_planted_one() {
    let (changes, moved) = changes(&frames(1), &ChangeOptions::default()).unwrap();
    let square = normalised_square(&changes);
    // χ² of 59 degrees of freedom over 59 has the deviation 0.18: three of them.
    assert!((0.45..1.55).contains(&square), "{square}");
    // 96 pixels of 10 mm and 96 of 20 mm, each weighted by its noise: 10 / √(96 + 24) mm. The noise of a pixel is known
    // to a tenth.
    assert!((changes[0].sigma_m - SIGMA_M / 120.0_f64.sqrt()).abs() < 1e-4, "{}", changes[0].sigma_m);
    assert!(moved < f64::EPSILON, "{moved}");
}

#[test]
fn gross_errors_and_gaps_shift_nothing() {
    let mut frames = frames(2);
    for (k, frame) in frames.iter_mut().enumerate() {
        // Something walks by, one pixel has a gap in one frame, another one has none but two ranges.
        frame.range.as_mut_slice()[k % 100] -= 1.0;
        if k > 1 {
            frame.flags.as_mut_slice()[150].insert(Flags::LOW_AMPLITUDE);
        }
    }
    frames[5].range.as_mut_slice()[170] = f32::NAN;
    let (found, _) = changes(&frames, &ChangeOptions { least_valid_share: 0.9, ..ChangeOptions::default() }).unwrap();
    let square = normalised_square(&found);
    // What walked by raises the noise of the pixels it crossed, but moves no mean.
    assert!((0.4..1.6).contains(&square), "{square}");
    let pixels = meter(&frames, &all(), &ChangeOptions::default()).unwrap().pixels();
    assert_eq!(pixels, 190, "one pixel has no ranges, one a gap in a sixtieth of the frames");
}

#[test]
fn wrapped_ranges_change_as_unwrapped_ones() {
    let interval_m = 2.3;
    let mut wrapped = frames(3);
    for range in wrapped.iter_mut().flat_map(|frame| frame.range.as_mut_slice()) {
        *range = (f64::from(*range)).rem_euclid(interval_m) as f32;
    }
    let options = ChangeOptions { interval_m: Some(interval_m), ..ChangeOptions::default() };
    let (wrapped, plain) = (changes(&wrapped, &options).unwrap().0, changes(&frames(3), &options).unwrap().0);
    for (a, b) in wrapped.iter().zip(&plain) {
        // Ranges are kept in single precision: 2e-7 m of 2 m.
        assert!((a.mean_m - b.mean_m).abs() < 1e-6, "{a:?} {b:?}");
    }
}

#[test]
fn a_scene_that_moves_is_refused() {
    let mut frames = frames(4);
    for (k, frame) in frames.iter_mut().enumerate() {
        for (place, range) in frame.range.as_mut_slice().iter_mut().enumerate() {
            // A door of a third of the image opens.
            *range += if place < 64 { 0.004 * k as f32 } else { 0.0 };
        }
    }
    let error = changes(&frames, &ChangeOptions::default()).unwrap_err();
    assert!(matches!(error, DriftError::SceneMoves { share, .. } if (0.3..0.4).contains(&share)), "{error}");
}

#[test]
fn frames_that_do_not_serve_are_named() {
    let mut other = frames(5);
    other[3] = RangeFrame {
        range: Raster::filled(5, 4, 1.0),
        sigma: Raster::filled(5, 4, 0.01),
        amplitude: Raster::filled(5, 4, 1.0),
        flags: Raster::filled(5, 4, Flags::empty()),
    };
    let error = meter(&other, &all(), &ChangeOptions::default()).unwrap_err();
    assert!(matches!(error, DriftError::SizeDiffers { index: 3, found: [5, 4], .. }), "{error}");
    let mut other = frames(5);
    other[3].sigma = Raster::filled(5, 4, 0.01);
    let error = meter(&other, &all(), &ChangeOptions::default()).unwrap_err();
    assert!(matches!(error, DriftError::Frame { index: 3, .. }), "{error}");
    let nothing = Raster::filled(SIZE[0], SIZE[1], false);
    let error = meter(&frames(5), &nothing, &ChangeOptions::default()).unwrap_err();
    assert!(matches!(error, DriftError::NoPixelsThroughout { pixels: 0, needed: 20 }), "{error}");
    let mut meter = meter(&frames(5), &all(), &ChangeOptions::default()).unwrap();
    let mut empty = frames(5).remove(0);
    empty.range = Raster::filled(SIZE[0], SIZE[1], f32::NAN);
    assert!(matches!(meter.measure(&empty).unwrap_err(), DriftError::EmptyFrame { index: 0 }));
    let options = ChangeOptions { interval_m: Some(0.0), ..ChangeOptions::default() };
    assert!(matches!(PixelMeans::new(&all(), &options).unwrap_err(), DriftError::OutOfDomain { .. }));
}
