//! Relative unwrapping by the tree: hard shapes, masks, seeds, bad input.

use std::f32::consts::{PI, TAU};

use phase_unwrap::{Error, KnownWraps, Seed, SpatialOptions, Unwrapped, Unwrapper, unwrap_spatial};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use range_image::Raster;

fn wrap(surface: &Raster<f32>) -> Raster<f32> {
    surface.map(|value| value.rem_euclid(TAU).min(TAU))
}

fn unwrap(phase: &Raster<f32>, mask: Option<&Raster<bool>>) -> Unwrapped {
    unwrap_spatial(phase, None, mask, &SpatialOptions::default()).unwrap()
}

/// Largest difference of the unwrapped phase from the surface after the offset of pixel 0 is taken off.
fn misfit(found: &Unwrapped, phase: &Raster<f32>, surface: &Raster<f32>) -> f32 {
    let unwrapped = |i: usize| phase.as_slice()[i] + TAU * found.wraps.as_slice()[i] as f32;
    let offset = unwrapped(0) - surface.as_slice()[0];
    (0..phase.len()).map(|i| (unwrapped(i) - offset - surface.as_slice()[i]).abs()).fold(0.0, f32::max)
}

/// Rounding of phases up to 1e3 rad in single precision.
const ROUNDING: f32 = 1e-3;

#[test]
fn smooth_hills_come_back() {
    let surface = Raster::from_fn(90, 70, |col, row| {
        let (x, y) = (col as f32 - 40.0, row as f32 - 30.0);
        40.0 * (-(x * x + y * y) / 600.0).exp() + 0.3 * x
    });
    let phase = wrap(&surface);
    let found = unwrap(&phase, None);
    assert!(misfit(&found, &phase, &surface) < ROUNDING);
    assert_eq!(found.wraps.as_slice().iter().min(), Some(&0));
    assert_eq!(found.islands.len(), 1);
    assert!(!found.islands[0].offset_known && found.islands[0].pixels == 90 * 70);
}

#[test]
fn steep_floors_up_to_pi_per_pixel_come_back() {
    // 3.1 rad a pixel: just inside what neighbours can tell.
    for slope in [2.0, 3.1] {
        let surface = Raster::from_fn(50, 40, |col, row| slope * row as f32 + 0.01 * col as f32);
        let phase = wrap(&surface);
        assert!(misfit(&unwrap(&phase, None), &phase, &surface) < ROUNDING, "{slope}");
    }
}

#[test]
fn a_jump_of_exactly_a_cycle_cannot_be_seen_without_amplitude() {
    let surface = Raster::from_fn(40, 30, |col, _| if col < 20 { 1.0 } else { 1.0 + TAU });
    let found = unwrap(&wrap(&surface), None);
    assert!(found.wraps.as_slice().iter().all(|&wraps| wraps == 0));
}

#[test]
fn a_jump_of_exactly_a_cycle_is_seen_by_amplitude() {
    // A card at 1 m before a wall at 6 m, interval 5 m, both of the same albedo; a floor gives the brightness scale.
    let card = |col: usize, row: usize| (30..60).contains(&col) && (20..40).contains(&row);
    let range = Raster::from_fn(90, 80, |col, row| match (card(col, row), row) {
        (true, _) => 1.0_f32,
        (_, 60..) => 6.0 - 0.15 * (row as f32 - 59.0),
        _ => 6.0,
    });
    let phase = range.map(|r| (r / 5.0 * TAU).rem_euclid(TAU));
    let amplitude = range.map(|r| 100.0 / (r * r));
    let found = unwrap_spatial(&phase, Some(&amplitude), None, &SpatialOptions::default()).unwrap();
    for row in 0..80 {
        for col in 0..90 {
            let truth = (range[(col, row)] / 5.0).floor() as i32;
            let sure = found.confidence[(col, row)] >= 0.6;
            assert!(!sure || found.wraps[(col, row)] == truth, "{col} {row}");
        }
    }
    assert!(found.confidence[(45, 30)] > 0.6 && found.confidence[(10, 10)] > 0.6);
}

#[test]
fn islands_are_labelled_and_free_of_each_other() {
    let surface = Raster::from_fn(30, 20, |col, row| 0.7 * col as f32 + 0.2 * row as f32);
    let phase = wrap(&surface);
    // Two halves and one lonely pixel that touches a half by its corner only.
    let mut mask = Raster::from_fn(30, 20, |col, row| col != 15 && !(col < 3 && row < 3));
    mask[(2, 2)] = false;
    mask[(0, 0)] = true;
    let found = unwrap(&phase, Some(&mask));
    assert_eq!(found.islands.len(), 3);
    assert_eq!(found.islands.iter().map(|island| island.pixels).sum::<usize>(), 29 * 20 - 8);
    assert_eq!(found.island[(15, 7)], 0);
    assert_eq!(found.confidence[(15, 7)], 0.0);
    assert_ne!(found.island[(14, 7)], found.island[(16, 7)]);
    assert_ne!(found.island[(0, 0)], found.island[(5, 5)]);
    for island in 1..=3 {
        let pixels = found.island.as_slice().iter().zip(found.wraps.as_slice()).filter(|(label, _)| **label == island);
        assert_eq!(pixels.map(|(_, wraps)| *wraps).min(), Some(0));
    }
}

#[test]
fn a_wire_of_one_pixel_keeps_its_own_slope() {
    // A wire along a row: steep against its surroundings, smooth along itself.
    let mut mask = Raster::filled(60, 9, false);
    (0..60).for_each(|col| mask[(col, 4)] = true);
    let surface = Raster::from_fn(60, 9, |col, _| 0.9 * col as f32);
    let phase = wrap(&surface);
    let found = unwrap(&phase, Some(&mask));
    let unwrapped = |col: usize| phase[(col, 4)] + TAU * found.wraps[(col, 4)] as f32;
    for col in 0..60 {
        assert!((unwrapped(col) - unwrapped(0) - 0.9 * col as f32).abs() < ROUNDING, "{col}");
    }
}

#[test]
fn single_rows_columns_and_pixels_work() {
    for (width, height) in [(1, 1), (1, 50), (50, 1), (2, 2), (3, 1)] {
        let surface = Raster::from_fn(width, height, |col, row| 1.3 * (col + row) as f32);
        let phase = wrap(&surface);
        let found = unwrap(&phase, None);
        assert!(misfit(&found, &phase, &surface) < ROUNDING, "{width} x {height}");
        let amplitude = Raster::filled(width, height, 5.0);
        let found = unwrap_spatial(&phase, Some(&amplitude), None, &SpatialOptions::default()).unwrap();
        // So few pixels of one brightness cannot be sure of anything absolute.
        assert!(!found.islands[0].offset_known, "{width} x {height}");
    }
}

#[test]
fn ties_at_pi_are_consistent() {
    // Steps of exactly pi have no side; the count must not depend on the direction the tree goes.
    let phase = Raster::from_fn(8, 8, |col, row| if (col + row) % 2 == 0 { 0.0 } else { PI });
    let found = unwrap(&phase, None);
    assert!(found.wraps.as_slice().iter().all(|&wraps| wraps == 0));
}

#[test]
fn not_a_number_is_masked() {
    let mut phase = Raster::from_fn(20, 20, |col, _| 0.2 * col as f32);
    phase[(3, 4)] = f32::NAN;
    phase[(5, 6)] = f32::INFINITY;
    let found = unwrap(&phase, None);
    assert_eq!((found.island[(3, 4)], found.island[(5, 6)]), (0, 0));
    assert_eq!(found.islands[0].pixels, 398);
}

#[test]
fn bad_input_gets_a_typed_answer() {
    let options = SpatialOptions::default();
    let phase = Raster::filled(4, 3, 1.0_f32);
    let empty = Raster::filled(0, 3, 0.0_f32);
    assert!(matches!(unwrap_spatial(&empty, None, None, &options), Err(Error::Empty { .. })));
    let masked = Raster::filled(4, 3, false);
    let all_masked = unwrap_spatial(&phase, None, Some(&masked), &options);
    assert!(matches!(all_masked, Err(Error::AllMasked { pixels: 12 })));
    let nan = Raster::filled(4, 3, f32::NAN);
    assert!(matches!(unwrap_spatial(&nan, Some(&phase), None, &options), Err(Error::AllMasked { .. })));
    let small = Raster::filled(3, 3, 1.0_f32);
    assert!(matches!(unwrap_spatial(&phase, Some(&small), None, &options), Err(Error::Raster(_))));
    let mask = Raster::filled(3, 3, true);
    assert!(matches!(unwrap_spatial(&phase, None, Some(&mask), &options), Err(Error::Raster(_))));
    for bad in [
        SpatialOptions { maximum_wraps: 1000, ..options },
        SpatialOptions { minimum_confidence: 1.0, ..options },
        SpatialOptions { amplitude_noise: Some(0.0), ..options },
    ] {
        assert!(matches!(Unwrapper::new(bad), Err(Error::OutOfDomain { .. })), "{bad:?}");
    }
}

#[test]
fn seeds_fix_the_offset_of_their_island() {
    let surface = Raster::from_fn(30, 10, |col, _| 10.0 + 0.5 * col as f32);
    let phase = wrap(&surface);
    let mut unwrapper = Unwrapper::new(SpatialOptions::default()).unwrap();
    let truth = surface.map(|value| (value / TAU).floor() as i32);
    let seeds = [Seed { col: 20, row: 5, wraps: truth[(20, 5)] }];
    let found = unwrapper.unwrap(&phase, None, None, KnownWraps::Seeds(&seeds)).unwrap();
    assert!(found.islands[0].offset_known);
    assert_eq!(found.wraps, truth);
    let known = truth.map(|&wraps| (wraps == 2).then_some(wraps));
    assert_eq!(unwrapper.unwrap(&phase, None, None, KnownWraps::Raster(&known)).unwrap().wraps, truth);
    // Extreme counts saturate instead of overflowing.
    let extreme = [Seed { col: 0, row: 0, wraps: i32::MAX }];
    unwrapper.unwrap(&phase, None, None, KnownWraps::Seeds(&extreme)).unwrap();

    let amplitude = Raster::filled(30, 10, 1.0_f32);
    let mask = Raster::from_fn(30, 10, |col, _| col > 0);
    for (col, row, wraps) in [(30, 0, 0), (0, 5, 0), (4, 4, 77), (4, 4, -1)] {
        let seeds = [Seed { col, row, wraps }];
        let answer = unwrapper.unwrap(&phase, Some(&amplitude), Some(&mask), KnownWraps::Seeds(&seeds));
        assert!(matches!(answer, Err(Error::UnusableSeed { .. })), "{col} {row} {wraps}");
    }
}

#[test]
fn nothing_panics_on_noise() {
    let mut rng = Pcg64::seed_from_u64(9);
    for size in [(17, 13), (64, 64), (5, 200)] {
        let mut random = |scale: f32| Raster::from_fn(size.0, size.1, |_, _| scale * rng.random::<f32>());
        let (phase, mut amplitude) = (random(TAU), random(3.0));
        amplitude[(1, 1)] = 0.0;
        amplitude[(2, 1)] = -4.0;
        amplitude[(3, 1)] = f32::INFINITY;
        let found = unwrap_spatial(&phase, Some(&amplitude), None, &SpatialOptions::default()).unwrap();
        assert!(found.wraps.as_slice().iter().all(|wraps| (0..=2).contains(wraps)));
        assert!(found.confidence.as_slice().iter().all(|c| (0.0..=1.0).contains(c)));
        let sure = found.confidence.as_slice().iter().filter(|c| **c >= 0.6).count();
        // Noise is no surface: hardly a pixel may look sure.
        assert!(sure * 50 < phase.len(), "{sure} of {}", phase.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn unwrapping_keeps_the_phase_and_joins_neighbours(seed in 0_u64..1000) {
        let mut rng = Pcg64::seed_from_u64(seed);
        let (a, b) = (rng.random::<f32>() * 2.0, rng.random::<f32>() * 2.0);
        let surface = Raster::from_fn(31, 17, |col, row| a * col as f32 + b * row as f32);
        let phase = wrap(&surface);
        prop_assert!(misfit(&unwrap(&phase, None), &phase, &surface) < ROUNDING);
    }
}
