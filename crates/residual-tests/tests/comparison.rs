//! Tests of differences: their level where nothing changed, and the band of the correction against sampling.

use crate::support::{INTERVAL, model, track, walls};
use error_models::RangeErrorModel;
use nalgebra::DMatrix;
use range_calibration::{RangeCalibration, RangeTermOptions, Scale, estimate_range_terms};
use range_image::ImageFormat;
use residual_tests::{CorrectionSide, Error, ParameterSet, compare_corrections, compare_parameters};

const LEVEL: f64 = 0.05;

fn calibration(seed: u64) -> RangeCalibration {
    let distances: Vec<f64> = track().into_iter().step_by(2).collect();
    estimate_range_terms(&walls(&model(None), &distances, 0.005, seed), INTERVAL, &RangeTermOptions::default()).unwrap()
}

fn parameters(calibration: &RangeCalibration) -> ParameterSet {
    ParameterSet {
        names: calibration.estimated_names().to_vec(),
        values: calibration.model().parameter_values(),
        covariance: calibration.covariance(Scale::Prior).unwrap(),
    }
}

fn side(calibration: &RangeCalibration) -> CorrectionSide<'_> {
    let covariance = calibration.covariance(Scale::Prior).unwrap();
    CorrectionSide { model: calibration.model(), covariance, principal_point_mm: [0.0; 2] }
}

#[test]
fn calibrations_of_one_camera_differ_at_the_stated_level() {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let (runs, mut single, mut joint, mut curve, mut chi_squared) = (150_u64, 0, 0, 0, 0.0);
    for run in 0..runs {
        let [first, second] = [2 * run, 2 * run + 1].map(calibration);
        let found = compare_parameters(&parameters(&first), &parameters(&second), LEVEL).unwrap();
        let test = found.joint.unwrap();
        assert_eq!(test.degrees, 9);
        chi_squared += test.statistic / runs as f64;
        joint += usize::from(test.significant);
        single += usize::from(found.differences.iter().any(|difference| difference.significant));
        curve += usize::from(compare_corrections(&side(&first), &side(&second), &format, LEVEL).unwrap().significant);
    }
    println!(
        "of {runs} pairs: any parameter {single}, joint {joint}, correction {curve}; mean chi squared {chi_squared:.2}"
    );
    // 7.5 of 150 are expected, with a deviation of 2.7; three of them.
    assert!((1..=16).contains(&joint), "{joint}");
    assert!(single <= 16, "{single}");
    // The band holds for every function of the parameters, of which corrections at a grid of places are some.
    assert!(curve <= 8, "{curve}");
    // The mean of 150 chi-squared numbers of 9 degrees of freedom scatters by sqrt(18 / 150) = 0.35; three of them.
    assert!((chi_squared - 9.0).abs() < 1.05, "{chi_squared}");
}

#[test]
fn a_change_of_the_correction_is_found_where_it_is() {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let first = calibration(1);
    let mut changed: RangeErrorModel = first.model().clone();
    changed.terms.e1 += 1e-3;
    let second = CorrectionSide { model: &changed, ..side(&first) };
    let found = compare_corrections(&side(&first), &second, &format, LEVEL).unwrap();
    // x reaches 3.5 mm at the first and the last column.
    assert!(found.significant && (found.largest.difference_m.abs() - 3.5e-3).abs() < 1e-9, "{found:?}");
    let column = found.largest.pixel[0];
    assert!(!(1.0..=174.0).contains(&column), "{column}");
    assert!(found.along_range.iter().all(|at| at.difference_m.abs() < 1e-12), "nothing in the centre");
    changed.range_span_m = Some([90.0, 95.0]);
    let apart = CorrectionSide { model: &changed, ..side(&first) };
    let answer = compare_corrections(&side(&first), &apart, &format, LEVEL);
    assert!(matches!(answer, Err(Error::NotComparable { .. })), "{answer:?}");
}

#[test]
fn held_missing_and_dependent_parameters_are_told_apart() {
    let set = |names: &[&str], values: &[f64], covariance: DMatrix<f64>| ParameterSet {
        names: names.iter().map(|name| (*name).to_owned()).collect(),
        values: values.to_vec(),
        covariance,
    };
    let one = set(&["a", "b", "c"], &[1.0, 2.0, 3.0], DMatrix::zeros(3, 3));
    let mut covariance = DMatrix::zeros(3, 3);
    // b and d depend on each other exactly.
    covariance.view_mut((0, 0), (2, 2)).fill(0.04);
    let other = set(&["b", "d", "c"], &[2.1, 5.0, 3.5], covariance);
    let found = compare_parameters(&one, &other, LEVEL).unwrap();
    assert_eq!(
        (found.only_first.as_slice(), found.only_second.as_slice()),
        (&["a".to_owned()][..], &["d".to_owned()][..])
    );
    let [b, c] = found.differences.as_slice() else { panic!("b and c are common") };
    assert!(!b.significant && (b.difference - 0.1).abs() < 1e-12 && (b.sigma - 0.2).abs() < 1e-12);
    assert!(c.significant && c.p_value.is_nan(), "held in both, at different values");
    assert_eq!(found.joint.unwrap().degrees, 1);
    let both = compare_parameters(&set(&["b", "d"], &[0.0, 0.0], DMatrix::zeros(2, 2)), &other, LEVEL).unwrap();
    assert_eq!(both.joint.unwrap().degrees, 1, "one combination of two is known exactly");
    let mut twice = other.clone();
    twice.names[1] = "b".to_owned();
    assert!(matches!(compare_parameters(&one, &twice, LEVEL), Err(Error::DuplicateName { .. })));
    assert!(matches!(compare_parameters(&one, &other, 0.0), Err(Error::OutOfDomain { name: "level", .. })));
}
