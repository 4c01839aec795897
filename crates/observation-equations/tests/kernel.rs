//! Weights are derivatives, and the usual parameters are 95 % efficient.

use approx::assert_relative_eq;
use observation_equations::Kernel;

#[test]
fn weights_are_the_derivatives() {
    for kernel in
        [Kernel::LeastSquares, Kernel::Huber(1.3), Kernel::Cauchy(2.4), Kernel::Tukey(4.7), Kernel::GemanMcClure(2.0)]
    {
        for square in [0.0, 0.5, 1.6, 1.8, 9.0, 21.0, 23.0, 400.0] {
            let (rho, weight) = kernel.evaluate(square);
            let step = 1e-5;
            let ahead = kernel.evaluate(square + step).0;
            // One-sided difference: its own error is of the order of the step.
            assert_relative_eq!((ahead - rho) / step, weight, epsilon = 1e-4);
            assert!(rho <= square && (0.0..=1.0).contains(&weight));
        }
    }
}

/// Efficiency of the mean with the kernel for normal errors: `E[sψ]² / E[ψ²]` with ψ = s w (by Stein's identity
/// E[ψ'] = E[sψ]).
fn efficiency(kernel: Kernel) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for index in -10_000..10_000 {
        let s = f64::from(index) * 1e-3;
        let density = (-0.5 * s * s).exp() * 1e-3 / (2.0 * std::f64::consts::PI).sqrt();
        let influence = s * kernel.evaluate(s * s).1;
        product += s * influence * density;
        square += influence * influence * density;
    }
    product * product / square
}

#[test]
fn usual_parameters_are_ninety_five_percent_efficient() {
    // The constants of the literature are given with four digits.
    for kernel in [Kernel::Huber(1.345), Kernel::Cauchy(2.385), Kernel::Tukey(4.685), Kernel::GemanMcClure(3.787)] {
        assert_relative_eq!(efficiency(kernel), 0.95, epsilon = 2e-4);
    }
    assert_relative_eq!(efficiency(Kernel::LeastSquares), 1.0, epsilon = 1e-9);
}

#[test]
fn influence_is_bounded_or_redescends() {
    let influence = |kernel: Kernel, s: f64| s * kernel.evaluate(s * s).1;
    assert_relative_eq!(influence(Kernel::Huber(1.345), 1e6), 1.345, max_relative = 1e-12);
    assert!(influence(Kernel::Cauchy(2.385), 1e6) < 1e-5);
    assert_eq!(influence(Kernel::Tukey(4.685), 4.686).to_bits(), 0.0_f64.to_bits());
    assert!(influence(Kernel::GemanMcClure(3.787), 1e3) < 1e-6);
}

#[test]
fn parameters_are_positive() {
    assert!(Kernel::Huber(0.0).check().is_err());
    assert!(Kernel::Tukey(f64::NAN).check().is_err());
    Kernel::LeastSquares.check().unwrap();
}
