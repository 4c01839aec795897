//! Mixed pixels of a depth edge whose truth is known.

use crate::common;
use crate::common::{CONTRAST, THREE, median, modulations};
use multipath::{
    ComplexImage, Error, FrequencyResponse, MixedPixelTreatment, MixedPixels, NotSplit, SplitOptions, SplitPixel,
    treat_mixed_pixels,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{ComplexChannel, ComplexFrame, Flags, RangeFrame, Raster};

const WIDTH: usize = 120;
const HEIGHT: usize = 90;
const FOCAL_PX: f64 = 160.0;
/// Rays a side of a pixel.
const RAYS: usize = 16;

/// Range of a plane at `depth_m` on the axis, tilted by the slopes along columns and rows; nothing else bends it.
fn plane(col: f64, row: f64, depth_m: f64, slope: [f64; 2]) -> f64 {
    let x = (col - (WIDTH as f64 - 1.0) / 2.0) / FOCAL_PX;
    let y = (row - (HEIGHT as f64 - 1.0) / 2.0) / FOCAL_PX;
    depth_m * (x * x + y * y + 1.0).sqrt() / (1.0 - slope[0] * x - slope[1] * y)
}

fn near(col: f64, row: f64) -> f64 {
    plane(col, row, 1.6, [0.3, 0.1])
}

fn far(col: f64, row: f64) -> f64 {
    plane(col, row, 2.7, [-0.2, 0.2])
}

/// What the camera sees of an oblique edge, and the share of the nearer surface's light in each pixel.
struct Edge {
    range: RangeFrame,
    image: ComplexFrame,
    share: Raster<f64>,
}

impl Edge {
    /// Pixels that a detector finds: a tenth to nine tenths of each.
    fn mixed(&self) -> Raster<bool> {
        self.share.map(|share| (0.1..0.9).contains(share))
    }
}

/// Amplitudes fall with the square of the range, from 900 at one metre, and are seen with noise of `sigma`.
fn edge(frequencies: &[f64], contrast: &[f64], sigma: f64, seed: u64) -> Edge {
    let mut random = Pcg64::seed_from_u64(seed);
    let modulations = modulations(frequencies);
    let mut planes = vec![(Vec::new(), Vec::new()); frequencies.len()];
    let mut shares = Vec::new();
    for index in 0..WIDTH * HEIGHT {
        let (mut light, mut of_near, mut total) = (vec![[0.0; 2]; frequencies.len()], 0.0, 0.0);
        for ray in 0..RAYS * RAYS {
            let sub = |i: usize| (i as f64 + 0.5) / RAYS as f64 - 0.5;
            let (col, row) = ((index % WIDTH) as f64 + sub(ray % RAYS), (index / WIDTH) as f64 + sub(ray / RAYS));
            let hits_near = col < 50.3 + 0.37 * row;
            let range = if hits_near { near(col, row) } else { far(col, row) };
            let amplitude = 900.0 / (range * range) / (RAYS * RAYS) as f64;
            total += amplitude;
            of_near += if hits_near { amplitude } else { 0.0 };
            for (light, modulation) in light.iter_mut().zip(&modulations) {
                let (sin, cos) = modulation.phase_from_range(range).sin_cos();
                *light = [light[0] + amplitude * cos, light[1] + amplitude * sin];
            }
        }
        shares.push(of_near / total);
        for (((re, im), light), contrast) in planes.iter_mut().zip(&light).zip(contrast) {
            let mut noisy = |value: f64| {
                let noise: f64 = StandardNormal.sample(&mut random);
                (contrast * value + sigma * noise) as f32
            };
            re.push(noisy(light[0]));
            im.push(noisy(light[1]));
        }
    }
    let channels: Vec<ComplexChannel> = modulations
        .into_iter()
        .zip(planes)
        .map(|(modulation, (re, im))| ComplexChannel {
            modulation,
            real: Raster::from_vec(WIDTH, HEIGHT, re).unwrap(),
            imaginary: Raster::from_vec(WIDTH, HEIGHT, im).unwrap(),
            offset: None,
            sigma: Raster::filled(WIDTH, HEIGHT, sigma as f32),
        })
        .collect();
    let flags = Raster::filled(WIDTH, HEIGHT, Flags::empty());
    let first = &channels[0];
    let range = RangeFrame {
        // The lowest frequency, 20 MHz, has an interval of 7.5 m.
        range: first.phase().map(|phase| first.modulation.range_from_phase(f64::from(*phase)) as f32),
        sigma: first.sigma_range(),
        amplitude: first.amplitude(),
        flags: flags.clone(),
    };
    Edge { range, image: ComplexFrame { channels, flags }, share: Raster::from_vec(WIDTH, HEIGHT, shares).unwrap() }
}

fn split(edge: &Edge, with_image: Option<&[f64]>, options: &SplitOptions) -> MixedPixels {
    let mut frame = edge.range.clone();
    let response = FrequencyResponse { contrast: with_image.unwrap_or(&[1.0]).to_vec() };
    let image = ComplexImage { frame: &edge.image, response: &response };
    let image = with_image.map(|_| &image);
    treat_mixed_pixels(&mut frame, &edge.mixed(), image, MixedPixelTreatment::Split, options).unwrap()
}

/// Median error and root mean square of error over sigma.
fn quality(split: &[SplitPixel], error_and_sigma: impl Fn(&SplitPixel) -> (f64, f64)) -> (f64, f64) {
    let pairs: Vec<(f64, f64)> = split.iter().map(error_and_sigma).collect();
    let rms = (pairs.iter().map(|(e, s)| (e / s).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt();
    (median(pairs.iter().map(|(e, _)| e.abs()).collect()), rms)
}

fn foreground(pixel: &SplitPixel) -> (f64, f64) {
    (pixel.foreground.range_m - near(pixel.col as f64, pixel.row as f64), pixel.foreground.sigma_m)
}

fn background(pixel: &SplitPixel) -> (f64, f64) {
    (pixel.background.range_m - far(pixel.col as f64, pixel.row as f64), pixel.background.sigma_m)
}

#[test]
fn an_edge_is_split_into_its_two_surfaces() {
    // Frequencies, whether the complex image is used, and the largest median errors in metre and in share. The noise is
    // 5 mm (near) and 14 mm (far) at 20 MHz; found: 2.4 to 3.0 mm, 3.6 to 8.2 mm, 0.0017 to 0.0051.
    let cases =
        [(3, true, [0.0035, 0.005, 0.0025]), (1, true, [0.004, 0.010, 0.007]), (1, false, [0.004, 0.010, 0.007])];
    for (frequencies, with_image, [near_m, far_m, of_share]) in cases {
        let (mut pixels, mut found, mut shares) = (0, Vec::new(), Vec::new());
        for seed in [1, 2, 3] {
            let edge = edge(&THREE[..frequencies], &CONTRAST[..frequencies], 1.0, seed);
            let options = SplitOptions { modulation_hz: Some(THREE[0]), ..SplitOptions::default() };
            let outcome = split(&edge, with_image.then_some(&CONTRAST[..frequencies]), &options);
            shares.extend(outcome.split.iter().map(|p| {
                (
                    p.foreground.share - edge.share[(p.col, p.row)],
                    p.sigma_share,
                    p.background.share + p.foreground.share,
                )
            }));
            pixels += outcome.pixels;
            found.extend(outcome.split);
        }
        assert!(found.len() * 100 >= pixels * 98 && pixels > 200, "{} of {pixels}", found.len());
        let [near, far] = [quality(&found, foreground), quality(&found, background)];
        let (error, rms): (Vec<f64>, Vec<f64>) = shares.iter().map(|(e, s, _)| (e.abs(), (e / s).powi(2))).unzip();
        let of_share_rms = (rms.iter().sum::<f64>() / rms.len() as f64).sqrt();
        let case = format!(
            "{frequencies} {with_image}: near {near:?} far {far:?} share {} {of_share_rms}",
            median(error.clone())
        );
        assert!(near.0 < near_m && far.0 < far_m && median(error) < of_share, "{case}");
        // Neighbouring pixels share what they are continued from: some 40 independent errors, known to 11 %. The floor
        // is more than these flat surfaces need, so sigmas are rather too large than too small.
        for rms in [near.1, far.1, of_share_rms] {
            assert!((0.4..1.25).contains(&rms), "{case}");
        }
        assert!(shares.iter().all(|(_, _, sum)| (sum - 1.0).abs() < 1e-12));
        assert!(found.iter().all(|p| p.chi_squared.is_some() == (frequencies > 1)));
    }
}

#[test]
fn split_points_carry_their_amplitudes() {
    let edge = edge(&THREE[..1], &CONTRAST[..1], 0.3, 4);
    for with_image in [Some(&CONTRAST[..1]), None] {
        let options = SplitOptions { modulation_hz: Some(THREE[0]), ..SplitOptions::default() };
        for pixel in split(&edge, with_image, &options).split {
            let share = edge.share[(pixel.col, pixel.row)];
            // Amplitude of the surface times the part of the pixel that it fills: share over the sum of both.
            let (near, far) = (near(pixel.col as f64, pixel.row as f64), far(pixel.col as f64, pixel.row as f64));
            let area = share * near * near / (share * near * near + (1.0 - share) * far * far);
            let expected = 900.0 / (near * near) * area;
            // Errors of the share, up to 0.02, of an amplitude of 300.
            assert!((pixel.foreground.amplitude - expected).abs() < 8.0, "{pixel:?} {expected}");
        }
    }
}

#[test]
fn small_phases_are_the_limit_of_a_low_frequency() {
    let edge = edge(&THREE[..1], &CONTRAST[..1], 1.0, 5);
    let with = |modulation_hz| split(&edge, None, &SplitOptions { modulation_hz, ..SplitOptions::default() }).split;
    let (limit, low) = (with(None), with(Some(1e4)));
    assert_eq!(limit.len(), low.len());
    for (a, b) in limit.iter().zip(&low) {
        // Phases of 5e-4 rad: the difference is of their square.
        assert!((a.foreground.share - b.foreground.share).abs() < 1e-6);
        assert!((a.sigma_share / b.sigma_share - 1.0).abs() < 1e-6);
    }
}

#[test]
fn dropping_and_flagging_change_the_mixed_pixels_alone() {
    let edge = edge(&THREE[..1], &CONTRAST[..1], 1.0, 6);
    let mixed = edge.mixed();
    for treatment in [MixedPixelTreatment::Drop, MixedPixelTreatment::Flag, MixedPixelTreatment::Split] {
        let mut frame = edge.range.clone();
        let outcome = treat_mixed_pixels(&mut frame, &mixed, None, treatment, &SplitOptions::default()).unwrap();
        assert_eq!(outcome.pixels, mixed.as_slice().iter().filter(|mixed| **mixed).count());
        assert_eq!(outcome.split.is_empty(), treatment != MixedPixelTreatment::Split);
        for (index, mixed) in mixed.as_slice().iter().enumerate() {
            let dropped = *mixed && treatment == MixedPixelTreatment::Drop;
            let flags = frame.flags.as_slice()[index];
            assert_eq!(flags.contains(Flags::MIXED_PIXEL), *mixed);
            assert_eq!(flags.contains(Flags::NO_DATA), dropped);
            assert_eq!(frame.range.as_slice()[index].is_nan(), dropped);
            assert_eq!(frame.sigma.as_slice()[index].is_nan(), dropped);
            assert!(dropped || frame.range.as_slice()[index].to_bits() == edge.range.range.as_slice()[index].to_bits());
        }
    }
}

/// A row of ranges, of which the fifth pixel from the left is mixed.
fn row(ranges: &[f32]) -> (RangeFrame, Raster<bool>) {
    let width = ranges.len();
    let frame = RangeFrame {
        range: Raster::from_vec(width, 1, ranges.to_vec()).unwrap(),
        sigma: Raster::filled(width, 1, 0.002),
        amplitude: Raster::filled(width, 1, 100.0),
        flags: Raster::filled(width, 1, Flags::empty()),
    };
    (frame, Raster::from_fn(width, 1, |col, _| col == 4))
}

#[test]
fn what_is_not_split_says_why() {
    let reason = |ranges: &[f32]| {
        let (mut frame, mixed) = row(ranges);
        let options = SplitOptions::default();
        let outcome = treat_mixed_pixels(&mut frame, &mixed, None, MixedPixelTreatment::Split, &options).unwrap();
        outcome.not_split.first().map(|(_, _, reason)| *reason)
    };
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 2.0, 2.0]), None);
    // Only the two pixels next to it on one side: their slope is not known, but their range is.
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0]), None);
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, 2.6, 2.0, 2.0, 2.0, 2.0]), Some(NotSplit::OneSurface));
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, 1.001, 2.0, 2.0, 2.0, 2.0]), Some(NotSplit::OneSurface));
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]), Some(NotSplit::SameSurface));
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, f32::NAN, 2.0, 2.0, 2.0, 2.0]), Some(NotSplit::NoValue));
    assert_eq!(reason(&[1.0, 1.0, 1.0, 1.0, 1.5]), Some(NotSplit::SurfacesUnknown));
    let holes = [1.0, f32::NAN, f32::NAN, f32::NAN, 1.5, 2.0, 2.0, 2.0, 2.0];
    assert_eq!(reason(&holes), Some(NotSplit::SurfacesUnknown));
}

#[test]
fn light_of_a_third_surface_is_not_explained() {
    let mut edge = edge(&THREE, &CONTRAST, 1.0, 7);
    for channel in &mut edge.image.channels {
        let (sin, cos) = channel.modulation.phase_from_range(4.4).sin_cos();
        channel.real.as_mut_slice().iter_mut().for_each(|re| *re += (40.0 * cos) as f32);
        channel.imaginary.as_mut_slice().iter_mut().for_each(|im| *im += (40.0 * sin) as f32);
    }
    let outcome = split(&edge, Some(&CONTRAST), &SplitOptions::default());
    assert!(outcome.split.is_empty(), "{} split", outcome.split.len());
    let not_explained = outcome.not_split.iter().filter(|(_, _, reason)| *reason == NotSplit::NotExplained).count();
    assert!(not_explained * 10 > outcome.pixels * 9, "{not_explained} of {}", outcome.pixels);
}

#[test]
fn hopeless_frames_and_bad_options_are_answered() {
    let (frame, mixed) = row(&[1.0; 9]);
    let run = |mixed: &Raster<bool>, options: SplitOptions| {
        treat_mixed_pixels(&mut frame.clone(), mixed, None, MixedPixelTreatment::Split, &options)
    };
    let default = SplitOptions::default();
    let all = run(&Raster::filled(9, 1, true), default).unwrap();
    assert_eq!((all.pixels, all.split.len(), all.not_split.len()), (9, 0, 9));
    assert!(matches!(run(&Raster::filled(8, 1, true), default), Err(Error::Image(_))));
    assert!(matches!(run(&mixed, SplitOptions { modulation_hz: Some(-1.0), ..default }), Err(Error::Image(_))));
    let other = common::frame([3, 3], &THREE, &CONTRAST, 1.0, 1, |_| vec![(1.0, 1.0)]);
    let response = FrequencyResponse { contrast: CONTRAST.to_vec() };
    let image = ComplexImage { frame: &other, response: &response };
    let refused =
        treat_mixed_pixels(&mut frame.clone(), &mixed, Some(&image), MixedPixelTreatment::Split, &default).unwrap_err();
    assert!(matches!(refused, Error::Image(_)));
    let empty = RangeFrame {
        range: Raster::default(),
        sigma: Raster::default(),
        amplitude: Raster::default(),
        flags: Raster::default(),
    };
    let nothing =
        treat_mixed_pixels(&mut empty.clone(), &Raster::default(), None, MixedPixelTreatment::Split, &default).unwrap();
    assert_eq!(nothing, MixedPixels::default());
}
