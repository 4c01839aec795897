//! Planes, spheres and cylinders fitted to regions of frames, against the truth.

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use nalgebra::{DVector, Point3, Vector3};
use primitives::{DifferenceOptions, Error};
use primitives::{Primitive, PrimitiveFit, PrimitiveKind, PrimitiveOptions, fit_primitive};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

const SIGMA_M: f64 = 0.005;

fn camera() -> Camera {
    let format = ImageFormat::new(60, 48, [0.1, 0.1]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.1, -0.05], principal_distance_mm: 8.0 };
    Camera::new(format, interior, LensDistortion { k1: -1e-3, ..LensDistortion::default() }).unwrap()
}

/// First range of a body of which only the distance is known, by halving; `None` where the ray misses.
fn range_to(distance: &dyn Fn(Point3<f64>) -> f64, ray: Vector3<f64>) -> Option<f64> {
    let at = |range: f64| distance(Point3::from(ray * range));
    // Bodies thinner than a centimetre along the ray, at their rims, are missed.
    let first = (100..300).map(|step| f64::from(step) * 1e-2).find(|range| at(*range) * at(range + 1e-2) <= 0.0)?;
    let (mut low, mut high) = (first, first + 1e-2);
    for _ in 0..50 {
        let middle = f64::midpoint(low, high);
        if at(low) * at(middle) <= 0.0 { high = middle } else { low = middle }
    }
    Some(low)
}

/// A body before a wall 3 m away, ranges with noise; `None` as distance leaves the wall alone.
fn frame(body: Option<&dyn Fn(Point3<f64>) -> f64>, seed: u64) -> RangeFrame {
    let camera = camera();
    let mut random = Pcg64::seed_from_u64(seed);
    RangeFrame {
        range: Raster::from_fn(60, 48, |col, row| {
            let ray = camera.ray([col as f64, row as f64]);
            let wall = -3.0 / ray.z;
            let range = body.and_then(|body| range_to(body, ray)).unwrap_or(wall);
            let unit: f64 = StandardNormal.sample(&mut random);
            (range + SIGMA_M * unit) as f32
        }),
        sigma: Raster::filled(60, 48, SIGMA_M as f32),
        amplitude: Raster::filled(60, 48, 100.0),
        flags: Raster::filled(60, 48, Flags::empty()),
    }
}

fn window(window: [[usize; 2]; 2]) -> PrimitiveOptions {
    let standard = PrimitiveOptions::default();
    PrimitiveOptions { pixels: DifferenceOptions { window: Some(window), ..standard.pixels }, ..standard }
}

fn sphere(point: Point3<f64>) -> f64 {
    (point - Point3::new(0.05, -0.02, -2.0)).norm() - 0.4
}

/// Axis inclined in all directions.
fn cylinder(point: Point3<f64>) -> f64 {
    let axis = Vector3::new(0.3, 1.0, 0.2).normalize();
    axis.cross(&(point - Point3::new(0.0, 0.0, -2.0))).norm() - 0.3
}

fn fitted(kind: PrimitiveKind, seed: u64) -> PrimitiveFit {
    let (frame, options) = match kind {
        PrimitiveKind::Plane => (frame(None, seed), PrimitiveOptions::default()),
        PrimitiveKind::Sphere => (frame(Some(&sphere), seed), window([[18, 44], [10, 36]])),
        PrimitiveKind::Cylinder => (frame(Some(&cylinder), seed), window([[22, 38], [4, 44]])),
    };
    fit_primitive(&frame, &camera(), kind, &options).unwrap()
}

/// Mean square over runs of standardised errors of the modelled ranges, and the mean gain.
fn statistics(kind: PrimitiveKind, truth: &dyn Fn(Vector3<f64>) -> f64) -> [f64; 2] {
    let runs = 30_u32;
    let (mut square, mut gain) = (0.0, 0.0);
    for seed in 0..runs {
        let fit = fitted(kind, u64::from(seed));
        let used: Vec<_> = fit.pixels.iter().filter(|pixel| pixel.used).collect();
        let standardised = |pixel: &&primitives::FittedPixel| {
            let ray = camera().ray(pixel.position.map(|index| index as f64));
            ((pixel.modelled_m - truth(ray)) / pixel.modelled_sigma_m).powi(2)
        };
        square += used.iter().map(standardised).sum::<f64>() / used.len() as f64 / f64::from(runs);
        gain += fit.gain / f64::from(runs);
        assert!(fit.sigma0_probability > 1e-5 && (fit.sigma0 - 1.0).abs() < 0.15, "{kind}: sigma0 {}", fit.sigma0);
        assert!(fit.systematic_sigmas < 0.4, "{kind}: {}", fit.systematic_sigmas);
    }
    [square, gain]
}

#[test]
fn modelled_ranges_are_as_precise_as_they_say() {
    let wall = |ray: Vector3<f64>| -3.0 / ray.z;
    let round = |body: &'static dyn Fn(Point3<f64>) -> f64| move |ray| range_to(body, ray).unwrap_or(f64::NAN);
    let (ball, tube) = (round(&sphere), round(&cylinder));
    let cases: [(PrimitiveKind, &dyn Fn(Vector3<f64>) -> f64); 3] =
        [(PrimitiveKind::Plane, &wall), (PrimitiveKind::Sphere, &ball), (PrimitiveKind::Cylinder, &tube)];
    for (kind, truth) in cases {
        let [square, gain] = statistics(kind, truth);
        println!("{kind}: mean square of standardised errors {square:.2}, gain {gain:.1}");
        // Mean over pixels of squares with u independent parts: χ²_u / u over 30 runs, u from 3 to 5, has a deviation of
        // √(2 / 30 u) < 0.15; four times that.
        assert!((square - 1.0).abs() < 0.6, "{kind}: {square}");
        // n pixels for u parameters gain √(n / u).
        let fit = fitted(kind, 0);
        let used = fit.pixels.iter().filter(|pixel| pixel.used).count();
        let expected = (used as f64 / kind.parameters() as f64).sqrt();
        assert!((gain / expected - 1.0).abs() < 0.1, "{kind}: {gain}, {expected}");
    }
}

#[test]
fn primitives_are_found() {
    let Primitive::Sphere { centre, radius_m } = fitted(PrimitiveKind::Sphere, 3).primitive else { panic!("a sphere") };
    assert!((radius_m - 0.4).abs() < 0.01 && (centre - Point3::new(0.05, -0.02, -2.0)).norm() < 0.01, "{centre}");
    let Primitive::Cylinder { axis, radius_m, point } = fitted(PrimitiveKind::Cylinder, 3).primitive else {
        panic!("a cylinder")
    };
    assert!((radius_m - 0.3).abs() < 0.02 && cylinder(point).abs() < 0.32, "{radius_m}");
    assert!(axis.cross(&Vector3::new(0.3, 1.0, 0.2).normalize()).norm() < 0.05, "{axis}");
}

#[test]
fn other_things_in_the_region_are_left_out() {
    // The ball covers a quarter of the wall.
    let frame = frame(Some(&sphere), 1);
    let fit = fit_primitive(&frame, &camera(), PrimitiveKind::Plane, &PrimitiveOptions::default()).unwrap();
    let Primitive::Plane { normal, distance_m } = fit.primitive else { panic!("a plane") };
    assert!((distance_m - 3.0).abs() < 0.003 && (normal + Vector3::z()).norm() < 0.003, "{distance_m} {normal}");
    assert!(fit.outlier_share() > 0.1, "{}", fit.outlier_share());
}

#[test]
fn the_covariance_is_that_of_repeated_fits() {
    let truth = DVector::from_vec(vec![0.05, -0.02, -2.0, 0.4]);
    let runs = 40_u32;
    let squares = (0..runs).map(|seed| {
        let fit = fitted(PrimitiveKind::Sphere, u64::from(100 + seed));
        let error = DVector::from_vec(fit.parameters.clone()) - &truth;
        (error.transpose() * fit.covariance.clone().try_inverse().unwrap() * &error)[(0, 0)]
    });
    let mean = squares.sum::<f64>() / f64::from(runs);
    // χ² of 4 degrees of freedom: the mean of 40 has a deviation of 0.45; four times that.
    assert!((mean - 4.0).abs() < 1.8, "{mean}");
}

#[test]
fn what_is_not_that_primitive_is_refused() {
    let ball = frame(Some(&sphere), 2);
    let answer = fit_primitive(&ball, &camera(), PrimitiveKind::Plane, &window([[20, 42], [12, 34]]));
    assert!(matches!(answer, Err(Error::NotThatPrimitive { kind: PrimitiveKind::Plane, .. })), "{answer:?}");
    let flat = frame(None, 2);
    for kind in [PrimitiveKind::Sphere, PrimitiveKind::Cylinder] {
        let answer = fit_primitive(&flat, &camera(), kind, &PrimitiveOptions::default());
        assert!(matches!(answer, Err(Error::PrimitiveNotDetermined { .. } | Error::Adjust(_))), "{kind}: {answer:?}");
    }
    // Four pixels across the middle of the ball: a cap of four degrees.
    let answer = fit_primitive(&ball, &camera(), PrimitiveKind::Sphere, &window([[28, 32], [20, 24]]));
    assert!(matches!(answer, Err(Error::PrimitiveNotDetermined { .. } | Error::Adjust(_))), "{answer:?}");
    let answer = fit_primitive(&ball, &camera(), PrimitiveKind::Sphere, &window([[28, 29], [20, 21]]));
    assert!(matches!(answer, Err(Error::TooFewPixels { pixels: 4, .. })), "{answer:?}");
    let mut small = ball;
    small.range = Raster::filled(3, 3, 1.0);
    assert!(fit_primitive(&small, &camera(), PrimitiveKind::Plane, &PrimitiveOptions::default()).is_err());
}
