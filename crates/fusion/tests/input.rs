//! Orders, threads, and input that means nothing.

use fusion::nalgebra::{Matrix3, Point3, Vector3};
use fusion::point_uncertainty::{CommonErrors, PointErrors};
use fusion::{Error, Fused, FusionOptions, Reason, Registered, fuse};

use crate::common::survey::{Plan, Survey};
use crate::common::wall::Wall;

/// The same points in another order, with other numbers of the frames.
struct Shuffled<'a> {
    of: &'a Survey,
    order: Vec<usize>,
}

impl PointErrors for Shuffled<'_> {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.of.noise(self.order[point])
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.of.sensor(self.order[point])
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.of.common(self.order[point], derivatives);
    }
}

fn bits(fused: &Fused) -> Vec<[u64; 5]> {
    let of = |s: &fusion::Surfel| [s.position.x, s.position.y, s.position.z, s.normal.x, s.sigma_m()].map(f64::to_bits);
    fused.surfels.iter().map(of).collect()
}

fn small() -> Plan {
    Plan { size: (64, 48), stations: 4, ..Plan::default() }
}

#[test]
fn the_order_of_points_and_frames_does_not_matter() {
    let survey = Survey::new(&small(), 2);
    let expected = fuse(&survey.registered(), &survey, &survey.common, &FusionOptions::default()).unwrap();
    let count = survey.points.len();
    // A step without a common factor visits all.
    let step = (count / 3..count).find(|step| gcd(*step, count) == 1).unwrap();
    let order: Vec<usize> = (0..count).map(|at| (at * step + 17) % count).collect();
    let points: Vec<Point3<f64>> = order.iter().map(|at| survey.points[*at]).collect();
    let frames: Vec<u32> = order.iter().map(|at| 3 - survey.frames[*at]).collect();
    let centres: Vec<Point3<f64>> = survey.centres.iter().rev().copied().collect();
    let input = Registered { points: &points, frames: &frames, centres: &centres, amplitudes: None };
    let found = fuse(&input, &Shuffled { of: &survey, order }, &survey.common, &FusionOptions::default()).unwrap();
    assert!(bits(&expected) == bits(&found));
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let survey = Survey::new(&small(), 6);
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fuse(&survey.registered(), &survey, &survey.common, &FusionOptions::default()).unwrap())
    };
    let (one, three) = (of(1), of(3));
    assert!(bits(&one) == bits(&three));
    assert_eq!(one.unfused, three.unfused);
    assert_eq!(one.surfel_of_point, three.surfel_of_point);
    assert_eq!(one.contradictions, three.contradictions);
}

/// Errors that are the same for all points.
struct Plain(f64);

impl PointErrors for Plain {
    fn noise(&self, _: usize) -> Matrix3<f64> {
        Matrix3::identity() * self.0
    }

    fn sensor(&self, _: usize) -> Option<(u64, Vector3<f64>)> {
        None
    }

    fn common(&self, _: usize, _: &mut Vec<(usize, Vector3<f64>)>) {}
}

fn refused(points: &[Point3<f64>], frames: &[u32], variance: f64, options: &FusionOptions) -> Error {
    let centres = [Point3::new(0.5, 0.5, 2.0)];
    let input = Registered { points, frames, centres: &centres, amplitudes: None };
    fuse(&input, &Plain(variance), &CommonErrors::none(), options).unwrap_err()
}

#[test]
fn what_means_nothing_is_refused_with_its_value() {
    let options = FusionOptions::default();
    let wall = Wall::new(1, 30, 0.003, 0.0, 0.0, 1);
    let (points, frames) = (&wall.points, &wall.frames);
    assert_eq!(refused(&[], &[], 1e-6, &options), Error::Empty);
    let short = refused(points, &frames[1..], 1e-6, &options);
    assert_eq!(short, Error::Length { what: "frames", expected: 900, found: 899 });
    let mut wrong = points.clone();
    wrong[7].y = f64::NAN;
    assert_eq!(refused(&wrong, frames, 1e-6, &options), Error::NonFinite { what: "point", index: 7 });
    wrong[7] = Point3::new(0.5, 0.5, 2.0);
    assert_eq!(refused(&wrong, frames, 1e-6, &options), Error::AtCentre { point: 7, frame: 0 });
    let mut beyond = frames.clone();
    beyond[3] = 5;
    assert_eq!(refused(points, &beyond, 1e-6, &options), Error::Frame { point: 3, frame: 5, frames: 1 });
    for variance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(points, frames, variance, &options), Error::Variance { point: 0, .. }), "{variance}");
    }
    for voxel_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = FusionOptions { voxel_m, ..options };
        assert!(matches!(refused(points, frames, 1e-6, &options), Error::OutOfDomain { name: "voxel_m", .. }));
    }
    for level in [0.0, 1.0, f64::NAN] {
        let options = FusionOptions { level, ..options };
        assert!(matches!(refused(points, frames, 1e-6, &options), Error::OutOfDomain { name: "level", .. }));
    }
    let tiny = FusionOptions { voxel_m: 1e-9, ..options };
    assert!(matches!(
        refused(points, frames, 1e-24 + 1e-6, &tiny),
        Error::Cells { .. } | Error::CellsBelowNoise { .. }
    ));
}

#[test]
fn clouds_without_surfaces_say_why() {
    let options = FusionOptions::default();
    let wall = Wall::new(1, 30, 0.003, 0.0, 0.0, 1);
    // Coordinates in millimetre, cells in metre.
    let millimetres: Vec<Point3<f64>> = wall.points.iter().map(|point| point * 1000.0).collect();
    let Error::NoSurface { per_cell, extent_m, .. } = refused(&millimetres, &wall.frames, 1e-5, &options) else {
        unreachable!("another verdict")
    };
    assert!(per_cell < 1.01 && extent_m > 900.0);
    let text = refused(&millimetres, &wall.frames, 1e-5, &options).to_string();
    assert!(text.contains("give the points in metre, or take cells"), "{text}");
    let wide = FusionOptions { voxel_m: 100.0, ..options };
    assert!(matches!(refused(&wall.points, &wall.frames, 1e-5, &wide), Error::NoSurface { cells: 1..=8, .. }));
    assert!(matches!(
        refused(&wall.points[..1], &wall.frames[..1], 1e-5, &options),
        Error::NoSurface { points: 1, .. }
    ));
    assert_eq!(refused(&[wall.points[0]; 50], &wall.frames[..50], 1e-5, &options), Error::Coincident(50));
    let noisy = refused(&wall.points, &wall.frames, 0.01, &options);
    let Error::CellsBelowNoise { least_m, .. } = noisy else { unreachable!("{noisy:?}") };
    assert!(least_m > 0.1);
}

#[test]
fn a_lonely_point_is_alone_and_amplitudes_are_averaged() {
    let mut wall = Wall::new(2, 40, 0.003, 0.0, 0.0, 1);
    wall.points[0] = Point3::new(9.0, 9.0, 1.0);
    let amplitudes: Vec<f64> = wall.frames.iter().map(|frame| [100.0, f64::NAN][*frame as usize]).collect();
    let input = Registered { amplitudes: Some(&amplitudes), ..wall.registered() };
    let fused = fuse(&input, &wall, &wall.common, &FusionOptions::default()).unwrap();
    let alone = fused.unfused.iter().find(|unfused| unfused.point == 0).unwrap();
    assert_eq!(alone.reason, Reason::Alone);
    assert!(fused.surfels.iter().filter(|s| s.frames.contains(&0)).all(|s| s.amplitude == 100.0));
    assert_eq!(fused.surfel_of_point.iter().flatten().count() + fused.unfused.len(), wall.points.len());
}
