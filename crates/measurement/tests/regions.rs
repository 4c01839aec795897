//! Regions against what they should hold.

use measurement::nalgebra::Point3;
use measurement::{Error, HalfSpace, Region};

fn points() -> Vec<Point3<f64>> {
    let at = |index: usize| (index as f64 - 4.5) / 3.0;
    (0..1000).map(|k| Point3::new(at(k % 10), at(k / 10 % 10), at(k / 100))).collect()
}

fn holds(region: &Region, inside: impl Fn(&Point3<f64>) -> bool) {
    let points = points();
    let found = region.select(&points).unwrap();
    let expected: Vec<usize> = (0..points.len()).filter(|index| inside(&points[*index])).collect();
    assert!(!expected.is_empty());
    assert_eq!(found, expected, "{region:?}");
}

#[test]
fn regions_hold_what_is_in_them() {
    let cube = Region::Box { from_m: [-0.6, -0.6, -0.6], to_m: [0.6, 0.7, 0.8] };
    let in_box = |p: &Point3<f64>| p.x.abs() < 0.6 && p.y > -0.6 && p.y < 0.7 && p.z > -0.6 && p.z < 0.8;
    holds(&cube, in_box);
    let ball = Region::Sphere { centre_m: [1.0, 0.0, 0.0], radius_m: 0.7 };
    let in_ball = |p: &Point3<f64>| (p - Point3::new(1.0, 0.0, 0.0)).norm() < 0.7;
    holds(&ball, in_ball);
    holds(&Region::Union(vec![cube, ball]), |p| in_box(p) || in_ball(p));
    let cylinder = Region::Cylinder { from_m: [0.0, 0.0, -1.0], to_m: [0.0, 0.0, 0.4], radius_m: 0.8 };
    holds(&cylinder, |p| p.x.hypot(p.y) < 0.8 && p.z > -1.0 && p.z < 0.4);
    let turned = Region::OrientedBox {
        centre_m: [0.0; 3],
        size_m: [2.0, 0.9, 0.9],
        first: [1.0, 1.0, 0.0],
        second: [0.0, 1.0, 0.0],
    };
    holds(&turned, |p| {
        (p.x + p.y).abs() < 2.0_f64.sqrt() && (p.y - p.x).abs() < 0.45 * 2.0_f64.sqrt() && p.z.abs() < 0.45
    });
    // An L, which is not convex.
    let corners_m = [[-1.0, -1.0], [1.0, -1.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [-1.0, 1.0]];
    let corners_m = corners_m.map(|[x, y]| [x, y, 0.2]).to_vec();
    holds(&Region::Prism { corners_m, reach_m: [0.3, 0.8] }, |p| {
        p.x.abs() < 1.0 && p.y.abs() < 1.0 && !(p.x > 0.0 && p.y > 0.0) && p.z > -0.1 && p.z < 1.0
    });
    let above = HalfSpace { point_m: [0.0, 0.0, 0.1], inward: [0.0, 0.0, 3.0] };
    let right = HalfSpace { point_m: [0.1, 0.0, 0.0], inward: [1.0, 0.0, 0.0] };
    holds(&Region::HalfSpaces(vec![above, right]), |p| p.z > 0.1 && p.x > 0.1);
}

#[test]
fn regions_that_enclose_nothing_are_refused() {
    let refused = |region: Region| region.select(&points()).unwrap_err();
    let flat = Region::Box { from_m: [0.0; 3], to_m: [1.0, 0.0, 1.0] };
    assert!(matches!(refused(flat), Error::OutOfDomain { value: 0.0, .. }));
    let ball = Region::Sphere { centre_m: [f64::NAN, 0.0, 0.0], radius_m: 1.0 };
    assert!(matches!(refused(ball), Error::OutOfDomain { name: "centre_m", .. }));
    let ball = Region::Sphere { centre_m: [0.0; 3], radius_m: -1.0 };
    assert!(matches!(refused(ball), Error::OutOfDomain { name: "radius_m", .. }));
    let line = Region::Prism { corners_m: vec![[0.0; 3], [1.0; 3], [2.0; 3]], reach_m: [1.0, 1.0] };
    assert!(matches!(refused(line), Error::Region(_)));
    let open = Region::Prism { corners_m: vec![[0.0; 3]], reach_m: [1.0, 1.0] };
    assert!(matches!(refused(open), Error::Region(_)));
    assert!(matches!(refused(Region::Union(Vec::new())), Error::Region(_)));
    assert!(matches!(refused(Region::HalfSpaces(Vec::new())), Error::Region(_)));
    let (first, second) = ([1.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
    let turned = Region::OrientedBox { centre_m: [0.0; 3], size_m: [1.0; 3], first, second };
    assert!(matches!(refused(turned), Error::Region(_)));
}
