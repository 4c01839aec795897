//! Gross errors and kernels.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use adjust::{
    Adjustment, BlockId, Covariance, GroupId, Kernel, LinearObservation, ParameterBlock, Scale, SolveOptions,
};
use approx::assert_relative_eq;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// A line y = 1 + 2 t with noise of 0.1, and every tenth height 5 off.
fn line() -> (Adjustment<'static>, BlockId, GroupId) {
    let mut rng = Pcg64::seed_from_u64(5);
    let mut a = Adjustment::new();
    let line = a.add_block(ParameterBlock::euclidean([0.0, 0.0]));
    let group = a.add_group("heights");
    for i in 0..100 {
        let t = 0.1 * f64::from(i);
        let noise: f64 = rng.sample(StandardNormal);
        let blunder = if i % 10 == 3 { 5.0 } else { 0.0 };
        let height = LinearObservation::new(1.0 + 2.0 * t + 0.1 * noise + blunder, [(line, [1.0, t])]);
        a.add_observation(group, height, &Covariance::from_sigma(0.1)).unwrap();
    }
    (a, line, group)
}

#[test]
fn kernels_resist_gross_errors() {
    let options = SolveOptions::default();
    let (mut a, line, group) = line();
    let plain = a.solve(&options).unwrap();
    assert!((plain.values(line).unwrap()[0] - 1.0).abs() > 0.3);
    // Huber keeps a bounded pull of 1.345 sigma from each of the 10 %; the redescending kernels keep next to none.
    for (kernel, tolerance) in [
        (Kernel::Huber(1.345), 0.06),
        (Kernel::Cauchy(2.385), 0.05),
        (Kernel::Tukey(4.685), 0.05),
        (Kernel::GemanMcClure(3.0), 0.05),
    ] {
        a.set_kernel(group, kernel).unwrap();
        // Redescending kernels start from the answer of the convex one.
        let solution = a.solve(&options).unwrap();
        a.set_values(line, solution.values(line).unwrap()).unwrap();
        assert_relative_eq!(solution.values(line).unwrap()[0], 1.0, epsilon = tolerance);
        assert_relative_eq!(solution.values(line).unwrap()[1], 2.0, epsilon = tolerance);
        let numbers = solution.redundancy_numbers();
        assert_relative_eq!(numbers.iter().sum::<f64>(), 98.0, epsilon = 1e-9);
        let w = solution.standardised_residuals(Scale::Prior).unwrap();
        for (i, (&weight, w)) in solution.weights().iter().zip(w).enumerate() {
            assert_eq!(weight < 0.1, i % 10 == 3, "{kernel:?} {i} {weight}");
            assert_eq!(w.abs() > 10.0, i % 10 == 3, "{kernel:?} {i} {w}");
        }
        // The normal equations of the reweighted problem hold: Σ w v = 0.
        let pull: f64 = solution.weights().iter().zip(solution.residuals()).map(|(w, v)| w * v).sum();
        assert!(pull.abs() < 1e-6, "{pull}");
    }
}

#[test]
fn a_rejected_observation_is_as_if_it_had_not_been() {
    let (mut a, line, group) = line();
    a.set_values(line, &[1.0, 2.0]).unwrap();
    a.set_kernel(group, Kernel::Tukey(1e3)).unwrap();
    a.solve(&SolveOptions::default()).unwrap();
    a.set_kernel(group, Kernel::Tukey(4.685)).unwrap();
    let solution = a.solve(&SolveOptions::default()).unwrap();
    let rejected = solution.weights().iter().filter(|w| **w == 0.0).count();
    assert_eq!(rejected, 10);
    // Its residual is a prediction's: σ_v² = C + A Q Aᵀ > C, and its redundancy number is 1.
    assert_relative_eq!(solution.redundancy_numbers()[3], 1.0, epsilon = 1e-15);
    let sigma = solution.residual_deviations(Scale::Prior).unwrap()[3];
    let q = solution.covariance(line, Scale::Prior).unwrap();
    let t = 0.3;
    let predicted = 0.01 + q[(0, 0)] + 2.0 * t * q[(0, 1)] + t * t * q[(1, 1)];
    assert_relative_eq!(sigma * sigma, predicted, epsilon = 1e-12);
}
