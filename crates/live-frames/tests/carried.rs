//! Counts carried from frame to frame.

use live_frames::phase_unwrap::{CombinedPixels, Error, ImageGeometry, SpatialOptions, combine_pixels, unwrap_spatial};
use live_frames::range_image::{ComplexChannel, Modulation, Raster};
use live_frames::{CarriedUnwrapper, CarryOptions, WholeFrame};

use crate::moving_scene::{FOCAL_PX, HEIGHT, Scene, View, WIDTH};

fn channel(view: &View) -> ComplexChannel {
    let part = |of: fn(f32) -> f32| {
        let values = view.phase.as_slice().iter().zip(view.amplitude.as_slice());
        Raster::from_vec(WIDTH, HEIGHT, values.map(|(phase, amplitude)| amplitude * of(*phase)).collect()).unwrap()
    };
    ComplexChannel {
        modulation: Modulation::new(30e6).unwrap(),
        real: part(f32::cos),
        imaginary: part(f32::sin),
        offset: None,
        sigma: Raster::filled(WIDTH, HEIGHT, f32::NAN),
    }
}

fn options() -> SpatialOptions {
    let principal_point_px = [(WIDTH - 1) as f32 / 2.0, (HEIGHT - 1) as f32 / 2.0];
    let geometry = ImageGeometry { principal_distance_px: FOCAL_PX as f32, principal_point_px };
    SpatialOptions { geometry: Some(geometry), ..SpatialOptions::default() }
}

fn right(view: &View, wraps: &Raster<i32>) -> f64 {
    let pixels = wraps.as_slice().iter().zip(view.wraps.as_slice()).zip(view.mixed.as_slice());
    let (mut right, mut all) = (0, 0);
    for ((found, truth), _) in pixels.filter(|(_, mixed)| !**mixed) {
        right += usize::from(found == truth);
        all += 1;
    }
    f64::from(right as u32) / f64::from(all as u32)
}

#[test]
fn whole_frames_are_those_of_the_tree() {
    let view = Scene::random(3).view(1, 0.015);
    let mut carried =
        CarriedUnwrapper::new(options(), CarryOptions { refresh_frames: 3, ..CarryOptions::default() }).unwrap();
    let tree = unwrap_spatial(&view.phase, Some(&view.amplitude), None, &options()).unwrap();
    for number in 0..4 {
        let found = carried.unwrap_next(&channel(&view), &view.phase, &view.amplitude, || None).unwrap();
        let expected = match number {
            0 => Some(WholeFrame::First),
            3 => Some(WholeFrame::Refresh),
            _ => None,
        };
        assert_eq!(found.whole, expected, "frame {number}");
        assert_eq!(carried.wraps(), &tree.wraps, "the same frame has the same counts");
    }
}

#[test]
fn another_scene_is_solved_anew() {
    let [one, other] = [3, 4].map(|seed| Scene::random(seed).view(1, 0.015));
    let mut carried = CarriedUnwrapper::new(options(), CarryOptions::default()).unwrap();
    carried.unwrap_next(&channel(&one), &one.phase, &one.amplitude, || None).unwrap();
    let found = carried.unwrap_next(&channel(&other), &other.phase, &other.amplitude, || None).unwrap();
    assert_eq!(found.whole, Some(WholeFrame::Failed), "{found:?}");
    carried.restart();
    let found = carried.unwrap_next(&channel(&other), &other.phase, &other.amplitude, || None).unwrap();
    assert_eq!(found.whole, Some(WholeFrame::First));
}

#[test]
fn a_wrong_start_is_mended() {
    // The first frame is told that nothing lies beyond one interval.
    let view = Scene::random(3).view(1, 0.015);
    let shifted = SpatialOptions { maximum_wraps: 0, ..options() };
    let mut carried = CarriedUnwrapper::new(shifted, CarryOptions::default()).unwrap();
    carried.unwrap_next(&channel(&view), &view.phase, &view.amplitude, || None).unwrap();
    let before = right(&view, carried.wraps());
    assert!(before < 0.9, "without counts above 0, {before} are right");
    carried.set_options(options()).unwrap();
    let mut mended = 0;
    for _ in 0..9 {
        let found = carried.unwrap_next(&channel(&view), &view.phase, &view.amplitude, || None).unwrap();
        assert_eq!(found.whole, None);
        mended += found.mended;
    }
    let after = right(&view, carried.wraps());
    // What the tree itself is not sure of stays as it was.
    assert!(
        mended > 1000 && after > 0.9 && after > before + 0.05,
        "{before}, then {after} right after {mended} mended"
    );
}

#[test]
fn options_outside_their_domain() {
    for carry in [
        CarryOptions { refresh_frames: 0, ..CarryOptions::default() },
        CarryOptions { check_frames: 0, ..CarryOptions::default() },
        CarryOptions { most_failed: f32::NAN, ..CarryOptions::default() },
    ] {
        assert!(matches!(CarriedUnwrapper::new(options(), carry), Err(Error::OutOfDomain { .. })));
    }
}

#[test]
fn combined_pixels_are_weighted_means() {
    let ranges: [&[f32]; 2] = [&[2.0, f32::NAN, 3.0, 1.0], &[2.1, 4.0, f32::NAN, 3.0]];
    let sigmas: [&[f32]; 2] = [&[0.1, 0.1, f32::NAN, f32::NAN], &[0.2, 0.3, 0.1, 0.0]];
    let [mut range, mut sigma, mut chi] = [[0.0; 4]; 3];
    let out = CombinedPixels { range: &mut range, sigma: &mut sigma, chi_squared: &mut chi };
    combine_pixels(&ranges, &sigmas, out).unwrap();
    // Weights 100 and 25; one known; one range without a deviation; the plain mean of two without.
    let weighted = (2.0 * 100.0 + 2.1 * 25.0) / 125.0;
    assert!((range[0] - weighted).abs() < 1e-6 && (sigma[0] - 125.0_f32.sqrt().recip()).abs() < 1e-7);
    assert!((chi[0] - 0.01 / 0.05).abs() < 1e-5);
    assert!(range[1] == 4.0 && (sigma[1] - 0.3).abs() < 1e-7 && chi[1].is_nan());
    assert!(range[2] == 3.0 && sigma[2].is_nan());
    assert!(range[3] == 2.0 && sigma[3].is_nan() && chi[3].is_nan());
    let out = CombinedPixels { range: &mut range[1..], sigma: &mut sigma, chi_squared: &mut chi };
    assert!(combine_pixels(&ranges, &sigmas, out).is_err());
}
