//! What is fitted, left out, doubted and refused.

use measurement::nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use measurement::point_uncertainty::{CommonErrors, PointErrors};
use measurement::{
    Cloud, Error, FitOptions, Region, Shape, axis_distance, fit_cylinder, fit_plane, fit_sphere, flatness,
    plane_to_plane,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::scene::{self, Setting};

/// Points with noise of one size along z.
struct AlongZ {
    sigma_m: f64,
}

impl PointErrors for AlongZ {
    fn noise(&self, _: usize) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, self.sigma_m * self.sigma_m))
    }

    fn sensor(&self, _: usize) -> Option<(u64, Vector3<f64>)> {
        None
    }

    fn common(&self, _: usize, _: &mut Vec<(usize, Vector3<f64>)>) {}
}

/// A grid of points at these heights.
fn grid(side: usize, step_m: f64, height: impl Fn(f64, f64) -> f64) -> Vec<Point3<f64>> {
    let at = |index: usize| [index % side, index / side].map(|at| (at as f64 - 0.5 * (side - 1) as f64) * step_m);
    (0..side * side).map(at).map(|[x, y]| Point3::new(x, y, height(x, y))).collect()
}

fn noise(points: &mut [Point3<f64>], sigma_m: f64, seed: u64) {
    let mut random = Pcg64::seed_from_u64(seed);
    for point in points {
        let error: f64 = StandardNormal.sample(&mut random);
        point.z += sigma_m * error;
    }
}

fn all(points: &[Point3<f64>]) -> Vec<usize> {
    (0..points.len()).collect()
}

#[test]
fn a_third_of_other_points_is_left_out_and_counted() {
    let mut points = grid(30, 0.02, |x, _| 0.1 * x);
    noise(&mut points, 0.002, 3);
    for point in points.iter_mut().step_by(3) {
        point.z += 0.05;
    }
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    let plane = fit_plane(&cloud, &all(&points), &FitOptions::default()).unwrap();
    assert_eq!(plane.support.left_out.len(), 300);
    assert!(plane.support.left_out.iter().all(|index| index % 3 == 0));
    assert!((plane.normal.x / plane.normal.z + 0.1).abs() < 0.002);
    assert!(!plane.support.scatter.exceeds(), "{:?}", plane.support.scatter);
}

#[test]
fn understated_noise_is_a_doubt_with_the_factor_and_nothing_is_scaled() {
    let mut points = grid(30, 0.02, |_, _| 0.0);
    noise(&mut points, 0.003, 4);
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    let plane = fit_plane(&cloud, &all(&points), &FitOptions::default()).unwrap();
    assert!(plane.support.left_out.len() < 5, "{}", plane.support.left_out.len());
    let scatter = plane.support.scatter;
    assert!((scatter.sigma0 - 1.5).abs() < 0.1 && scatter.exceeds());
    assert!(scatter.doubt().unwrap().contains("1.5") || scatter.doubt().unwrap().contains("1.4"));
    let form = flatness(&plane);
    assert!((form.noise_m - 0.002).abs() < 1e-4 && (form.spread_m - 0.003).abs() < 3e-4, "{form:?}");
}

#[test]
fn another_shape_is_a_doubt() {
    let mut points = grid(30, 0.02, |x, y| 0.08 * (x * x + y * y));
    noise(&mut points, 0.002, 5);
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    assert!(fit_plane(&cloud, &all(&points), &FitOptions::default()).unwrap().support.scatter.exceeds());
}

#[test]
fn what_determines_nothing_is_refused_by_name() {
    let common = CommonErrors::none();
    let errors = AlongZ { sigma_m: 0.002 };
    let options = FitOptions::default();
    let few: Vec<_> = grid(3, 0.02, |_, _| 0.0);
    let cloud = |points| Cloud { points, errors: &errors, common: &common };
    let found = fit_plane(&cloud(&few), &all(&few), &options).unwrap_err();
    assert!(matches!(found, Error::TooFewPoints { shape: Shape::Plane, points: 9, needed: 15, .. }), "{found}");

    let mut line: Vec<_> = (0..50).map(|k| Point3::new(0.01 * f64::from(k), 1e-4 * f64::from(k % 3), 0.0)).collect();
    noise(&mut line, 0.002, 6);
    let found = fit_plane(&cloud(&line), &all(&line), &options).unwrap_err();
    assert!(matches!(found, Error::Collinear { width_m, .. } if width_m < 0.01), "{found}");

    // A cap of a sphere of 10 m that noise hides.
    let mut cap = grid(20, 0.01, |x, y| -(x * x + y * y) / 20.0);
    noise(&mut cap, 0.002, 7);
    let found = fit_sphere(&cloud(&cap), &all(&cap), &options).unwrap_err();
    assert!(matches!(found, Error::NotDetermined { shape: Shape::Sphere, .. }), "{found}");
    let found = fit_cylinder(&cloud(&cap), &all(&cap), &options).unwrap_err();
    assert!(matches!(found, Error::NotDetermined { shape: Shape::Cylinder, .. }), "{found}");

    let mut random = Pcg64::seed_from_u64(8);
    let mut uniform = || rand_distr::Uniform::new(-1.0, 1.0).unwrap().sample(&mut random);
    let fog: Vec<_> = (0..400).map(|_| Point3::new(uniform(), uniform(), uniform())).collect();
    let found = fit_plane(&cloud(&fog), &all(&fog), &options);
    // A robust scale grows with the fog: where it is not refused, the scatter says so.
    assert!(found.is_err() || found.unwrap().support.scatter.exceeds());

    let found = fit_plane(&cloud(&few), &[0, 9], &options).unwrap_err();
    assert_eq!(found, Error::NoSuchPoint { index: 9, points: 9 });
    let found = fit_plane(&cloud(&few), &[], &FitOptions { doubt_level: 0.0, ..options }).unwrap_err();
    assert!(matches!(found, Error::OutOfDomain { name: "doubt_level", .. }));
}

#[test]
fn points_without_value_or_deviation_are_counted() {
    let mut points = grid(10, 0.02, |_, _| 0.0);
    points[7].x = f64::NAN;
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    assert_eq!(fit_plane(&cloud, &all(&points), &FitOptions::default()).unwrap().support.unusable, 1);
    let cloud = Cloud { errors: &AlongZ { sigma_m: 0.0 }, ..cloud };
    let found = fit_plane(&cloud, &all(&points), &FitOptions::default()).unwrap_err();
    assert!(matches!(found, Error::TooFewPoints { points: 0, unusable: 100, .. }), "{found}");
}

#[test]
fn a_plane_is_that_of_linear_least_squares() {
    let mut points = grid(12, 0.05, |x, y| 0.02 * x - 0.03 * y + 0.4);
    noise(&mut points, 0.002, 9);
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    let plane = fit_plane(&cloud, &all(&points), &FitOptions::default()).unwrap();
    assert!(plane.support.left_out.is_empty());
    // Noise along z alone: z = a + b x + c y, of which the grid is symmetric.
    let mean = points.iter().map(|point| point.z).sum::<f64>() / 144.0;
    let slope = |of: fn(&Point3<f64>) -> f64| {
        let square: f64 = points.iter().map(|point| of(point).powi(2)).sum();
        points.iter().map(|point| of(point) * point.z).sum::<f64>() / square
    };
    let [b, c] = [slope(|point| point.x), slope(|point| point.y)];
    assert!((plane.normal.x / plane.normal.z + b).abs() < 1e-12 && (plane.normal.y / plane.normal.z + c).abs() < 1e-12);
    assert!((plane.normal.dot(&(Point3::new(0.0, 0.0, mean) - plane.point))).abs() < 1e-12);
}

#[test]
fn a_region_thinner_than_the_scatter_is_a_doubt() {
    let mut points = grid(30, 0.02, |_, _| 0.0);
    noise(&mut points, 0.002, 13);
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    let said = |from: f64, to: f64| {
        let region = Region::Box { from_m: [-1.0, -1.0, from], to_m: [1.0, 1.0, to] };
        let plane = fit_plane(&cloud, &region.select(&points).unwrap(), &FitOptions::default()).unwrap();
        plane.support.doubt_of_cut(&cloud, &region).unwrap()
    };
    assert_eq!(said(-0.02, 0.02), None);
    assert!(said(-0.02, 0.002).unwrap().contains("100 %"));
}

/// A cloud seen from elsewhere.
struct Moved<'a> {
    errors: &'a dyn PointErrors,
    to: Isometry3<f64>,
}

impl PointErrors for Moved<'_> {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        let turn = self.to.rotation.to_rotation_matrix();
        turn * self.errors.noise(point) * turn.transpose()
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.errors.sensor(point).map(|(cell, shift)| (cell, self.to * shift))
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.errors.common(point, derivatives);
        for (_, by) in derivatives {
            *by = self.to * *by;
        }
    }
}

#[test]
fn lengths_are_the_same_from_elsewhere() {
    let survey = scene::survey(&Setting::default(), 14);
    let cloud = survey.cloud();
    // A grid of a country: coordinates of 10 km, rounded to 2e-12 m.
    let to = Isometry3::new(Vector3::new(4000.0, -9000.0, 300.0), Vector3::new(0.4, 1.1, -0.7));
    let points: Vec<Point3<f64>> = survey.points.iter().map(|point| to * point).collect();
    let moved = Cloud { points: &points, errors: &Moved { errors: cloud.errors, to }, common: cloud.common };
    let [ball, pipe] =
        [scene::sphere_region(0), scene::cylinder_region()].map(|region| region.select(cloud.points).unwrap());
    let [one, two] = [cloud, moved].map(|cloud| {
        let ball = fit_sphere(&cloud, &ball, &FitOptions::default()).unwrap();
        let pipe = fit_cylinder(&cloud, &pipe, &FitOptions::default()).unwrap();
        let quantities = [axis_distance(&ball.place(), &pipe), ball.radius(), pipe.radius()];
        quantities.map(|quantity| quantity.estimate(&cloud)).map(|estimate| [estimate.value, estimate.sigma])
    });
    for (one, two) in one.as_flattened().iter().zip(two.as_flattened()) {
        // A fit stands still to a millionth of its standard deviation of a millimetre.
        assert!((one - two).abs() < 1e-7, "{one} {two}");
    }
}

#[test]
fn the_same_points_give_the_same_bits_and_planes_at_an_angle_no_distance() {
    let survey = scene::survey(&Setting::default(), 11);
    let cloud = survey.cloud();
    let points = scene::cylinder_region().select(cloud.points).unwrap();
    let [one, two] = [(); 2].map(|()| fit_cylinder(&cloud, &points, &FitOptions::default()).unwrap());
    assert_eq!(one, two);
    let flat = fit_plane(&cloud, &scene::wall_region().select(cloud.points).unwrap(), &FitOptions::default()).unwrap();
    let mut leaning = grid(10, 0.02, |x, _| 0.5 * x);
    noise(&mut leaning, 0.002, 12);
    let common = CommonErrors::none();
    let other = Cloud { points: &leaning, errors: &AlongZ { sigma_m: 0.002 }, common: &common };
    let leaning = fit_plane(&other, &all(&leaning), &FitOptions::default()).unwrap();
    let found = plane_to_plane(&cloud, &flat, &leaning, None).unwrap_err();
    assert!(matches!(found, Error::NotParallel { angle_deg, .. } if (angle_deg - 26.6).abs() < 2.0), "{found}");
}
