//! Absolute counts in little light.

use phase_unwrap::{
    Error, ImageGeometry, NoisyMethod, NoisyOptions, PhaseNoise, SpatialOptions, unwrap_noisy_absolute, unwrap_spatial,
};
use range_image::Raster;

use crate::common::{FOCAL_PX, HEIGHT, Scene, View, WIDTH};

/// Share of the right counts, of the sure ones among all, and of the right among the sure.
fn score(wraps: &Raster<i32>, confidence: &Raster<f32>, view: &View) -> [f64; 3] {
    let (mut right, mut sure, mut both, mut all) = (0.0, 0.0, 0.0, 0.0);
    for (index, truth) in view.wraps.as_slice().iter().enumerate() {
        let ok = f64::from(u8::from(wraps.as_slice()[index] == *truth));
        let confident = f64::from(u8::from(confidence.as_slice()[index] >= 0.6));
        (right, sure, both, all) = (right + ok, sure + confident, both + ok * confident, all + 1.0);
    }
    [right / all, sure / all, both / sure]
}

/// Means over four rooms of what the tree by amplitudes gives, and the choice.
fn rooms(sigma: f64, poses: std::ops::Range<u64>) -> [[f64; 3]; 2] {
    let geometry = ImageGeometry {
        principal_distance_px: FOCAL_PX as f32,
        principal_point_px: [0.5 * (WIDTH as f32 - 1.0), 0.5 * (HEIGHT as f32 - 1.0)],
    };
    let spatial = SpatialOptions { maximum_wraps: 1, geometry: Some(geometry), ..SpatialOptions::default() };
    let options = NoisyOptions { method: NoisyMethod::Auto, spatial, ..NoisyOptions::default() };
    let mut totals = [[0.0; 3]; 2];
    let count = (poses.end - poses.start) as f64;
    for pose in poses {
        let view = Scene::random(pose).view(pose, sigma);
        let tree = unwrap_spatial(&view.phase, Some(&view.amplitude), None, &spatial).unwrap();
        let noise = PhaseNoise::Amplitude(&view.amplitude);
        let auto = unwrap_noisy_absolute(&view.phase, &view.amplitude, noise, None, &options).unwrap();
        assert!(auto.method != NoisyMethod::Tree || auto.unwrapped == tree);
        for (total, found) in totals.iter_mut().zip([&tree, &auto.unwrapped]) {
            for (total, share) in total.iter_mut().zip(score(&found.wraps, &found.confidence, &view)) {
                *total += share / count;
            }
        }
    }
    println!("{sigma} rad at 5 m: right, sure, right among the sure: tree {:.4?}, auto {:.4?}", totals[0], totals[1]);
    totals
}

/// Rooms that had no say in the method: the share of noisy pixels from which the filter is used was seen on the rooms 201 to 208.
#[test]
fn little_light_keeps_the_counts_of_rooms() {
    let [tree, auto] = rooms(0.015, 301..309);
    assert!(auto[0] > tree[0] - 0.01 && auto[2] > 0.99, "{tree:?} {auto:?}");
    for (sigma, gain) in [(0.06, -0.02), (0.1, 0.1), (0.14, 0.1)] {
        let [tree, auto] = rooms(sigma, 301..309);
        assert!(auto[0] > tree[0] + gain && auto[0] > 0.88 && auto[2] > 0.95, "{sigma}: {tree:?} {auto:?}");
    }
}

#[test]
fn every_method_takes_what_has_no_light_or_no_pixels() {
    let run = |phase: &Raster<f32>, amplitude: &Raster<f32>, method| {
        let options = NoisyOptions { method, ..NoisyOptions::default() };
        unwrap_noisy_absolute(phase, amplitude, PhaseNoise::Uniform(0.9), None, &options)
    };
    for method in [NoisyMethod::Tree, NoisyMethod::Filter, NoisyMethod::Cuts, NoisyMethod::Auto] {
        for (width, height) in [(1, 1), (1, 9), (23, 14)] {
            let phase = Raster::from_fn(width, height, |col, row| ((col * 5 + row * 3) % 6) as f32);
            for light in [0.0, 7.0, f32::NAN] {
                let found = run(&phase, &Raster::filled(width, height, light), method).unwrap().unwrapped;
                assert!(found.wraps.as_slice().iter().all(|wraps| (0..=14).contains(wraps)), "{method:?} {light}");
                assert!(found.confidence.as_slice().iter().all(|confidence| (0.0..=1.0).contains(confidence)));
            }
        }
        let nothing = Raster::filled(5, 4, f32::NAN);
        assert!(matches!(run(&nothing, &nothing, method), Err(Error::AllMasked { .. })));
        assert!(matches!(run(&nothing, &Raster::filled(4, 5, 1.0), method), Err(Error::Raster(_))));
    }
}
