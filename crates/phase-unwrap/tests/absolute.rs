//! Absolute wrap counts at one frequency on rendered rooms.

use std::sync::OnceLock;

use crate::common::{FOCAL_PX, HEIGHT, Scene, View, WIDTH};
use phase_unwrap::{ImageGeometry, KnownWraps, Seed, SpatialOptions, Unwrapped, Unwrapper, unwrap_spatial};
use range_image::Raster;

const POSES: u64 = 24;
/// Standard deviation of the phase at 5 m and albedo 0.6: 12 mm; dark corners at 8 m reach ten times that.
const SIGMA_PHASE: f64 = 0.015;

fn geometry() -> ImageGeometry {
    let centre = |size: usize| (size as f32 - 1.0) / 2.0;
    ImageGeometry { principal_distance_px: FOCAL_PX as f32, principal_point_px: [centre(WIDTH), centre(HEIGHT)] }
}

/// Each pose is rendered once for all tests.
fn view(pose: u64) -> &'static View {
    static VIEWS: [OnceLock<View>; POSES as usize] = [const { OnceLock::new() }; POSES as usize];
    VIEWS[pose as usize].get_or_init(|| Scene::random(pose).view(1000 + pose, SIGMA_PHASE))
}

/// Share of the sure pixels that are right, and share of all pixels that are not sure.
fn score(found: &Unwrapped, view: &View, minimum_confidence: f32) -> (f64, f64) {
    let unsure = found.unsure(minimum_confidence);
    let pixels = found.wraps.as_slice().iter().zip(view.wraps.as_slice()).zip(unsure.as_slice());
    let (mut sure, mut right) = (0.0, 0.0);
    for ((found, truth), _) in pixels.filter(|(_, unsure)| !**unsure) {
        sure += 1.0;
        right += f64::from(u8::from(found == truth));
    }
    (right / f64::max(sure, 1.0), 1.0 - sure / (WIDTH * HEIGHT) as f64)
}

struct Summary {
    mean_right: f64,
    good_poses: usize,
    mean_unsure: f64,
}

fn run_poses(name: &str, options: &SpatialOptions) -> Summary {
    let mut unwrapper = Unwrapper::new(*options).unwrap();
    let mut summary = Summary { mean_right: 0.0, good_poses: 0, mean_unsure: 0.0 };
    let mut worst: (f64, f64) = (1.0, 0.0);
    for pose in 0..POSES {
        let view = view(pose);
        let found = unwrapper.unwrap(&view.phase, Some(&view.amplitude), None, KnownWraps::Nothing).unwrap();
        let (right, unsure) = score(&found, view, options.minimum_confidence);
        summary.mean_right += right / POSES as f64;
        summary.mean_unsure += unsure / POSES as f64;
        summary.good_poses += usize::from(right >= 0.995);
        worst = (worst.0.min(right), worst.1.max(unsure));
    }
    println!(
        "{name}: right {:.4} (worst pose {:.4}), poses at 99.5 % or more {}/{POSES}, unsure {:.3} (worst {:.3})",
        summary.mean_right, worst.0, summary.good_poses, summary.mean_unsure, worst.1
    );
    summary
}

#[test]
fn rooms_are_right_where_sure() {
    // Two wraps allowed where one occurs: the search must find that itself.
    let options = SpatialOptions { geometry: Some(geometry()), ..SpatialOptions::default() };
    let summary = run_poses("with ray geometry", &options);
    // Poses below are those where a box's top meets the wall behind at a jump of one cycle to within 20 cm, dark
    // enough by grazing incidence to pass for a piece of wall.
    assert!(summary.mean_right >= 0.995 && summary.good_poses >= 20 && summary.mean_unsure <= 0.08);
}

#[test]
fn rooms_need_no_ray_geometry_when_the_span_is_known() {
    let options = SpatialOptions { maximum_wraps: 1, ..SpatialOptions::default() };
    let summary = run_poses("amplitude and continuity alone, one wrap at most", &options);
    assert!(summary.mean_right >= 0.994 && summary.good_poses >= 18 && summary.mean_unsure <= 0.08);
}

#[test]
fn rooms_without_any_help_say_so_instead_of_guessing() {
    let summary = run_poses("amplitude and continuity alone, two wraps at most", &SpatialOptions::default());
    // Whole scenes may stay unsure; what is sure must be right all the same.
    assert!(summary.mean_right >= 0.994 && summary.mean_unsure <= 0.35);
}

#[test]
fn a_known_brightness_is_used_as_given() {
    // Gain 4000, albedo 0.6 at an interval of 5 m.
    let mut options = SpatialOptions { geometry: Some(geometry()), ..SpatialOptions::default() };
    options.albedo.typical_amplitude_at_interval = Some(96.0);
    let summary = run_poses("with known brightness", &options);
    assert!(summary.mean_right >= 0.995 && summary.good_poses >= 20 && summary.mean_unsure <= 0.08);
}

#[test]
fn amplitude_unit_does_not_matter() {
    let view = view(0);
    let options = SpatialOptions { geometry: Some(geometry()), ..SpatialOptions::default() };
    let unwrap = |amplitude: &Raster<f32>| unwrap_spatial(&view.phase, Some(amplitude), None, &options).unwrap();
    let found = unwrap(&view.amplitude);
    // A power of two scales without rounding; what remains is that of logarithms.
    let scaled = unwrap(&view.amplitude.map(|a| a / 1024.0));
    let differ = found.wraps.as_slice().iter().zip(scaled.wraps.as_slice()).filter(|(a, b)| a != b).count();
    assert!(differ < 10, "{differ} counts differ");
    let ratio = found.typical_amplitude_at_interval.unwrap() / scaled.typical_amplitude_at_interval.unwrap();
    assert!((ratio / 1024.0 - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let options = SpatialOptions { geometry: Some(geometry()), ..SpatialOptions::default() };
    let (one, other) = (view(3), view(5));
    let fresh = unwrap_spatial(&one.phase, Some(&one.amplitude), None, &options).unwrap();
    let mut unwrapper = Unwrapper::new(options).unwrap();
    // Buffers that held another image, in the other mode too, leave no trace.
    unwrapper.unwrap(&other.phase, Some(&other.amplitude), None, KnownWraps::Nothing).unwrap();
    unwrapper.unwrap(&other.phase, None, None, KnownWraps::Nothing).unwrap();
    let mut again = unwrapper.unwrap(&Raster::filled(9, 7, 1.0), None, None, KnownWraps::Nothing).unwrap();
    unwrapper.unwrap_into(&one.phase, Some(&one.amplitude), None, KnownWraps::Nothing, &mut again).unwrap();
    assert_eq!(fresh, again);
}

#[test]
fn a_seed_on_a_segment_overrules_its_brightness() {
    let view = view(1);
    let options = SpatialOptions::default();
    let mut unwrapper = Unwrapper::new(options).unwrap();
    let free = unwrapper.unwrap(&view.phase, Some(&view.amplitude), None, KnownWraps::Nothing).unwrap();
    let (col, row) = (5, 5);
    let other = 1 - free.wraps[(col, row)];
    let seeds = [Seed { col, row, wraps: other }];
    let seeded = unwrapper.unwrap(&view.phase, Some(&view.amplitude), None, KnownWraps::Seeds(&seeds)).unwrap();
    assert_eq!(seeded.wraps[(col, row)], other);
}

#[test]
fn a_previous_frame_settles_the_counts() {
    let view = view(4);
    let known = view.wraps.map(|&wraps| Some(wraps.clamp(0, 2)));
    let mut unwrapper = Unwrapper::new(SpatialOptions::default()).unwrap();
    let found = unwrapper.unwrap(&view.phase, Some(&view.amplitude), None, KnownWraps::Raster(&known)).unwrap();
    let (right, unsure) = score(&found, view, 0.6);
    // Without the previous frame this pose has a box that passes for wall; a segment still has one offset.
    assert!(right > 0.96 && unsure < 0.1, "{right} {unsure}");
}

#[test]
fn no_light_no_opinion() {
    let phase = Raster::from_fn(40, 30, |col, _| 0.1 * col as f32);
    let options = SpatialOptions::default();
    // An amplitude that is nowhere known is none: relative counts.
    let unknown = Raster::filled(40, 30, f32::NAN);
    let found = unwrap_spatial(&phase, Some(&unknown), None, &options).unwrap();
    assert!(!found.islands[0].offset_known && found.typical_amplitude_at_interval.is_none());
    // One wall of even brightness at an unknown gain: nothing tells one count from another.
    let even = Raster::from_fn(40, 30, |col, _| (1.0 / (2.0 + 0.1 * col as f32 / 6.3).powi(2)) * 1.0);
    let found = unwrap_spatial(&Raster::filled(40, 30, 1.0), Some(&even), None, &options).unwrap();
    assert!(!found.islands[0].offset_known, "{:?}", found.islands);
}
