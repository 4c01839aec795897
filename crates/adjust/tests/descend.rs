//! Descents that are broken off, and bundle adjustment in the large.

use crate::bal;
use crate::range_camera::{LABORATORY, range_camera_network};
use adjust::{Adjustment, Covariance, Error, LinearObservation, Method, ParameterBlock, SolveOptions, check_jacobian};

#[test]
fn a_descent_needs_no_datum_and_ends_near_the_solution() {
    let free = range_camera_network(&LABORATORY);
    let network = range_camera_network(&LABORATORY).free();
    let solution = network.adjustment.solve(&SolveOptions::default()).unwrap();
    let options = SolveOptions::default();
    let descent = free.adjustment.descend(&options, 1e-6).unwrap();
    // Steps of which the last took a millionth away leave about as much.
    assert!(descent.objective() < solution.vtpv() * (1.0 + 1e-4), "{} {}", descent.objective(), solution.vtpv());
    assert!(descent.objective() > solution.vtpv() * (1.0 - 1e-9));
    assert_eq!(descent.trace().len(), descent.iterations());
    assert!(descent.values(free.parameters).unwrap()[2] > 7.9);
    assert!(descent.pose(free.stations[0]).is_ok() && descent.pose(free.parameters).is_err());
}

#[test]
fn what_cannot_descend_is_refused() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0]));
    let group = a.add_group("g");
    a.add_observation(group, LinearObservation::new(0.0, [(x, [1.0])]), &Covariance::from_sigma(1.0)).unwrap();
    let options = SolveOptions::default();
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = a.descend(&options, tolerance).unwrap_err();
        assert!(matches!(error, Error::Option { name: "objective_tolerance", .. }), "{error}");
    }
    let undamped = SolveOptions { method: Method::GaussNewton, ..SolveOptions::default() };
    assert!(matches!(a.descend(&undamped, 1e-6).unwrap_err(), Error::Option { .. }));
    let short = SolveOptions { max_iterations: 0, ..SolveOptions::default() };
    assert!(matches!(a.descend(&short, 1e-6).unwrap_err(), Error::NotConverged { iterations: 0, .. }));
    assert!(a.descend(&options, 1e-6).unwrap().objective() < 1e-4);
    a.hold(x).unwrap();
    assert_eq!(a.descend(&options, 1e-6).unwrap().iterations(), 0);
}

#[test]
fn jacobians_of_image_points_are_right() {
    let mut a = Adjustment::new();
    let camera = ParameterBlock::euclidean([0.02, -0.3, 0.1, 0.4, -0.1, 0.7, 400.0, -0.1, 0.02]);
    let point = ParameterBlock::euclidean([0.3, -0.4, -5.0]);
    let blocks = [a.add_block(camera.clone()), a.add_block(point.clone())];
    let check = check_jacobian(&bal::ImagePoint { blocks, observed: [3.0, 4.0] }, &[camera, point]).unwrap();
    // Pixels are some hundred units: rounding of the differences shows at 1e-6.
    assert!(check.worst < 1e-5, "{check:?}");
}

#[test]
fn ladybug_reaches_the_cost_that_others_reach() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/bal/problem-16-22106-pre.txt");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: {path} is missing");
        return;
    };
    let bundle = bal::bundle(&text).unwrap();
    let options = SolveOptions::default();
    let descent = bundle.adjustment.descend(&options, 1e-6).unwrap();
    // Published for this problem: 1.803390e4.
    let cost = 0.5 * descent.objective();
    assert!((cost - 18_033.90).abs() < 0.05, "{cost}");
    assert!(descent.iterations() <= 20, "{}", descent.iterations());
}
