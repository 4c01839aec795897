//! The model of the checkerboard example against differences, and its adjustment against a simulated truth.

use crate::plumb_bob;
use crate::plumb_bob::ImagePoint;
use crate::start;
use adjust::{Adjustment, Covariance, ParameterBlock, Scale, SolveOptions, check_jacobian};
use nalgebra::{Isometry3, Point3, Vector3};

const TRUTH: [f64; 9] = [536.0, 534.0, 342.0, 235.0, -0.265, -0.047, 0.0018, -0.0003, 0.25];

fn board() -> impl Iterator<Item = Point3<f64>> {
    (0..54).map(|i| Point3::new(f64::from(i % 9), f64::from(i / 9), 0.0) * 25.0)
}

fn poses() -> impl Iterator<Item = Isometry3<f64>> {
    (0..6).map(|i| {
        let i = f64::from(i);
        let tilt = Vector3::new(0.5 * (1.1 * i).sin(), 0.5 * (1.7 * i).cos(), 0.9 * i);
        let pose = Isometry3::new(Vector3::zeros(), tilt);
        let centre = pose * Point3::new(100.0, 62.5, 0.0);
        Isometry3::new(Vector3::new(10.0 * i - 30.0, 5.0, 420.0 + 40.0 * i) - centre.coords, tilt)
    })
}

fn exact(pose: &Isometry3<f64>, board: Point3<f64>, a: &mut Adjustment<'_>) -> [f64; 2] {
    let blocks = [a.add_block(ParameterBlock::pose(pose)), a.add_block(ParameterBlock::euclidean(TRUTH))];
    let values: Vec<Vec<f64>> = blocks.iter().map(|&b| a.values(b).unwrap().to_vec()).collect();
    let mut residual = [0.0; 2];
    let point = ImagePoint { blocks, board, observed: [0.0; 2] };
    adjust::Observation::evaluate(&point, &[&values[0], &values[1]], &mut residual, None).unwrap();
    residual.map(|v| -v)
}

#[test]
fn the_jacobian_is_that_of_differences() {
    let mut a = Adjustment::new();
    let blocks = [ParameterBlock::pose(&poses().nth(2).unwrap()), ParameterBlock::euclidean(TRUTH)];
    let ids = blocks.each_ref().map(|block| a.add_block(block.clone()));
    let point = ImagePoint { blocks: ids, board: Point3::new(25.0, 100.0, 0.0), observed: [300.0, 200.0] };
    let check = check_jacobian(&point, &blocks).unwrap();
    assert!(check.worst < 1e-6, "{check:?}");
}

#[test]
fn exact_corners_give_the_camera_back() {
    let mut scratch = Adjustment::new();
    let mut a = Adjustment::new();
    let camera = a.add_block(
        ParameterBlock::euclidean([640.0, 640.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0, 0.0])
            .with_parameter_names(plumb_bob::NAMES),
    );
    let group = a.add_group("corners");
    for truth in poses() {
        let corners: Vec<_> = board().map(|b| ([b.x, b.y], exact(&truth, b, &mut scratch))).collect();
        let pose = a.add_block(ParameterBlock::pose(&start::pose(&corners, 640.0, [319.5, 239.5]).unwrap()));
        for ([x, y], observed) in corners {
            let point = ImagePoint { blocks: [pose, camera], board: Point3::new(x, y, 0.0), observed };
            a.add_observation(group, point, &Covariance::from_sigmas(&[0.1; 2])).unwrap();
        }
    }
    let solution = a.solve(&SolveOptions::default()).unwrap();
    let deviations = solution.standard_deviations(camera, Scale::Prior).unwrap();
    for ((found, truth), deviation) in solution.values(camera).unwrap().iter().zip(TRUTH).zip(deviations) {
        // Exact observations: what is left is the tolerance of the iteration, 1e-8 standard deviations.
        assert!((found - truth).abs() < 1e-6 * deviation, "{found} {truth} {deviation}");
    }
}
