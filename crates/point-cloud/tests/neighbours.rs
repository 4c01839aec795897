//! Nearest neighbours against a search through all points.

use nalgebra::Point3;
use point_cloud::{Error, NeighbourTree};
use proptest::prelude::*;
use rigid_pose::InputError;

/// Coordinates on a coarse lattice: many ties, duplicates and points with a coordinate in common.
fn lattice_points() -> impl Strategy<Value = Vec<Point3<f64>>> {
    prop::collection::vec(prop::array::uniform3(0i8..6), 1..400)
        .prop_map(|v| v.into_iter().map(|p| Point3::from(p.map(f64::from))).collect())
}

fn all_by_distance(points: &[Point3<f64>], query: &Point3<f64>) -> Vec<(f64, usize)> {
    let mut all: Vec<(f64, usize)> = points.iter().enumerate().map(|(i, p)| ((p - query).norm(), i)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn agrees_with_a_search_through_all(points in lattice_points(), q in prop::array::uniform3(-1i8..8)) {
        let query = Point3::from(q.map(f64::from));
        let tree = NeighbourTree::new(&points).unwrap();
        let all = all_by_distance(&points, &query);
        let nearest = tree.nearest(&query).unwrap();
        prop_assert_eq!((nearest.distance_m, nearest.index), all[0]);
        let k = tree.k_nearest(&query, 7).unwrap();
        prop_assert_eq!(k.len(), points.len().min(7));
        for (found, (distance, _)) in k.iter().zip(&all) {
            prop_assert!((found.distance_m - distance).abs() < 1e-15);
        }
    }
}

#[test]
fn what_the_tree_would_answer_wrongly_is_refused() {
    assert!(matches!(NeighbourTree::new(&[]), Err(Error::Input(InputError::Empty { .. }))));
    let bad = [Point3::origin(), Point3::new(0.0, f64::NAN, 0.0)];
    assert!(matches!(NeighbourTree::new(&bad), Err(Error::Input(InputError::NonFinite { index: 1, .. }))));
    let huge = [Point3::new(1e200, 0.0, 0.0)];
    assert!(matches!(NeighbourTree::new(&huge), Err(Error::Input(InputError::NonFinite { index: 0, .. }))));
    let tree = NeighbourTree::new(&[Point3::origin()]).unwrap();
    assert_eq!((tree.len(), tree.is_empty()), (1, false));
    let nan = Point3::new(f64::NAN, 0.0, 0.0);
    assert!(tree.nearest(&nan).is_err() && tree.k_nearest(&nan, 1).is_err());
    assert!(tree.k_nearest(&Point3::origin(), 0).unwrap().is_empty());
}

#[test]
fn a_thousand_equal_points_give_the_first() {
    let tree = NeighbourTree::new(&vec![Point3::new(1.0, 1.0, 1.0); 1000]).unwrap();
    assert_eq!(tree.nearest(&Point3::origin()).unwrap().index, 0);
    assert_eq!(tree.k_nearest(&Point3::new(1.0, 1.0, 1.0), 2000).unwrap().len(), 1000);
}
