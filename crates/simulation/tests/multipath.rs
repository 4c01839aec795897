//! Light that bounces once makes ranges too long, more so towards a corner.

use crate::common::{first, fixture, range_error};
use range_image::ComplexFrame;

/// One pixel of the west wall.
struct WallPixel {
    /// Distance from the corner with the south wall, metre.
    distance: f64,
    /// Error of the range, metre.
    error: f64,
    /// Share of light that bounced.
    bounced: f64,
}

fn profile(albedo_factor: f64) -> Vec<WallPixel> {
    let mut spec = fixture("corner_multipath");
    spec.errors.noise = None;
    for object in &mut spec.scene.objects {
        object.albedo *= albedo_factor;
    }
    let (frame, complex) = first(&spec);
    spec.errors.multipath = None;
    let direct = first(&spec).1;
    let error = range_error(&complex, 0, &frame.truth.range);
    let offset = |frame: &ComplexFrame, i: usize| f64::from(frame.channels[0].offset.as_ref().unwrap().as_slice()[i]);
    let truth = &frame.truth;
    let place = |i: usize| {
        let pixel = [(i % truth.range.width()) as f64, (i / truth.range.width()) as f64];
        truth.world_from_camera * spec.camera.geometry.point(pixel, f64::from(truth.range.as_slice()[i]))
    };
    (0..error.len())
        .filter(|i| truth.object.as_slice()[*i] == Some(0))
        .map(|i| WallPixel {
            distance: place(i).y,
            error: error[i],
            bounced: 1.0 - offset(&direct, i) / offset(&complex, i),
        })
        .collect()
}

fn mean_between(profile: &[WallPixel], near_m: f64, far_m: f64, value: fn(&WallPixel) -> f64) -> f64 {
    let inside: Vec<f64> = profile.iter().filter(|p| (near_m..far_m).contains(&p.distance)).map(value).collect();
    assert!(inside.len() > 20, "{} pixels between {near_m} and {far_m} m", inside.len());
    inside.iter().sum::<f64>() / inside.len() as f64
}

#[test]
fn ranges_are_too_long_and_more_so_towards_the_corner() {
    let profile = profile(1.0);
    // Every bounced path is longer than the direct one, and by less than half an interval.
    assert!(profile.iter().all(|pixel| pixel.error > 0.0 && pixel.bounced > 0.0));
    let zones = [(0.0, 0.2), (0.2, 0.5), (0.5, 0.9), (0.9, 1.4), (1.4, 2.2)];
    let share = zones.map(|(near, far)| mean_between(&profile, near, far, |p| p.bounced));
    assert!(share.windows(2).all(|w| w[0] > w[1]), "share of bounced light {share:?}");
    let error = zones.map(|(near, far)| mean_between(&profile, near, far, |p| p.error));
    // Within half a metre the way round by the other wall gets so short that the error falls again, though not to zero.
    assert!(error[2] > error[3] && error[3] > error[4], "mean error {error:?} m");
    assert!(error[0] < error[1] && error[1] < error[2] && error[0] > 0.02, "mean error {error:?} m");
}

#[test]
fn darker_walls_bend_less() {
    let error = |factor: f64| mean_between(&profile(factor), 0.2, 0.9, |p| p.error);
    let (bright, dark) = (error(1.0), error(0.25));
    // The share of bounced light goes with the albedo of the other face: a quarter of it, and a little more of the error,
    // which is the bounced over all light.
    assert!(dark > 0.25 * bright && dark < 0.4 * bright, "{dark} against {bright}");
}
