//! Volumes: values, what is missing, what is refused.

use measurement::nalgebra::{Matrix3, Point3, Unit, Vector3};
use measurement::point_uncertainty::{CommonErrors, PointErrors};
use measurement::{Base, Cloud, Error, HalfSpace, Region, VolumeOptions, volume};

struct Exact;

impl PointErrors for Exact {
    fn noise(&self, _: usize) -> Matrix3<f64> {
        Matrix3::identity() * 1e-6
    }

    fn sensor(&self, _: usize) -> Option<(u64, Vector3<f64>)> {
        None
    }

    fn common(&self, _: usize, _: &mut Vec<(usize, Vector3<f64>)>) {}
}

/// A slope over a square metre, with a hole.
fn slope() -> Vec<Point3<f64>> {
    let at = |k: usize| [k % 100, k / 100].map(|at| (at as f64 + 0.5) / 100.0);
    let all = (0..10_000).map(at).filter(|[x, y]| !(*x > 0.8 && *y > 0.7));
    all.map(|[x, y]| Point3::new(x, y, 0.2 + 0.1 * x - 0.05 * y)).collect()
}

fn base() -> Base<'static> {
    Base::Fixed { point: Point3::origin(), normal: Unit::new_unchecked(Vector3::z()) }
}

#[test]
fn a_slope_has_its_volume_and_a_hole_is_named() {
    let points = slope();
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &Exact, common: &common };
    let region = Region::Box { from_m: [0.0; 3], to_m: [1.0; 3] };
    let found = volume(&cloud, &region, &base(), &VolumeOptions { cell_m: 0.1 }).unwrap();
    let hole = 0.2 * 0.3 * (0.2 + 0.1 * 0.9 - 0.05 * 0.85);
    assert!((found.volume.value - (0.225 - hole)).abs() < 1e-9, "{}", found.volume.value);
    assert_eq!((found.cells, found.missing.len()), (94, 6));
    assert!((found.missing_m2() - 0.06).abs() < 1e-12 && (found.area_m2 - 0.94).abs() < 1e-12);
    assert!(found.doubt().unwrap().contains("6 of 100 cells"));
    // Of independent heights: each cell's mean of a hundred points, with the slope that turns what is along x and y into height.
    let sigma = found.volume.estimate(&cloud).sigma;
    let one = 0.01 * 1e-3 * (1.0_f64 + 0.01 + 0.0025).sqrt() / 10.0;
    assert!((sigma - one * 94.0_f64.sqrt()).abs() < 1e-10, "{sigma}");
}

#[test]
fn a_triangle_counts_with_its_area() {
    let points = slope();
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &Exact, common: &common };
    let corners_m = vec![[0.0, 0.0, 0.0], [0.69, 0.0, 0.0], [0.0, 0.71, 0.0]];
    let region = Region::Prism { corners_m, reach_m: [0.1, 1.0] };
    let found = volume(&cloud, &region, &base(), &VolumeOptions { cell_m: 0.07 }).unwrap();
    let area = 0.5 * 0.69 * 0.71;
    let height = 0.2 + (0.1 * 0.69 - 0.05 * 0.71) / 3.0;
    assert!((found.area_m2 - area).abs() < 0.003 && found.missing_m2() < 0.003, "{}", found.area_m2);
    assert!((found.volume.value - area * height).abs() < 0.015 * area * height, "{}", found.volume.value);
}

#[test]
fn footprints_that_mean_nothing_are_refused() {
    let points = slope();
    let common = CommonErrors::none();
    let cloud = Cloud { points: &points, errors: &Exact, common: &common };
    let open = Region::HalfSpaces(vec![HalfSpace { point_m: [0.0; 3], inward: [0.0, 0.0, 1.0] }]);
    let found = |region: &Region, cell_m| volume(&cloud, region, &base(), &VolumeOptions { cell_m }).unwrap_err();
    assert_eq!(found(&open, 0.1), Error::Unbounded);
    let region = Region::Box { from_m: [0.0; 3], to_m: [1.0; 3] };
    assert!(matches!(found(&region, 0.0), Error::OutOfDomain { name: "cell_m", .. }));
    assert!(matches!(found(&region, 1e-5), Error::OutOfDomain { name: "cell_m", .. }));
    let empty = Region::Box { from_m: [5.0; 3], to_m: [6.0; 3] };
    assert_eq!(found(&empty, 0.1), Error::NoCells { cells: 100 });
}
