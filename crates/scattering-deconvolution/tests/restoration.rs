//! Restoration of simulated scattering.

use crate::common::{channel, frame, gaussians, range_errors, rough_kernel, scene};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use range_image::{ComplexFrame, Flags};
use scattering_deconvolution::{
    ChannelRow, GridSpacing, Psf, Refinement, RestorationOptions, Restorer, Scatterer, restore,
};

fn every_pixel() -> RestorationOptions {
    RestorationOptions { grid_spacing: GridSpacing::EveryPixel, ..RestorationOptions::default() }
}

fn scatter(psf: &Psf, frame: &mut ComplexFrame) {
    let mut scatterer = Scatterer::new(psf, frame.width(), frame.height()).unwrap();
    for channel in &mut frame.channels {
        scatterer.apply(channel.real.as_mut_slice(), channel.imaginary.as_mut_slice()).unwrap();
    }
}

/// Mean range error before and after, and a text that tells about the case.
fn run(psf: &Psf, size: [usize; 2], options: &RestorationOptions) -> (f64, f64, String) {
    let (range, amplitude) = scene(size[0], size[1]);
    let mut frame = frame(&range, &amplitude);
    scatter(psf, &mut frame);
    let (_, before) = range_errors(&frame.channels[0], &range);
    let summary = restore(&mut frame, psf, options).unwrap()[0];
    let (largest, after) = range_errors(&frame.channels[0], &range);
    (before, after, format!("{size:?}: {before} m before, {after} m after, largest {largest} m, {summary:?}, {psf:?}"))
}

fn psfs(weight: f64) -> [Psf; 5] {
    [
        gaussians(&[(weight, 30.0, 30.0)]),
        gaussians(&[(0.4 * weight, 12.0, 12.0), (0.6 * weight, 50.0, 50.0)]),
        gaussians(&[(weight, 40.0, 15.0)]),
        gaussians(&[(0.2 * weight, 1.5, 1.5), (0.8 * weight, 20.0, 20.0)]),
        rough_kernel(31, 41, weight),
    ]
}

#[test]
fn the_range_error_of_scattering_goes_away() {
    for weight in [0.01, 0.06, 0.15] {
        for psf in psfs(weight) {
            for options in [RestorationOptions::default(), every_pixel()] {
                let (before, after, text) = run(&psf, [176, 144], &options);
                assert!(before > 0.003, "{text}");
                // Three in a thousand remain of 1 % scatter: 1e-5 of the brightest light is 3e-4 of the wall's.
                assert!(after < 0.003 * before, "{text}");
            }
        }
    }
}

#[test]
fn light_lost_over_the_border_needs_the_iteration() {
    let filter = RestorationOptions { refinement: Refinement::FilterOnly, ..every_pixel() };
    let fine = RestorationOptions { tolerance: 1e-6, ..every_pixel() };
    for weight in [0.06, 0.15] {
        let psf = gaussians(&[(weight, 40.0, 40.0)]);
        let (before, filtered, text) = run(&psf, [176, 144], &filter);
        assert!(text.contains("residual: NaN"), "{text}");
        let (_, iterated, text) = run(&psf, [176, 144], &fine);
        // Of light that went out, the share `weight` would have come back: second order.
        assert!(filtered > 0.1 * weight * weight * before && filtered < weight * before, "{filtered} m, {text}");
        assert!(iterated < 0.02 * filtered, "{filtered} m by the filter, {text}");
    }
}

#[test]
fn a_wide_grid_gives_what_every_pixel_gives() {
    for psf in [gaussians(&[(0.1, 3.0, 9.0)]), gaussians(&[(0.05, 11.0, 2.0), (0.05, 60.0, 80.0)])] {
        for size in [[176, 144], [131, 97], [320, 24]] {
            let (before, after, text) = run(&psf, size, &RestorationOptions::default());
            assert!(!text.contains("grid_spacing: [1, 1]"), "{text}");
            assert!(after < 0.003 * before, "{text}");
        }
    }
}

#[test]
fn images_of_any_shape_come_back() {
    let strong = [gaussians(&[(0.15, 4.0, 1.0)]), gaussians(&[(0.9, 5.0, 5.0)]), rough_kernel(301, 7, 0.4)];
    for size in [[1, 1], [1, 53], [53, 1], [2, 2], [31, 37], [97, 89]] {
        for psf in &strong {
            for options in [RestorationOptions::default(), every_pixel()] {
                let pixels = size[0] * size[1];
                let truth: Vec<f32> = (0..pixels).map(|i| ((i * 7919) % 1009) as f32 - 300.0).collect();
                let (mut re, mut im) = (truth.clone(), truth.iter().rev().copied().collect::<Vec<_>>());
                Scatterer::new(psf, size[0], size[1]).unwrap().apply(&mut re, &mut im).unwrap();
                let mut restorer = Restorer::new(psf, size[0], size[1], &options).unwrap();
                let summary = restorer.restore_planes(&mut re, &mut im).unwrap();
                let largest = re.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                // Values up to 700 times the tolerance of 1e-5; a wide grid under white light and strong scatter is
                // ten times less exact.
                let tolerance = if summary.grid_spacing == [1, 1] { 0.02 } else { 0.3 };
                assert!(largest < tolerance, "{size:?}: {largest}, {summary:?}");
            }
        }
    }
}

#[test]
fn without_scattering_every_bit_stays() {
    let (range, amplitude) = scene(60, 50);
    for psf in [gaussians(&[]), gaussians(&[(0.0, 3.0, 3.0)]), rough_kernel(3, 3, 0.0)] {
        let mut restored = frame(&range, &amplitude);
        restored.channels[0].sigma.as_mut_slice().fill(3.0);
        restored.channels[0].real.as_mut_slice()[7] = -0.0;
        let before = restored.clone();
        let summary = restore(&mut restored, &psf, &RestorationOptions::default()).unwrap()[0];
        assert_eq!(restored, before);
        assert_eq!(restored.channels[0].real.as_slice()[7].to_bits(), (-0.0_f32).to_bits());
        assert!((summary.noise_gain - 1.0).abs() < f64::EPSILON && summary.residual.abs() < f64::EPSILON);
    }
}

#[test]
fn each_frequency_is_restored_by_itself() {
    let (range, amplitude) = scene(90, 70);
    let mut whole = frame(&range, &amplitude);
    let mut second = whole.channels[0].clone();
    std::mem::swap(&mut second.real, &mut second.imaginary);
    whole.channels.push(second);
    let truth = whole.clone();
    let psf = gaussians(&[(0.05, 20.0, 20.0)]);
    scatter(&psf, &mut whole);
    assert_eq!(restore(&mut whole, &psf, &RestorationOptions::default()).unwrap().len(), 2);
    for (found, truth) in whole.channels.iter().zip(&truth.channels) {
        for (a, b) in found.real.as_slice().iter().zip(truth.real.as_slice()) {
            // 1e-5 of the brightest light, 2600.
            assert!((a - b).abs() < 0.03, "{a} {b}");
        }
    }
}

#[test]
fn the_same_bits_come_from_any_number_of_threads() {
    let (range, amplitude) = scene(320, 240);
    let run = |threads: usize, psf: &Psf, options: &RestorationOptions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut frame = frame(&range, &amplitude);
            frame.channels[0].sigma.as_mut_slice().copy_from_slice(amplitude.as_slice());
            scatter(psf, &mut frame);
            restore(&mut frame, psf, options).unwrap();
            frame
        })
    };
    for psf in [gaussians(&[(0.06, 1.0, 1.0), (0.06, 30.0, 30.0)]), gaussians(&[(0.06, 30.0, 30.0)])] {
        for options in [RestorationOptions::default(), every_pixel()] {
            assert!(run(1, &psf, &options) == run(4, &psf, &options));
        }
    }
}

#[test]
fn a_restorer_forgets_the_image_before() {
    let psf = gaussians(&[(0.06, 5.0, 5.0)]);
    let (range, amplitude) = scene(64, 48);
    let mut restorer = Restorer::new(&psf, 64, 48, &RestorationOptions::default()).unwrap();
    let mut first = frame(&range, &amplitude);
    first.channels[0].sigma.as_mut_slice().fill(2.0);
    let mut again = first.clone();
    restorer.restore_frame(&mut first).unwrap();
    let mut other = channel(64, 48, vec![1e4; 64 * 48], vec![f32::NAN; 64 * 48], 7.0);
    restorer.restore(&mut other).unwrap();
    restorer.restore_frame(&mut again).unwrap();
    assert_eq!(first, again);
}

#[test]
fn rows_are_restored_to_the_bits_of_whole_frames() {
    let (width, height) = (88, 72);
    let (range, amplitude) = scene(width, height);
    for (psf, options, saturated) in [
        (gaussians(&[(0.06, 12.0, 12.0)]), RestorationOptions::default(), false),
        (gaussians(&[(0.06, 12.0, 12.0)]), every_pixel(), false),
        // What is put aside has the whole channel restored at once.
        (gaussians(&[(0.06, 12.0, 12.0)]), RestorationOptions::default(), true),
        // Noise of other pixels counts beside that of the own.
        (gaussians(&[(0.3, 0.7, 0.7)]), RestorationOptions::default(), false),
    ] {
        let mut seen = frame(&range, &amplitude);
        scatter(&psf, &mut seen);
        seen.channels[0].sigma.as_mut_slice().fill(2.0);
        let mut second = seen.channels[0].clone();
        second.real.as_mut_slice().iter_mut().for_each(|value| *value *= 0.5);
        seen.channels.push(second);
        if saturated {
            seen.flags.as_mut_slice()[40 * width + 30] |= Flags::SATURATED;
        }
        let mut whole = seen.clone();
        let mut restorer = Restorer::new(&psf, width, height, &options).unwrap();
        restorer.restore_frame(&mut whole).unwrap();
        // The second time with what the first one left.
        for _ in 0..2 {
            let mut by_rows = seen.clone();
            restorer.find_in_frame(&mut by_rows, |_| ()).unwrap();
            assert_eq!(by_rows == whole, saturated, "rows are left to be restored");
            for (index, channel) in by_rows.channels.iter_mut().enumerate() {
                for row in (0..height).rev() {
                    let [real, imaginary, sigma] = [&mut channel.real, &mut channel.imaginary, &mut channel.sigma]
                        .map(|plane| &mut plane.as_mut_slice()[row * width..(row + 1) * width]);
                    restorer.take_off_row(index, row, ChannelRow { real, imaginary, sigma });
                }
            }
            assert!(by_rows == whole, "{psf:?} {saturated}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(24) })]

    #[test]
    fn scattering_and_restoring_cancel(
        width in 1_usize..70, height in 1_usize..70, weight in 0.0..0.2_f64, across in 0.3..30.0_f64, down in 0.3..30.0_f64
    ) {
        let psf = gaussians(&[(weight, across, down)]);
        let truth: Vec<f32> = (0..width * height).map(|i| 100.0 + (i % 13) as f32).collect();
        let (mut re, mut im) = (truth.clone(), vec![0.0; width * height]);
        Scatterer::new(&psf, width, height).unwrap().apply(&mut re, &mut im).unwrap();
        Restorer::new(&psf, width, height, &RestorationOptions::default()).unwrap().restore_planes(&mut re, &mut im).unwrap();
        for (found, truth) in re.iter().zip(&truth) {
            // 1e-5 of some 130 for the iteration, and 1e-3 of the scattered light, up to 20, for the grid.
            prop_assert!((found - truth).abs() < 0.02, "{found} for {truth}");
        }
    }
}
