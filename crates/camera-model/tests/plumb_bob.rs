//! `plumb_bob` both ways.
#![cfg(feature = "convert")]

use crate::common::plain_camera;
use camera_model::{Camera, Error, LensDistortion, PlumbBob};
use nalgebra::Point3;
use proptest::prelude::*;

const REAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real");

/// The forward model as the documentation of `OpenCV` writes it; `point` in computer-vision axes.
fn project(model: &PlumbBob, point: [f64; 3]) -> [f64; 2] {
    let [x, y] = [point[0] / point[2], point[1] / point[2]];
    let r2 = x * x + y * y;
    let radial = 1.0 + model.k1 * r2 + model.k2 * r2 * r2 + model.k3 * r2 * r2 * r2;
    let xd = x * radial + 2.0 * model.p1 * x * y + model.p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + model.p1 * (r2 + 2.0 * y * y) + 2.0 * model.p2 * x * y;
    [model.fx * xd + model.cx, model.fy * yd + model.cy]
}

/// Largest distance in pixels between where the camera sees points and where `plumb_bob` puts them, every `step`-th
/// pixel of the image.
fn largest_difference(camera: &Camera, model: &PlumbBob, step: usize) -> f64 {
    let mut largest = 0.0_f64;
    for row in (0..model.height).step_by(step) {
        for col in (0..model.width).step_by(step) {
            let pixel = [col as f64, row as f64];
            let point = camera.point(pixel, 2.0);
            let other = project(model, [point.x, -point.y, -point.z]);
            largest = largest.max((other[0] - pixel[0]).hypot(other[1] - pixel[1]));
        }
    }
    largest
}

/// Both ways, and what is stated against what is measured; the two residuals in pixels.
fn round_trip(model: &PlumbBob) -> [f64; 2] {
    let (camera, there) = Camera::from_plumb_bob(model, 0.02).unwrap();
    let found = largest_difference(&camera, model, 3);
    // The stated figure is taken over a grid that need not hold the worst pixel, and to first order the same distance
    // is measured from the other side.
    assert!(found < 1.1 * there + 1e-9, "stated {there}, found {found}");
    let (again, back) = camera.to_plumb_bob().unwrap();
    assert!(largest_difference(&camera, &again, 3) < 1.05 * back + 1e-9);
    for (name, found, given) in
        [("fx", again.fx, model.fx), ("fy", again.fy, model.fy), ("cx", again.cx, model.cx), ("cy", again.cy, model.cy)]
    {
        assert!((found - given).abs() < 1e-9, "{name}: {found} {given}");
    }
    [there, back]
}

fn tof_camera() -> PlumbBob {
    PlumbBob {
        fx: 365.4,
        fy: 364.8,
        cx: 254.9,
        cy: 205.4,
        k1: 0.0905,
        k2: -0.268,
        p1: 0.0011,
        p2: -0.0007,
        k3: 0.095,
        width: 512,
        height: 424,
    }
}

#[test]
fn a_time_of_flight_camera_both_ways() {
    let [there, back] = round_trip(&tof_camera());
    println!("plumb_bob -> camera {there:.4} px, camera -> plumb_bob {back:.4} px");
    // Neither polynomial is the inverse of the other: with three radial terms each, a quarter of a pixel stays in the
    // corners. Least squares without new weights leaves 0.8 there.
    assert!(there < 0.29 && back < 0.29);
}

#[test]
fn without_a_lens_the_conversion_is_exact() {
    let pinhole = PlumbBob { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0, ..tof_camera() };
    let [there, back] = round_trip(&pinhole);
    // Rounding at some hundred pixels.
    assert!(there < 1e-9 && back < 1e-9, "{there} {back}");
}

#[test]
fn tangential_terms_keep_their_meaning() {
    // Tangential alone and small: to first order the inverse has the same coefficients with the other sign, so what is
    // left is of second order. A wrong sign or a swapped pair would leave all of it, 1.5 pixels.
    let model = PlumbBob { k1: 0.0, k2: 0.0, k3: 0.0, p1: 2e-3, p2: -1e-3, ..tof_camera() };
    let [there, back] = round_trip(&model);
    assert!(there < 0.02 && back < 0.02, "{there} {back}");
    let (camera, _) = Camera::from_plumb_bob(&model, 0.02).unwrap();
    let (again, _) = camera.to_plumb_bob().unwrap();
    assert!((again.p1 - 2e-3).abs() < 2e-5 && (again.p2 + 1e-3).abs() < 2e-5, "{again:?}");
}

#[test]
fn our_camera_as_plumb_bob() {
    let mut camera = plain_camera();
    camera.lens.b2 = 0.0;
    let (model, residual) = camera.to_plumb_bob().unwrap();
    // Distortion of six pixels in the corner, inverted by as many terms.
    assert!(residual < 0.01, "{residual}");
    let point = Point3::new(0.3, -0.2, -1.0);
    let [ours, theirs] = [camera.project(&point).unwrap(), project(&model, [0.3, 0.2, 1.0])];
    assert!((ours[0] - theirs[0]).hypot(ours[1] - theirs[1]) < 1.1 * residual);
}

#[test]
fn affinity_becomes_the_ratio_of_focal_lengths() {
    let lens = LensDistortion { b1: 0.02, ..LensDistortion::default() };
    let camera = Camera { lens, ..plain_camera() };
    let (model, residual) = camera.to_plumb_bob().unwrap();
    assert!((model.fx * 0.98 - model.fy).abs() < 1e-10, "{model:?}");
    // Exact but for rounding: both are linear.
    assert!(residual < 1e-9, "{residual}");
    assert!(largest_difference(&camera, &model, 3) < 1e-9);
}

#[test]
fn shear_has_no_counterpart_and_is_stated() {
    let lens = LensDistortion { b2: 0.01, ..LensDistortion::default() };
    let camera = Camera { lens, ..plain_camera() };
    let (model, residual) = camera.to_plumb_bob().unwrap();
    let found = largest_difference(&camera, &model, 1);
    // b2 moves the uppermost row by 0.01 * 72 rows = 0.7 columns; the fit of other terms can hide some of it.
    assert!(residual > 0.4 && residual < 0.8, "{residual}");
    assert!((found - residual).abs() < 0.05 * residual, "stated {residual}, found {found}");
}

#[test]
fn bad_models_are_refused() {
    let good = tof_camera();
    let bad = [
        PlumbBob { fx: 0.0, ..good },
        PlumbBob { fy: f64::NAN, ..good },
        PlumbBob { cx: f64::INFINITY, ..good },
        PlumbBob { k2: f64::NAN, ..good },
        PlumbBob { width: 0, ..good },
    ];
    for model in bad {
        assert!(Camera::from_plumb_bob(&model, 0.02).is_err(), "{model:?}");
    }
    assert!(Camera::from_plumb_bob(&good, 0.0).is_err());
    // Barrel distortion so strong that r (1 - r^2) turns back inside the image.
    let folded = Camera::from_plumb_bob(&PlumbBob { k1: -1.0, k2: 0.0, k3: 0.0, ..good }, 0.02);
    assert!(matches!(folded, Err(Error::PlumbBobFold { .. })), "{folded:?}");
    // One pixel does not tell five coefficients.
    let one = PlumbBob { width: 1, height: 1, cx: 0.0, cy: 0.0, ..good };
    assert!(matches!(Camera::from_plumb_bob(&one, 0.02), Err(Error::Fit(_))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn stated_residuals_hold(k1 in -0.2..0.1_f64, k2 in -0.05..0.05_f64, p1 in -2e-3..2e-3_f64, p2 in -2e-3..2e-3_f64) {
        round_trip(&PlumbBob { k1, k2, k3: 0.0, p1, p2, width: 240, height: 180, cx: 118.0, cy: 91.0, fx: 200.0, fy: 201.0 });
    }
}

fn numbers(text: &str) -> Vec<f64> {
    text.split([',', '[', ']', ' ', '\n']).filter_map(|word| word.parse().ok()).collect()
}

/// The numbers of an `OpenCV` YAML matrix.
fn matrix(yaml: &str, name: &str) -> Vec<f64> {
    let from = yaml.split_once(name).unwrap().1.split_once("data: [").unwrap().1;
    numbers(from.split_once(']').unwrap().0)
}

#[test]
fn a_real_passive_camera() {
    let Ok(yaml) = std::fs::read_to_string(format!("{REAL}/opencv_left_chess/left_intrinsics.yml")) else {
        println!("skipped: {REAL}/opencv_left_chess is not there");
        return;
    };
    let (k, d) = (matrix(&yaml, "camera_matrix"), matrix(&yaml, "distortion_coefficients"));
    let model = PlumbBob {
        fx: k[0],
        fy: k[4],
        cx: k[2],
        cy: k[5],
        k1: d[0],
        k2: d[1],
        p1: d[2],
        p2: d[3],
        k3: d[4],
        width: 640,
        height: 480,
    };
    let [there, back] = round_trip(&model);
    println!("opencv_left_chess: plumb_bob -> camera {there:.4} px, camera -> plumb_bob {back:.4} px");
    // Half a pixel in the corners, with a margin of a tenth; least squares without new weights leaves 1.4.
    assert!(there < 0.55 && back < 0.55);
}

#[test]
fn a_real_time_of_flight_camera() {
    let path = format!("{REAL}/tof_ir_chess_328x252/derived_opencv_calibration.txt");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {path} is not there");
        return;
    };
    let line = |start: &str| numbers(text.lines().find(|line| line.starts_with(start)).unwrap());
    let (k, d) = (line("fx "), line("k1 "));
    let model = PlumbBob {
        fx: k[0],
        fy: k[1],
        cx: k[2],
        cy: k[3],
        k1: d[0],
        k2: d[1],
        p1: d[2],
        p2: d[3],
        k3: d[4],
        width: 328,
        height: 252,
    };
    let [there, back] = round_trip(&model);
    println!("tof_ir_chess_328x252: plumb_bob -> camera {there:.4} px, camera -> plumb_bob {back:.4} px");
    // k3 = 0.19 bends the corners, where no board was seen, back inwards: no polynomial of ours follows closer than
    // 4.2 pixels, and the figure says so. Least squares without new weights folds over there.
    assert!(there < 4.6 && back < 4.6);
}
