//! A part of every kind, made outside the crate, in one registration.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::{Pinhole, Scene as Room, cloud, disturbance, look_at, pose_error};
use icp_registration::parts::{
    ErrorMetric, Minimiser, Pair, PairRejection, PairWeighting, Partner, PointMatching, PointSelection, Query, Row,
    Rows, Scene, TargetSurface,
};
use icp_registration::{IcpTarget, Registration, System};
use nalgebra::{Matrix6, Vector6};

/// Calls of each part.
#[derive(Default)]
struct Calls([AtomicUsize; 6]);

impl Calls {
    fn count(&self, part: usize) {
        self.0[part].fetch_add(1, Ordering::Relaxed);
    }
}

struct EvenPoints<'a>(&'a Calls);

impl PointSelection for EvenPoints<'_> {
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>, icp_registration::Error> {
        self.0.count(0);
        Ok((0..scene.source.len()).filter(|i| i % 2 == 0).collect())
    }
}

/// The better of the three nearest points: the one whose plane is nearest.
struct NearestPlane<'a>(&'a Calls, &'a IcpTarget);

impl PointMatching for NearestPlane<'_> {
    fn target(&self) -> TargetSurface<'_> {
        let (radius_m, spacing_m) = (2.0, self.1.spacing_m());
        TargetSurface { cloud: Some(self.1.cloud()), radius_m, spacing_m, exact_normals: false }
    }

    fn partner(&self, query: &Query) -> Partner {
        self.0.count(1);
        let neighbours = self.1.tree().k_nearest(&query.moved.into(), 3).unwrap();
        let distance = |i: usize| {
            let offset = query.moved - self.1.cloud().points[i].coords;
            self.1.normals()[i].dot(&offset).abs()
        };
        let near = neighbours.iter().filter(|n| n.distance_m <= query.limit_m);
        let best = near.map(|n| n.index).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        best.map_or(Partner::none(0.0), |index| Partner {
            found: true,
            target: Some(index),
            point: self.1.cloud().points[index].coords,
            normal: self.1.normals()[index],
            margin_m: 0.0,
        })
    }
}

/// Oblique points count less.
struct Obliqueness<'a>(&'a Calls);

impl PairWeighting for Obliqueness<'_> {
    fn weigh(&self, scene: &Scene<'_>, pairs: &mut [Pair]) {
        self.0.count(2);
        for pair in pairs {
            let ray = scene.source.points[pair.source].coords.normalize();
            let normal = scene.source_normals[pair.source];
            if !normal.x.is_nan() {
                pair.weight *= ray.dot(&normal).abs();
            }
        }
    }
}

struct NotTooFar<'a>(&'a Calls);

impl PairRejection for NotTooFar<'_> {
    fn keeps(&self, scene: &Scene<'_>, pair: &Pair) -> bool {
        self.0.count(3);
        scene.source.points[pair.source].coords.norm() < 6.0
    }
}

/// Distance from the plane of the source point.
struct PlaneToPoint<'a>(&'a Calls);

impl ErrorMetric for PlaneToPoint<'_> {
    fn accepts(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        pair.has_normals()
    }

    fn rows(&self, _: &Scene<'_>, pair: &Pair, rows: &mut Rows) {
        self.0.count(4);
        let offset = pair.offset();
        let turn = pair.source_normal.cross(&offset);
        rows.push(Row { turn, ..Row::along(pair.source_normal, pair.source_normal.dot(&offset)) });
    }
}

/// A Cholesky solution of the normal equations.
struct Cholesky<'a>(&'a Calls);

impl Minimiser for Cholesky<'_> {
    fn step(&self, system: &System<'_>, _free: &Matrix6<f64>) -> Result<Vector6<f64>, icp_registration::Error> {
        self.0.count(5);
        let equations = system.normal_equations();
        let matrix = equations.matrix + Matrix6::identity() * (1e-12 * equations.matrix.trace());
        let solved = matrix.cholesky().map(|factor| factor.solve(&equations.gradient));
        Ok(-solved.unwrap_or_else(Vector6::zeros))
    }
}

#[test]
fn every_part_can_come_from_outside() {
    let (a, b) = (look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]), look_at([-1.0, -1.2, 1.2], [1.6, 1.4, 0.9]));
    let (room, camera) = (Room::furnished(), Pinhole { width: 88, height: 72, focal_px: 76.0 });
    let target = IcpTarget::new(cloud(&room, &camera, &a, 1.0, 1)).unwrap();
    let source = cloud(&room, &camera, &b, 1.0, 2);
    let truth = a.inverse() * b;
    let calls = Calls::default();
    let registration = Registration {
        selection: Box::new(EvenPoints(&calls)),
        weighting: vec![Box::new(Obliqueness(&calls))],
        rejection: vec![Box::new(NotTooFar(&calls))],
        metric: Box::new(PlaneToPoint(&calls)),
        minimisation: Box::new(Cholesky(&calls)),
        alternatives: Vec::new(),
        ..Registration::new(NearestPlane(&calls, &target))
    };
    let result = registration.align(&source, &(disturbance(0.1, 4.0, 3) * truth)).unwrap();
    let (mm, degrees) = pose_error(&result.target_from_source, &truth);
    println!("{mm:.2} mm {degrees:.4} deg, {} iterations {:?}", result.iterations, result.stop);
    // Half the points of an eighth of a frame: 176x144 pixels give 0.5 mm, an eighth of the points three times that.
    assert!(mm < 5.0 && degrees < 0.15, "{mm} mm {degrees} degrees");
    assert!(result.is_trustworthy());
    for (part, count) in calls.0.iter().enumerate() {
        assert!(count.load(Ordering::Relaxed) > 0, "part {part} was not asked");
    }
}

#[test]
fn parts_that_name_missing_points_are_refused() {
    struct Beyond;
    impl PointSelection for Beyond {
        fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>, icp_registration::Error> {
            Ok(vec![0, scene.source.len()])
        }
    }
    struct Nowhere<'a>(&'a IcpTarget);
    impl PointMatching for Nowhere<'_> {
        fn target(&self) -> TargetSurface<'_> {
            TargetSurface { cloud: Some(self.0.cloud()), radius_m: 1.0, spacing_m: 0.1, exact_normals: false }
        }

        fn partner(&self, query: &Query) -> Partner {
            let (point, normal) = (query.moved, query.normal);
            Partner { found: true, target: Some(usize::MAX), point, normal, margin_m: 0.0 }
        }
    }
    let camera = Pinhole { width: 44, height: 36, focal_px: 38.0 };
    let source = cloud(&Room::furnished(), &camera, &look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]), 1.0, 1);
    let target = IcpTarget::new(source.clone()).unwrap();
    let identity = nalgebra::Isometry3::identity();
    let mut registration = Registration::new(Nowhere(&target));
    let missing =
        |result: Result<_, icp_registration::Error>| matches!(result, Err(icp_registration::Error::NoSuchPoint { .. }));
    assert!(missing(registration.align(&source, &identity).map(|_| ())));
    registration.selection = Box::new(Beyond);
    assert!(missing(registration.align(&source, &identity).map(|_| ())));
}
