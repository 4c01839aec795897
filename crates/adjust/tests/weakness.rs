//! Near-defects are named.

use crate::common::{Plan, network};
use adjust::{
    Adjustment, BlockId, Covariance, DatumDefect, Error, LinearObservation, ParameterBlock, SolveOptions,
    WeaknessOptions,
};
use approx::assert_relative_eq;

/// An offset and a shift that nearly all observations contain together (their difference only with `share`), a scale and
/// a slope of the same kind, and a parameter that is known well.
fn adjustment(share: f64) -> (Adjustment<'static>, [BlockId; 3]) {
    let mut a = Adjustment::new();
    let range = a.add_block(ParameterBlock::euclidean([0.0, 0.0]).with_parameter_names(["d0", "d1"]));
    let station = a.add_block(ParameterBlock::euclidean([0.0, 0.0]).with_parameter_names(["tz", "slope"]));
    let good = a.add_block(ParameterBlock::euclidean([0.0]).named("good"));
    let group = a.add_group("ranges");
    for i in 0..40 {
        let t = f64::from(i) / 20.0 - 1.0;
        // Odd in i and free of the mean, so that the two pairs have nothing to do with each other.
        let small = share * if i % 2 == 0 { 1.0 } else { -1.0 };
        let terms = [
            (range, vec![1.0, t * 1000.0]),
            (station, vec![1.0 + small, t * (1.0 + 10.0 * small)]),
            (good, vec![if i % 4 < 2 { 1.0 } else { -1.0 }]),
        ];
        a.add_observation(group, LinearObservation::new(0.0, terms), &Covariance::from_sigma(0.01)).unwrap();
    }
    (a, [range, station, good])
}

#[test]
fn several_weak_combinations_are_named_with_their_size() {
    let (a, blocks) = adjustment(1e-3);
    let solution = a.solve(&SolveOptions::default()).unwrap();
    let found = solution.near_defects(&WeaknessOptions::default()).unwrap();
    assert_eq!((found.count, found.combinations.len()), (2, 2));
    let [first, second] = &found.combinations[..] else { panic!() };
    assert_eq!(first.inflation, found.largest_inflation);
    let names = |defect: &adjust::NearDefect| {
        let mut names: Vec<_> = defect.combination.terms.iter().map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names
    };
    assert_eq!(names(first), ["d0", "tz"]);
    assert_eq!(names(second), ["d1", "slope"]);
    // Two columns at the angle φ: the smallest eigenvalue of [[1, cos φ], [cos φ, 1]] is 2 sin²(φ/2), φ = 1e-3. The
    // alternating signs are correlated with t by a few hundredths.
    assert_relative_eq!(first.inflation, 1.0 / (2.0_f64.sqrt() * 0.5e-3), max_relative = 5e-3);
    assert_relative_eq!(second.inflation, 1.0 / (2.0_f64.sqrt() * 0.5e-2), max_relative = 5e-3);
    // Nearly all the uncertainty of the leading parameter comes from the combination; alone it would be 0.01/√40.
    assert_relative_eq!(first.deviation, first.leading_deviations.0, max_relative = 1e-3);
    assert_relative_eq!(first.leading_deviations.1, 0.01 / 40.0_f64.sqrt(), max_relative = 1e-3);
    let (block, component, name) = &first.leading;
    assert_eq!(
        solution.standard_deviations(*block, adjust::Scale::Prior).unwrap()[*component],
        first.leading_deviations.0
    );
    assert!(blocks[..2].contains(block) && (name == "d0" || name == "tz"));
    assert!(first.correlations[0].2 < -0.999_999);
    // The functional is known no better than the inflation says.
    let variance = |&(one, i, a): &(BlockId, usize, f64)| -> f64 {
        let with = |&(other, j, b): &(BlockId, usize, f64)| {
            a * b * solution.covariance_between(one, other, adjust::Scale::Prior).unwrap()[(i, j)]
        };
        first.functional.iter().map(with).sum()
    };
    let variance: f64 = first.functional.iter().map(variance).sum();
    assert_relative_eq!(variance.sqrt(), first.inflation, max_relative = 1e-9);
    // In metre per 1000: the scale's deviation is in its own unit.
    let d1 = solution.standard_deviations(blocks[0], adjust::Scale::Prior).unwrap()[1];
    let slope = solution.standard_deviations(blocks[1], adjust::Scale::Prior).unwrap()[1];
    assert_relative_eq!(slope / d1, 1000.0, max_relative = 1e-2);
    let text = first.to_string();
    assert!(text.contains("d0") && text.contains("tz") && text.contains("hold or weight"), "{text}");
    // A stricter limit, fewer reported.
    let one = WeaknessOptions { max_count: 1, ..WeaknessOptions::default() };
    let limited = solution.near_defects(&one).unwrap();
    assert_eq!((limited.count, limited.combinations.len()), (2, 1));
    // With the pairs well separated nothing is weak.
    let sound = adjustment(0.3).0.solve(&SolveOptions::default()).unwrap();
    let none = sound.near_defects(&WeaknessOptions::default()).unwrap();
    assert!(none.combinations.is_empty() && none.largest_inflation < 10.0 && none.largest_inflation > 1.0);
}

#[test]
fn chosen_blocks_carry_what_the_others_leave_open() {
    let (a, [range, station, good]) = adjustment(1e-3);
    let solution = a.solve(&SolveOptions::default()).unwrap();
    let of = |blocks: Vec<BlockId>| {
        solution.near_defects(&WeaknessOptions { blocks: Some(blocks), ..WeaknessOptions::default() })
    };
    // One side of each pair alone is as weakly known.
    let found = of(vec![range]).unwrap();
    assert_eq!(found.combinations.len(), 2);
    assert_eq!(found.combinations[0].combination.terms, [("d0".to_owned(), 1.0)]);
    assert_relative_eq!(found.largest_inflation, 1e3, max_relative = 1e-2);
    assert!(found.combinations[0].advice().contains("d0"));
    assert_eq!(of(vec![good]).unwrap().count, 0);
    assert_eq!(of(vec![]).unwrap().largest_inflation, 1.0);
    assert_eq!(of(vec![station, good, range]).unwrap().count, 2);
    assert!(of(vec![good, good]).is_err());
    let bad = WeaknessOptions { inflation: f64::NAN, ..WeaknessOptions::default() };
    assert!(matches!(solution.near_defects(&bad), Err(Error::Option { .. })));
}

#[test]
fn a_network_is_examined_as_the_diagnosis_does() {
    let mut n = network(&Plan { seed: 7, stations: 4, points: 9, seen: 9, ranges: true, disturbance: 0.02 });
    let points = n.points.clone();
    n.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    let solution = n.adjustment.solve(&SolveOptions::default()).unwrap();
    // All blocks together are the whole matrix, in any order.
    let mut blocks = n.stations.clone();
    blocks.extend(&n.points);
    let joint = solution.covariance_of(&blocks, adjust::Scale::Posterior).unwrap();
    assert_relative_eq!(joint, solution.covariance_matrix(adjust::Scale::Posterior).unwrap(), max_relative = 1e-12);
    let swapped = solution.covariance_of(&[n.points[1], n.stations[0]], adjust::Scale::Posterior).unwrap();
    assert_relative_eq!(swapped[(0, 4)], joint[(24 + 3, 1)], max_relative = 1e-9);
    assert!(solution.covariance_of(&[n.points[1], n.points[1]], adjust::Scale::Prior).is_err());
    let all = WeaknessOptions { inflation: 1.0, max_count: 1, ..WeaknessOptions::default() };
    let found = solution.near_defects(&all).unwrap();
    let diagnosis = solution.diagnosis(0.9);
    // Power iteration stops at 1e-6 of the eigenvalue.
    assert_relative_eq!(found.largest_inflation, diagnosis.weakest_inflation, max_relative = 1e-4);
    let stations = WeaknessOptions { blocks: Some(n.stations.clone()), ..all };
    assert!(solution.near_defects(&stations).unwrap().largest_inflation <= found.largest_inflation * (1.0 + 1e-9));
}
