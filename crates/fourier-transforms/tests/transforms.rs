//! Transforms against sums, and forth and back.

use std::f64::consts::TAU;

use fourier_transforms::num_complex::Complex;
use fourier_transforms::{DoublePlanner, FftDirection, SinglePlanner};

/// A line without symmetries.
fn line(length: usize) -> Vec<Complex<f64>> {
    (0..length).map(|k| Complex::new((k * k % 17) as f64 - 8.0, (k * 31 % 23) as f64 - 11.0)).collect()
}

/// The coefficients as they are defined.
fn summed(line: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let turn = -TAU / line.len() as f64;
    let wave = |k: usize, m: usize| Complex::from_polar(1.0, (k * m % line.len()) as f64 * turn);
    (0..line.len()).map(|m| line.iter().enumerate().map(|(k, value)| value * wave(k, m)).sum()).collect()
}

#[test]
fn transforms_are_the_sums_and_go_back() {
    for length in [1, 2, 7, 30, 64, 90, 360] {
        let line = line(length);
        let expected = summed(&line);
        // Values of some ten; the rounding of sums of as many terms as the line is long.
        let scale = 20.0 * length as f64;
        let mut double = line.clone();
        let mut planner = DoublePlanner::new();
        planner.plan(length, FftDirection::Forward).process(&mut double);
        assert!(double.iter().zip(&expected).all(|(a, b)| (a - b).norm() < 1e-14 * scale), "{length}");
        planner.plan(length, FftDirection::Inverse).process(&mut double);
        assert!(double.iter().zip(&line).all(|(a, b)| (a / length as f64 - b).norm() < 1e-13), "{length}");

        let mut single: Vec<Complex<f32>> = line.iter().map(|z| Complex::new(z.re as f32, z.im as f32)).collect();
        SinglePlanner::new().plan(length, FftDirection::Forward).process(&mut single);
        let wide = |z: &Complex<f32>| Complex::new(f64::from(z.re), f64::from(z.im));
        assert!(single.iter().zip(&expected).all(|(a, b)| (wide(a) - b).norm() < 1e-6 * scale), "{length}");
    }
}

#[test]
fn lines_behind_each_other_are_transformed_one_by_one() {
    let plan = DoublePlanner::new().plan(12, FftDirection::Forward);
    let mut together = [line(12), line(12)].concat();
    plan.process(&mut together);
    assert_eq!(together[..12], together[12..]);
}
