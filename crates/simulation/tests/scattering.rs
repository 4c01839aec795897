//! Scattered light is the convolution of the conventions, and restoration takes it off.

use crate::common::{first, largest, plain, quantile, range_error};
use range_image::ComplexFrame;
use scattering_deconvolution::{GaussianTerm, Psf, RestorationOptions, restore};
use simulation::SimulationSpec;

const TERMS: [(f64, f64); 2] = [(0.03, 2.0), (0.05, 6.0)];

fn psf() -> Psf {
    Psf::Gaussians(
        TERMS.iter().map(|(weight, sigma)| GaussianTerm { weight: *weight, sigma_px: [*sigma; 2] }).collect(),
    )
}

/// A room with a very bright ball.
fn bright() -> SimulationSpec {
    let mut spec = plain();
    spec.scene.objects[1].albedo = 15.0;
    spec
}

fn scattered() -> SimulationSpec {
    let mut spec = bright();
    spec.errors.scattering = Some(psf());
    spec
}

/// `plane + psf * plane`, summed pixel by pixel with nothing outside the image.
fn by_summation(plane: &[f32], width: usize) -> Vec<f64> {
    let height = plane.len() / width;
    let gauss = |sigma: f64, d: f64| (-d * d / (2.0 * sigma * sigma)).exp();
    let line = |sigma: f64| (-60..=60).map(|d| gauss(sigma, f64::from(d))).sum::<f64>();
    let at = |col: usize, row: usize| {
        let mut sum = f64::from(plane[row * width + col]);
        for (weight, sigma) in TERMS {
            let norm = weight / line(sigma).powi(2);
            for r in 0..height {
                let across = norm * gauss(sigma, r as f64 - row as f64);
                for c in 0..width {
                    sum += across * gauss(sigma, c as f64 - col as f64) * f64::from(plane[r * width + c]);
                }
            }
        }
        sum
    };
    (0..plane.len()).map(|i| at(i % width, i / width)).collect()
}

#[test]
fn both_parts_of_the_signal_and_the_mean_are_convolved() {
    let (clean, shown) = (first(&bright()).1, first(&scattered()).1);
    let plane = |frame: &ComplexFrame, which: usize| -> Vec<f32> {
        let channel = &frame.channels[0];
        [&channel.real, &channel.imaginary, channel.offset.as_ref().unwrap()][which].as_slice().to_vec()
    };
    for which in 0..3 {
        let (expected, found) = (by_summation(&plane(&clean, which), 48), plane(&shown, which));
        let most = expected.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        for (expected, found) in expected.iter().zip(&found) {
            // The kernel is cut where it no longer matters, and planes are f32.
            assert!((expected - f64::from(*found)).abs() < 1e-5 * most, "plane {which}: {found} for {expected}");
        }
    }
}

#[test]
fn ranges_are_pulled_towards_bright_light() {
    let (frame, complex) = first(&scattered());
    let off = range_error(&complex, 0, &frame.truth.range);
    assert!(quantile(&off, 0.5) > 0.02, "the scattering must matter: {}", quantile(&off, 0.5));
    assert_eq!(frame.truth, first(&bright()).0.truth);
}

#[test]
fn restoration_puts_ranges_back() {
    let (frame, mut complex) = first(&scattered());
    let options = RestorationOptions { tolerance: 1e-7, ..RestorationOptions::default() };
    restore(&mut complex, &psf(), &options).unwrap();
    let left = range_error(&complex, 0, &frame.truth.range);
    // Planes are f32 and the ball is 500 times as bright as the darkest pixel: 500 * 2^-23 rad is 5e-5 m, and the
    // transforms of both directions add a few of these.
    assert!(quantile(&left, 0.5) < 1e-4 && largest(&left) < 1e-3, "{} {}", quantile(&left, 0.5), largest(&left));
}
