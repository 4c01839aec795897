//! Points of light: centres, covariances, saturation.

use targets::nalgebra::Vector2;
use targets::range_image::Raster;
use targets::{LightOptions, find_lights};

use crate::rendering::{ellipse, noisy, render};

/// A point of light through a lens of Gaussian spread, sampled finely: `height` is about that of its peak.
fn light(centre: [f64; 2], spread_px: f64, height: f64) -> Raster<f32> {
    render(24, 22, 0.0, |col, row| {
        let square = (col - centre[0]).powi(2) + (row - centre[1]).powi(2);
        10.0 + height * (-0.5 * square / (spread_px * spread_px)).exp()
    })
}

#[test]
fn centres_are_within_their_covariances() {
    let (mut squares, mut worst, mut runs) = (0.0, 0.0_f64, 0.0);
    for seed in 0..200 {
        let k = seed as f64;
        let centre = [11.0 + (0.37 * k).fract(), 10.0 + (0.73 * k).fract()];
        let image = noisy(&light(centre, 0.6 + 0.3 * (0.61 * k).fract(), 100.0), 2.0, seed);
        let found = find_lights(&image, &LightOptions::default()).unwrap();
        assert_eq!(found.len(), 1, "seed {seed}");
        let off = Vector2::from(found[0].centre.pixel) - Vector2::from(centre);
        squares += off.dot(&(found[0].centre.covariance.try_inverse().unwrap() * off));
        worst = worst.max(off.norm());
        runs += 1.0;
    }
    println!("normalised squared error {:.3}, worst {worst:.3} px", squares / runs);
    assert!((squares / runs / 2.0 - 1.0).abs() < 0.1 && worst < 0.08);
}

#[test]
fn saturated_lights_rest_on_their_flanks() {
    for (centre, seed) in [([11.3, 10.6], 1), ([10.8, 11.1], 2)] {
        let image = noisy(&light(centre, 1.0, 400.0), 2.0, seed).map(|value| value.min(200.0));
        let options = LightOptions { saturation: Some(200.0), ..LightOptions::default() };
        let found = find_lights(&image, &options).unwrap();
        assert!(found.len() == 1 && found[0].saturated);
        assert!((Vector2::from(found[0].centre.pixel) - Vector2::from(centre)).norm() < 0.05);
    }
}

#[test]
fn discs_edges_and_noise_are_no_lights() {
    let options = LightOptions::default();
    let disc = ellipse([30.0, 20.0], [7.0, 7.0], 0.0);
    let images = [
        noisy(&Raster::filled(176, 144, 100.0), 3.0, 5),
        noisy(&render(60, 40, 0.6, |col, row| 10.0 + 100.0 * disc(col, row)), 1.0, 1),
        noisy(&render(60, 40, 0.6, |col, row| if col + 0.3 * row > 30.0 { 100.0 } else { 10.0 }), 1.0, 1),
    ];
    for image in &images {
        assert!(find_lights(image, &options).unwrap().is_empty());
    }
}

#[test]
fn nothing_panics() {
    let good = light([11.0, 10.0], 0.7, 100.0);
    for image in [
        Raster::filled(0, 0, 1.0),
        Raster::filled(1, 1, 1.0),
        Raster::filled(9, 9, f32::NAN),
        Raster::from_fn(9, 9, |col, row| if (col, row) == (4, 4) { f32::INFINITY } else { 0.0 }),
        good.map(|value| value * 1e36),
        good.map(|value| value * 1e-42),
        good.clone(),
    ] {
        for noise in [None, Some(1e-300), Some(1e300)] {
            for saturation in [None, Some(f64::NEG_INFINITY)] {
                let options =
                    LightOptions { noise, saturation, smallest_height_sigmas: 0.0, ..LightOptions::default() };
                drop(find_lights(&image, &options));
            }
        }
    }
    let refused = LightOptions { spread_px: [2.0, 1.0], ..LightOptions::default() };
    assert!(find_lights(&good, &refused).is_err());
    let refused = LightOptions { noise: Some(f64::NAN), ..LightOptions::default() };
    assert!(find_lights(&good, &refused).is_err());
}
