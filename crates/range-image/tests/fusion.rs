//! Exposures of one scene fused: never worse than the best of them, more pixels than any of them, blur and saturation told.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Exposure, Flags, Fusion, FusionOptions, Modulation, RangeFrame, Raster, fuse_exposures};

const SIZE: [usize; 2] = [100, 60];
const PIXELS: usize = SIZE[0] * SIZE[1];
const RANGE: f64 = 3.0;
/// Integration times, second.
const TIMES: [f64; 3] = [0.25e-3, 1e-3, 4e-3];
/// Counts.
const FULL: f64 = 40_000.0;

/// Frames of a wall whose amplitude after a millisecond is `light(pixel)`, with ambient light twice as bright and a noise
/// of `0.5 B + 3²` a sample; `error` is what a pixel's range is off by in an exposure.
fn walls(seed: u64, light: impl Fn(usize) -> f64, error: impl Fn(usize, usize) -> f64) -> Vec<RangeFrame> {
    let mut random = Pcg64::seed_from_u64(seed);
    let modulation = Modulation::new(20e6).unwrap();
    let [width, height] = SIZE;
    let mut frame = |exposure: usize| {
        let plane = Raster::filled(width, height, 0.0);
        let mut frame = RangeFrame {
            range: plane.clone(),
            sigma: plane.clone(),
            amplitude: plane,
            flags: Raster::filled(width, height, Flags::empty()),
        };
        for pixel in 0..PIXELS {
            let amplitude = light(pixel) * TIMES[exposure] * 1e3;
            let sigma_z = (0.5 * (0.5 * 2.0 * amplitude + 9.0)).sqrt();
            let phase = modulation.phase_from_range(RANGE + error(pixel, exposure));
            let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
            let z = [amplitude * phase.cos() + sigma_z * noise(), amplitude * phase.sin() + sigma_z * noise()];
            let observed = z[0].hypot(z[1]);
            let angle = z[1].atan2(z[0]).rem_euclid(std::f64::consts::TAU);
            frame.range.as_mut_slice()[pixel] = modulation.range_from_phase(angle) as f32;
            frame.sigma.as_mut_slice()[pixel] = modulation.range_from_phase((sigma_z / observed).min(1.8138)) as f32;
            frame.amplitude.as_mut_slice()[pixel] = observed as f32;
            if 3.0 * amplitude > FULL {
                frame.flags.as_mut_slice()[pixel] = Flags::SATURATED;
                // The tops of the wave are cut off: the phase goes wrong.
                frame.range.as_mut_slice()[pixel] += 0.2;
            }
        }
        frame
    };
    (0..TIMES.len()).map(&mut frame).collect()
}

/// At 20 MHz ratios of signal to noise above five mean sigmas below 24 cm.
fn normal() -> FusionOptions {
    FusionOptions { normal_sigma_m: 7.5 / std::f64::consts::TAU / 5.0, ..FusionOptions::default() }
}

fn fuse(frames: &[RangeFrame], options: &FusionOptions) -> Fusion {
    let exposures: Vec<_> =
        frames.iter().zip(TIMES).map(|(frame, integration_time_s)| Exposure { frame, integration_time_s }).collect();
    fuse_exposures(&exposures, options).unwrap()
}

/// Root mean square error over unflagged pixels, their share, and the root mean square of their sigmas.
fn quality(frame: &RangeFrame) -> [f64; 3] {
    let good = |pixel: &usize| frame.flags.as_slice()[*pixel].is_empty() && frame.range.as_slice()[*pixel].is_finite();
    let pixels: Vec<usize> = (0..PIXELS).filter(good).collect();
    let mean_square =
        |of: &dyn Fn(usize) -> f64| pixels.iter().map(|p| of(*p).powi(2)).sum::<f64>() / pixels.len() as f64;
    let error = mean_square(&|pixel| f64::from(frame.range.as_slice()[pixel]) - RANGE).sqrt();
    let sigma = mean_square(&|pixel| f64::from(frame.sigma.as_slice()[pixel])).sqrt();
    [error, pixels.len() as f64 / PIXELS as f64, sigma]
}

#[test]
fn fusion_is_never_worse_than_the_best_exposure() {
    // From walls that saturate all but the shortest exposure to those in which only the longest sees anything.
    for (seed, light) in
        [(1, 40e3), (2, 10e3), (3, 3e3), (4, 1e3), (5, 100.0), (6, 30.0), (7, 10.0), (8, 4.0), (9, 2.0)]
    {
        let frames = walls(seed, |_| light, |_, _| 0.0);
        let fused = fuse(&frames, &normal());
        let [error, share, sigma] = quality(&fused.frame);
        let usable = frames.iter().map(quality).filter(|[_, share, _]| *share > 0.0);
        let [best, _, best_sigma] = usable.min_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
        println!("light {light}: {error:.4} m, best {best:.4} m, sigma {sigma:.4} and {best_sigma:.4} m");
        // 6000 pixels know a deviation to 0.9 %; three times that, in the ratio of two that share their noise.
        assert!(error < 1.03 * best, "light {light}: {error} m, best exposure {best} m");
        assert!(sigma < 1.03 * best_sigma, "light {light}: {sigma} m, best exposure {best_sigma} m");
        // Above a ratio of signal to noise of some five, sigma is what the ranges scatter by.
        if light > 20.0 {
            assert!((error / sigma - 1.0).abs() < 0.05, "light {light}: {error} m, sigma {sigma} m");
        }
        assert!(share > 0.99, "light {light}: {share}");
    }
}

#[test]
fn a_bias_of_short_exposures_does_not_make_fusion_worse() {
    // What an amplitude-related error leaves: too far by 0.3 to 2 sigmas of the shortest exposure, less in longer ones.
    for (seed, light, bias) in [(91, 1e3, 0.02), (92, 1e3, 0.06), (93, 1e3, 0.12), (94, 3e3, 0.05), (95, 300.0, 0.15)] {
        let frames = walls(seed, |_| light, |_, exposure| bias / [1.0, 2.0, 64.0][exposure]);
        let [error, share, _] = quality(&fuse(&frames, &normal()).frame);
        let [best, _, _] = quality(&frames[2]);
        println!("light {light}, bias {bias} m: {error:.4} m, longest exposure {best:.4} m");
        assert!(error < 1.03 * best && share > 0.99, "bias {bias}: {error} m, longest exposure {best} m, {share}");
    }
}

#[test]
fn more_pixels_are_kept_than_by_any_exposure() {
    let mut frames = walls(11, |pixel| if pixel % SIZE[0] < 50 { 40e3 } else { 10.0 }, |_, _| 0.0);
    for frame in &mut frames {
        for (flags, amplitude) in frame.flags.as_mut_slice().iter_mut().zip(frame.amplitude.as_slice()) {
            flags.set(Flags::LOW_AMPLITUDE, *amplitude < 15.0);
        }
    }
    let fused = fuse(&frames, &FusionOptions::default());
    let [_, share, _] = quality(&fused.frame);
    let shares: Vec<f64> = frames.iter().map(|frame| quality(frame)[1]).collect();
    assert!(share > 0.99 && shares.iter().all(|share| *share < 0.55), "{share}, {shares:?}");
    assert_eq!(fused.used_pixels[0], PIXELS / 2, "the bright half is the shortest exposure's alone");
    // In the unit of the longest exposure, where that is saturated as well.
    let bright = f64::from(fused.frame.amplitude[(10, 10)]);
    assert!((bright / 160e3 - 1.0).abs() < 0.2, "{bright}");
}

#[test]
fn a_long_exposure_that_is_blurred_gives_way() {
    let frames = walls(21, |_| 3e3, |pixel, exposure| if exposure == 2 && pixel % SIZE[0] < 10 { 0.3 } else { 0.0 });
    let fused = fuse(&frames, &FusionOptions::default());
    let moved = |pixel: &usize| fused.frame.flags.as_slice()[*pixel].contains(Flags::MOTION);
    let (blurred, still): (Vec<usize>, Vec<usize>) = (0..PIXELS).partition(|pixel| pixel % SIZE[0] < 10);
    assert_eq!(
        blurred.iter().filter(|pixel| moved(pixel)).count(),
        blurred.len(),
        "0.3 m is nearly ten sigmas of the shortest"
    );
    assert!(still.iter().filter(|pixel| moved(pixel)).count() < 5, "one in ten thousand of 5400");
    for pixel in blurred {
        let (range, sigma) = (fused.frame.range.as_slice()[pixel], fused.frame.sigma.as_slice()[pixel]);
        assert!((f64::from(range) - RANGE).abs() < 5.0 * f64::from(sigma), "{range} m, sigma {sigma} m");
    }
    assert_eq!(fused.contradictory_pixels, fused.frame.flags.as_slice().iter().filter(|f| !f.is_empty()).count());
}

#[test]
fn exposures_at_rest_contradict_each_other_as_often_as_stated() {
    let options = FusionOptions { false_alarm_probability: 0.01, floor_m: 0.0, ..FusionOptions::default() };
    let count = |frames: &[RangeFrame], options: &FusionOptions| fuse(frames, options).contradictory_pixels;
    let alarms: usize = (0..5).map(|seed| count(&walls(30 + seed, |_| 3e3, |_, _| 0.0), &options)).sum();
    // 30 000 pixels, 300 with a deviation of 17; four times that.
    assert!((232..368).contains(&alarms), "{alarms}");
    // The floor covers what calibration leaves in single pixels, 2 cm one way or the other from exposure to exposure, which
    // are good to 8, 15 and 31 mm.
    let biased =
        walls(40, |_| 3e3, |pixel, exposure| exposure as f64 * if pixel.is_multiple_of(2) { 0.02 } else { -0.02 });
    let [bare, covered] = [0.0, 0.02].map(|floor_m| count(&biased, &FusionOptions { floor_m, ..options }));
    assert!(bare > 200 && covered < 60, "{bare} and {covered} of {PIXELS}");
}

#[test]
fn a_pixel_saturated_everywhere_has_no_value() {
    let mut frames = walls(51, |_| 300.0, |_, _| 0.0);
    for frame in &mut frames {
        frame.flags[(3, 4)] = Flags::SATURATED;
        frame.range[(5, 6)] = f32::NAN;
        frame.flags[(5, 6)] = Flags::NO_DATA;
    }
    frames[0].range[(7, 8)] = f32::NAN;
    frames[0].flags[(7, 8)] = Flags::NO_DATA;
    let fused = fuse(&frames, &FusionOptions::default());
    assert_eq!(fused.saturated_pixels, 1);
    for (place, flags) in [((3, 4), Flags::SATURATED | Flags::NO_DATA), ((5, 6), Flags::NO_DATA)] {
        assert!(fused.frame.range[place].is_nan() && fused.frame.sigma[place].is_nan());
        assert_eq!(fused.frame.flags[place], flags);
    }
    assert!(fused.frame.range[(7, 8)].is_finite() && fused.frame.flags[(7, 8)].is_empty());
}

#[test]
fn frames_without_sigma_or_amplitude_are_answered() {
    let mut frames = walls(61, |_| 300.0, |_, _| 0.0);
    let unknown = Raster::filled(SIZE[0], SIZE[1], f32::NAN);
    for frame in &mut frames {
        frame.amplitude = unknown.clone();
    }
    let by_sigma = fuse(&frames, &FusionOptions::default());
    assert!(quality(&by_sigma.frame)[0] < 1.03 * quality(&frames[2])[0]);
    for frame in &mut frames {
        frame.sigma = unknown.clone();
    }
    let longest = fuse(&frames, &FusionOptions::default());
    assert_eq!(longest.frame.range, frames[2].range);
    assert!(longest.frame.sigma.as_slice().iter().all(|sigma| sigma.is_nan()));
    assert!(fuse_exposures(&[], &FusionOptions::default()).is_err());
    let one = |integration_time_s| [Exposure { frame: &frames[0], integration_time_s }];
    assert!(fuse_exposures(&one(0.0), &FusionOptions::default()).is_err());
    assert!(fuse_exposures(&one(1e-3), &FusionOptions { floor_m: f64::NAN, ..FusionOptions::default() }).is_err());
    let other = RangeFrame { sigma: Raster::filled(1, 1, 0.0), ..frames[0].clone() };
    assert!(fuse_exposures(&[Exposure { frame: &other, integration_time_s: 1.0 }], &FusionOptions::default()).is_err());
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let frames = walls(71, |pixel| 2.0 + pixel as f64, |_, _| 0.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let fused = pool.install(|| fuse(&frames, &FusionOptions::default()));
        let bits = |plane: &Raster<f32>| plane.as_slice().iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        (bits(&fused.frame.range), bits(&fused.frame.sigma), fused.frame.flags, fused.used_pixels)
    };
    assert_eq!(run(1), run(3));
}
