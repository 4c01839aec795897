//! Discs: centres, their covariances, flags, and images that break what is careless.

use targets::nalgebra::Vector2;
use targets::range_image::Raster;
use targets::{CircleOptions, Error, Polarity, find_circles};

use crate::rendering::{ellipse, noisy, render};

const BRIGHT: CircleOptions = CircleOptions {
    polarity: Polarity::Bright,
    smallest_semi_axis_px: 1.2,
    largest_semi_axis_px: f64::INFINITY,
    largest_axis_ratio: 4.0,
    smallest_contrast_sigmas: 5.0,
    largest_misfit: 0.15,
    saturation: f64::INFINITY,
    noise: None,
};

/// Diameter, tilt, blur: over 200 runs at a contrast of 50 deviations of the noise.
#[test]
fn centres_are_within_their_covariances() {
    let (mut squares, mut runs) = (0.0, 0.0);
    for (diameter, tilt, blur) in
        [(5.0, 0.0, 0.5), (9.0, 60.0, 0.4), (9.0, 0.0, 0.8), (16.0, 60.0, 0.5), (30.0, 45.0, 0.5)]
    {
        let (size, long) = (diameter as usize + 20, 0.5 * diameter);
        let short = long * f64::to_radians(tilt).cos();
        let mut worst: f64 = 0.0;
        for seed in 0..40 {
            let turn = seed as f64;
            let centre = [0.37, 0.73].map(|step: f64| 0.5 * size as f64 + (step * turn).fract());
            let disc = ellipse(centre, [long, short], 0.3 * turn);
            let image = noisy(&render(size, size, blur, |col, row| 20.0 + 100.0 * disc(col, row)), 2.0, seed);
            let found = find_circles(&image, &BRIGHT).unwrap();
            assert_eq!(found.len(), 1, "{diameter} px, {tilt}°, seed {seed}");
            let off = Vector2::from(found[0].centre.pixel) - Vector2::from(centre);
            worst = worst.max(off.norm());
            squares += off.dot(&(found[0].centre.covariance.try_inverse().unwrap() * off));
            runs += 1.0;
        }
        assert!(worst <= 0.065, "{diameter} px, {tilt}°: {worst:.3} px");
    }
    let mean = squares / runs;
    println!("normalised squared error {mean:.3}");
    assert!((mean / 2.0 - 1.0).abs() < 0.1, "{mean:.3}");
}

#[test]
fn axes_are_within_their_covariances() {
    let (mut squares, mut runs) = (Vector2::<f64>::zeros(), 0.0);
    for seed in 0..100 {
        let centre = [20.2 + 0.01 * seed as f64, 20.7];
        let disc = ellipse(centre, [10.0, 6.0], 0.1 * seed as f64);
        let image = noisy(&render(42, 42, 0.6, |col, row| 20.0 + 100.0 * disc(col, row)), 2.0, seed);
        let found = find_circles(&image, &BRIGHT).unwrap()[0];
        for (k, truth) in [10.0, 6.0].into_iter().enumerate() {
            let variance = found.covariance[(k + 2, k + 2)];
            squares[k] += (found.ellipse.semi_axes_px[k] - truth).powi(2) / variance;
        }
        let turned = (found.ellipse.direction_rad - 0.1 * seed as f64).rem_euclid(std::f64::consts::PI);
        let turned = turned.min(std::f64::consts::PI - turned);
        assert!(turned < 5.0 * found.covariance[(4, 4)].sqrt());
        runs += 1.0;
    }
    // A hundred squares of one normal value: their mean deviates by 0.14.
    assert!(squares.iter().all(|sum| (sum / runs - 1.0).abs() < 0.45), "{:?}", squares / runs);
}

/// Light that falls off, holes, any unit, both polarities: a dark disc in the same light has the same centre.
#[test]
fn light_holes_and_units_do_no_harm() {
    let disc = ellipse([40.3, 31.8], [9.0, 6.0], 0.4);
    for (level, contrast) in [(20.0, 100.0), (150.0, -100.0)] {
        for unit in [1e-6, 1.0, 1e5] {
            let light = |col: f64, row: f64| 1.0 - 1e-4 * ((col - 5.0).powi(2) + (row - 5.0).powi(2));
            let clean = render(80, 60, 0.6, |col, row| light(col, row) * (level + contrast * disc(col, row)));
            let mut image = noisy(&clean, 1.0, 7).map(|value| *value * unit as f32);
            for (col, row) in [(35, 30), (36, 30), (49, 34), (60, 20), (61, 21)] {
                image[(col, row)] = f32::NAN;
            }
            let found = find_circles(&image, &CircleOptions::default()).unwrap();
            assert_eq!(found.len(), 1, "{level} {unit}");
            assert!((found[0].contrast / unit).signum() * contrast > 0.0);
            let off = Vector2::from(found[0].centre.pixel) - Vector2::new(40.3, 31.8);
            assert!(off.norm() < 0.05, "{level} {unit}: {off}");
        }
    }
}

#[test]
fn discs_of_a_hundred_pixels_and_of_one_polarity() {
    let disc = ellipse([150.4, 120.9], [90.0, 70.0], 1.0);
    let clean = render(300, 240, 1.0, |col, row| 10.0 + 5.0 * disc(col, row));
    let image = noisy(&clean, 0.2, 3);
    let found = find_circles(&image, &CircleOptions::default()).unwrap();
    assert_eq!(found.len(), 1);
    assert!((Vector2::from(found[0].centre.pixel) - Vector2::new(150.4, 120.9)).norm() < 0.05);
    assert!((found[0].sigma0 - 1.0).abs() < 0.1 && (found[0].blur_px - 1.0).abs() < 0.1);
    let none = CircleOptions { polarity: Polarity::Dark, ..CircleOptions::default() };
    assert!(find_circles(&image, &none).unwrap().is_empty());
}

#[test]
fn what_is_cut_or_saturated_is_flagged() {
    let cut = ellipse([30.0, 3.0], [8.0, 8.0], 0.0);
    let image = noisy(&render(60, 40, 0.5, |col, row| 20.0 + 100.0 * cut(col, row)), 1.0, 1);
    assert!(find_circles(&image, &CircleOptions::default()).unwrap().iter().all(|disc| disc.touches_border));
    let whole = ellipse([30.0, 20.0], [8.0, 8.0], 0.0);
    let image = noisy(&render(60, 40, 0.5, |col, row| 20.0 + 300.0 * whole(col, row)), 1.0, 1);
    let image = image.map(|value| value.min(200.0));
    let found = find_circles(&image, &CircleOptions::default()).unwrap();
    assert!(found.len() == 1 && found[0].saturated && !found[0].touches_border);
    assert!((Vector2::from(found[0].centre.pixel) - Vector2::new(30.0, 20.0)).norm() < 0.05);
}

#[test]
fn squares_and_noise_are_no_discs() {
    let square =
        |half: f64, col: f64, row: f64| f64::from(u8::from((col - 30.0).abs() < half && (row - 20.0).abs() < half));
    for half in [6.0, 10.0, 14.0] {
        let image = noisy(&render(60, 40, 0.5, |col, row| 20.0 + 100.0 * square(half, col, row)), 1.0, 1);
        assert!(find_circles(&image, &CircleOptions::default()).unwrap().is_empty(), "{half}");
    }
    let image = noisy(&Raster::filled(176, 144, 100.0), 3.0, 5);
    assert!(find_circles(&image, &CircleOptions::default()).unwrap().is_empty());
}

#[test]
fn nothing_panics() {
    let disc = ellipse([10.0, 8.0], [4.0, 4.0], 0.0);
    let good = render(20, 16, 0.5, disc);
    let images = [
        Raster::filled(0, 0, 1.0),
        Raster::filled(1, 1, 1.0),
        Raster::filled(1, 50, 1.0),
        Raster::filled(30, 20, 5.0),
        Raster::filled(30, 20, f32::NAN),
        Raster::filled(30, 20, f32::INFINITY),
        Raster::from_fn(30, 20, |col, _| if col % 2 == 0 { f32::INFINITY } else { f32::NEG_INFINITY }),
        Raster::from_fn(30, 20, |col, row| if (col, row) == (5, 5) { f32::MAX } else { f32::MIN }),
        good.map(|value| value * 1e38),
        good.map(|value| value * 1e-42),
        good.clone(),
    ];
    let wild = [
        CircleOptions::default(),
        CircleOptions { noise: Some(1e300), ..CircleOptions::default() },
        CircleOptions { noise: Some(1e-300), smallest_contrast_sigmas: 0.0, ..CircleOptions::default() },
        CircleOptions { smallest_semi_axis_px: 0.0, largest_misfit: f64::INFINITY, ..CircleOptions::default() },
        CircleOptions { largest_axis_ratio: f64::INFINITY, saturation: f64::NEG_INFINITY, ..CircleOptions::default() },
    ];
    for image in &images {
        for options in &wild {
            drop(find_circles(image, options));
        }
    }
    let refused = CircleOptions { largest_axis_ratio: f64::NAN, ..CircleOptions::default() };
    assert!(matches!(find_circles(&good, &refused), Err(Error::Invalid { name: "largest_axis_ratio", .. })));
    for noise in [0.0, -1.0, f64::NAN] {
        let refused = CircleOptions { noise: Some(noise), ..CircleOptions::default() };
        assert!(find_circles(&good, &refused).is_err());
    }
}
