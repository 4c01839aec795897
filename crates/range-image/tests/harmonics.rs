//! Harmonics of a correlation that is no sine: what they do to the phase, how they are seen, how they are taken off.

use std::f64::consts::{PI, TAU};

use crate::common::{angle_between, modulations};
use range_image::{
    AliasCorrection, DemodulationOptions, Error, HarmonicRatio, PhaseConvention, PhaseSense, RawFrame, Samples,
    demodulate, harmonic_ratio, harmonics,
};

const PIXELS: usize = 720;

/// What a square shutter makes of square light: a triangle with the odd harmonics `1 / m^2`, amplitude 1 of the first.
fn triangle(phase: f64) -> f64 {
    let turn = phase.rem_euclid(TAU);
    (PI / 2.0 - if turn < PI { turn } else { TAU - turn }) * PI / 4.0
}

/// Samples of all phases under a convention: the camera's phase is `sense (phi - offset)`.
fn frame(steps: usize, convention: &PhaseConvention, correlation: impl Fn(f64) -> f64) -> RawFrame {
    let sense = if convention.phase_sense == PhaseSense::Positive { 1.0 } else { -1.0 };
    let mut values = Vec::new();
    for step in 0..steps {
        for pixel in 0..PIXELS {
            let camera = sense * (truth(pixel) - convention.phase_offset_rad);
            values.push((500.0 + 300.0 * correlation(camera + TAU * step as f64 / steps as f64)) as f32);
        }
    }
    RawFrame::new(PIXELS, 1, steps, modulations(1), Samples::F32(values)).unwrap()
}

fn truth(pixel: usize) -> f64 {
    TAU * pixel as f64 / PIXELS as f64
}

fn options(convention: &PhaseConvention) -> DemodulationOptions {
    DemodulationOptions {
        phase_sense: convention.phase_sense,
        phase_offset_rad: convention.phase_offset_rad,
        ..DemodulationOptions::default()
    }
}

/// Errors of the phase of all pixels, and the largest of them.
fn errors(phase: &range_image::Raster<f32>) -> (Vec<f64>, f64) {
    let errors: Vec<_> =
        phase.as_slice().iter().enumerate().map(|(i, p)| angle_between(f64::from(*p), truth(i))).collect();
    let largest = errors.iter().fold(0.0_f64, |largest, error| largest.max(error.abs()));
    (errors, largest)
}

#[test]
fn a_triangle_makes_four_samples_err_with_a_quarter_of_the_interval() {
    let convention = PhaseConvention::default();
    let channel = demodulate(&frame(4, &convention, triangle), &options(&convention)).unwrap().channels.remove(0);
    let (errors, largest) = errors(&channel.phase());
    // The triangle is linear between its corners, so the phase is atan of a quotient of straight lines: at most 0.071.
    assert!((0.06..0.08).contains(&largest), "{largest}");
    for pixel in 0..PIXELS - PIXELS / 4 {
        assert!((errors[pixel] - errors[pixel + PIXELS / 4]).abs() < 1e-5);
    }
    // Twelve samples see the orders 11 and 13: less than 1 / 121 + 1 / 169 and what follows.
    let twelve = demodulate(&frame(12, &convention, triangle), &options(&convention)).unwrap();
    assert!(self::errors(&twelve.channels[0].phase()).1 < 0.02);
}

#[test]
fn harmonics_come_back_under_any_convention() {
    let (second, third) = ((0.05, 0.4), (0.08, -2.0));
    for phase_sense in [PhaseSense::Positive, PhaseSense::Negative] {
        let convention = PhaseConvention { phase_sense, phase_offset_rad: 0.9 };
        let correlation =
            |x: f64| x.cos() + second.0 * (2.0 * x + second.1).cos() + third.0 * (3.0 * x + third.1).cos();
        let raw = frame(8, &convention, correlation);
        let fundamental = demodulate(&raw, &options(&convention)).unwrap().channels.remove(0);
        let images = harmonics(&raw, &options(&convention)).unwrap().remove(0);
        assert_eq!(images.iter().map(|image| image.order).collect::<Vec<_>>(), [2, 3]);
        for (image, (ratio, phase)) in images.iter().zip([second, third]) {
            let found = harmonic_ratio(image, &fundamental).unwrap();
            let sign = if phase_sense == PhaseSense::Positive { 1.0 } else { -1.0 };
            // Samples near 800 are rounded to 3e-5, and the mean over 720 pixels takes most of that away.
            assert!((found.ratio - ratio).abs() < 1e-6, "{found:?}");
            assert!(angle_between(found.phase_rad, sign * phase).abs() < 1e-5, "{found:?}");
        }
    }
}

#[test]
fn known_harmonics_are_taken_off_the_phase_and_the_amplitude() {
    let ratios = [
        HarmonicRatio { order: 3, ratio: 0.06, phase_rad: 0.3 },
        HarmonicRatio { order: 5, ratio: 0.03, phase_rad: -1.0 },
        HarmonicRatio { order: 2, ratio: 0.1, phase_rad: 0.0 },
    ];
    for (phase_sense, phase_offset_rad) in [(PhaseSense::Positive, 0.0), (PhaseSense::Negative, 2.78)] {
        let convention = PhaseConvention { phase_sense, phase_offset_rad };
        let sign = if phase_sense == PhaseSense::Positive { 1.0 } else { -1.0 };
        let correlation = |x: f64| {
            let harmonic =
                |ratio: &HarmonicRatio| ratio.ratio * (ratio.order as f64 * x + sign * ratio.phase_rad).cos();
            x.cos() + ratios.iter().map(harmonic).sum::<f64>()
        };
        for steps in [3, 4, 6] {
            let raw = frame(steps, &convention, correlation);
            let mut channel = demodulate(&raw, &options(&convention)).unwrap().channels.remove(0);
            let before = errors(&channel.phase()).1;
            AliasCorrection::new(steps, &convention, &ratios).unwrap().correct(&mut channel).unwrap();
            let after = errors(&channel.phase()).1;
            assert!(before > 0.025, "{steps} steps: {before}");
            // Linear interpolation in the table, 0.2 x 9 x 3e-7, and samples near 900 in single precision, 1e-6.
            assert!(after < 3e-6, "{steps} steps: {after}");
            let amplitude = channel.amplitude();
            assert!(amplitude.as_slice().iter().all(|amplitude| (amplitude - 300.0).abs() < 2e-3));
        }
    }
}

#[test]
fn harmonics_seen_with_twelve_samples_correct_four() {
    let convention = PhaseConvention::default();
    let many = frame(12, &convention, triangle);
    let fundamental = demodulate(&many, &options(&convention)).unwrap().channels.remove(0);
    let images = harmonics(&many, &options(&convention)).unwrap().remove(0);
    let ratios: Vec<_> = images.iter().map(|image| harmonic_ratio(image, &fundamental).unwrap()).collect();
    let mut channel = demodulate(&frame(4, &convention, triangle), &options(&convention)).unwrap().channels.remove(0);
    let before = errors(&channel.phase()).1;
    AliasCorrection::new(4, &convention, &ratios).unwrap().correct(&mut channel).unwrap();
    let after = errors(&channel.phase()).1;
    // The orders 7 and 9 and beyond, 1 / 49 and 1 / 81, which nobody measured, are left.
    assert!(after < 0.4 * before && after < 0.035, "{before} {after}");
}

#[test]
fn what_means_nothing_is_refused() {
    let convention = PhaseConvention::default();
    let raw = frame(4, &convention, f64::cos);
    assert!(matches!(
        harmonics(&raw, &DemodulationOptions::default()),
        Err(Error::OutOfDomain { name: "phase_steps", .. })
    ));
    let with = |order, ratio, phase_rad| {
        let ratio = HarmonicRatio { order, ratio, phase_rad };
        match AliasCorrection::new(4, &convention, &[ratio]) {
            Err(Error::OutOfDomain { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(with(1, 0.1, 0.0), "order");
    assert_eq!(with(3, -0.1, 0.0), "ratio");
    assert_eq!(with(3, 0.1, f64::NAN), "phase_rad");
    // Too strong to be undone.
    assert_eq!(with(3, 0.3, 0.0), "ratio");
    assert!(AliasCorrection::new(2, &convention, &[]).is_err());
    let dark = frame(8, &convention, |_| f64::NAN);
    let channel = demodulate(&dark, &DemodulationOptions::default()).unwrap().channels.remove(0);
    let image = harmonics(&dark, &DemodulationOptions::default()).unwrap().remove(0).remove(0);
    assert!(matches!(harmonic_ratio(&image, &channel), Err(Error::OutOfDomain { .. })));
    let mut corrected = channel.clone();
    AliasCorrection::new(8, &convention, &[]).unwrap().correct(&mut corrected).unwrap();
    assert!(corrected.real.as_slice().iter().all(|value| value.is_nan()));
}
