//! The rational model of factory calibrations.
#![cfg(feature = "convert")]

use camera_model::{Camera, Error, PlumbBob, Rational};

/// A depth camera of a wide field of view as its factory states it, 640 x 576 pixels.
fn depth_camera() -> Rational {
    let numerator = PlumbBob {
        fx: 504.6,
        fy: 504.7,
        cx: 332.8,
        cy: 348.8,
        k1: 5.11,
        k2: 3.27,
        p1: 2.3e-5,
        p2: 1.8e-5,
        k3: 0.166,
        width: 640,
        height: 576,
    };
    Rational { numerator, denominator: [5.44, 4.8, 0.86] }
}

/// The forward model as the documentation of `OpenCV` writes it; `point` in computer-vision axes.
fn project(model: &Rational, point: [f64; 3]) -> [f64; 2] {
    let PlumbBob { fx, fy, cx, cy, k1, k2, p1, p2, k3, .. } = model.numerator;
    let [k4, k5, k6] = model.denominator;
    let [x, y] = [point[0] / point[2], point[1] / point[2]];
    let r2 = x * x + y * y;
    let radial = (1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2.powi(3)) / (1.0 + k4 * r2 + k5 * r2 * r2 + k6 * r2.powi(3));
    let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    [fx * xd + cx, fy * yd + cy]
}

#[test]
fn the_residual_that_is_stated_is_what_is_left() {
    let model = depth_camera();
    let (camera, stated) = Camera::from_rational(&model, 0.0035).unwrap();
    let mut largest = 0.0_f64;
    for row in (0..576).step_by(3) {
        for col in (0..640).step_by(3) {
            let pixel = [f64::from(col), f64::from(row)];
            let point = camera.point(pixel, 2.0);
            let other = project(&model, [point.x, -point.y, -point.z]);
            largest = largest.max((other[0] - pixel[0]).hypot(other[1] - pixel[1]));
        }
    }
    println!("rational -> camera: stated {stated:.3} px, found {largest:.3} px");
    // Six radial terms in three leave a pixel or two in the corners.
    assert!(largest < 1.1 * stated && stated < 2.0);
}

/// Where a factor stands above and below, what is left is `plumb_bob`: the same lens, by derivatives of another form.
#[test]
fn a_factor_that_cancels_leaves_plumb_bob() {
    let (a, b) = (-0.12, 0.3);
    let plain = PlumbBob { k1: a, k2: 0.0, k3: 0.0, p1: 1e-3, p2: -5e-4, ..depth_camera().numerator };
    let model = Rational { numerator: PlumbBob { k1: a + b, k2: a * b, ..plain }, denominator: [b, 0.0, 0.0] };
    let (expected, left) = Camera::from_plumb_bob(&plain, 0.0035).unwrap();
    let (found, also_left) = Camera::from_rational(&model, 0.0035).unwrap();
    assert!((left - also_left).abs() < 1e-6, "{left} {also_left}");
    for (found, expected) in found.lens.coefficients().iter().zip(expected.lens.coefficients()) {
        assert!((found - expected).abs() <= 1e-6 * expected.abs() + 1e-12, "{found} {expected}");
    }
}

#[test]
fn bad_models_are_refused() {
    let good = depth_camera();
    let nan = Rational { denominator: [f64::NAN, 0.0, 0.0], ..good };
    assert!(matches!(Camera::from_rational(&nan, 0.0035), Err(Error::OutOfDomain { name: "k4", .. })));
    let without = Rational { numerator: PlumbBob { fx: 0.0, ..good.numerator }, ..good };
    assert!(Camera::from_rational(&without, 0.0035).is_err());
    let numerator = PlumbBob { k1: -2.0, k2: 0.0, k3: 0.0, ..good.numerator };
    let folded = Rational { numerator, denominator: [0.0; 3] };
    assert!(matches!(Camera::from_rational(&folded, 0.0035), Err(Error::RationalFold { .. })));
}
