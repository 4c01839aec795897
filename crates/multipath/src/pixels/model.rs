//! Two paths seen by all frequencies: `z = a exp(i w r1) + b exp(i w r2)`.

use crate::pixels::pixel::{Pixel, Term};

/// `[a, b, r1, r2]`: amplitudes with the frequency response taken off, and ranges in metre.
pub(crate) type Parameters = [f64; 4];

/// A range that is known beforehand, with its inverse variance (1/m^2); weight 0 for one that is not.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Prior {
    pub range_m: f64,
    pub weight: f64,
}

/// Normal equations of the weighted least squares.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalEquations {
    pub matrix: [[f64; 4]; 4],
    pub right: [f64; 4],
    pub chi_squared: f64,
}

/// Value (real, imaginary) at one frequency, and its derivatives with respect to the parameters.
pub(crate) fn value_and_jacobian(parameters: &Parameters, wavenumber: f64) -> ([f64; 2], [[f64; 2]; 4]) {
    let [a, b, r1, r2] = *parameters;
    let (s1, c1) = (wavenumber * r1).sin_cos();
    let (s2, c2) = (wavenumber * r2).sin_cos();
    let (da, db) = (wavenumber * a, wavenumber * b);
    let value = [a * c1 + b * c2, a * s1 + b * s2];
    (value, [[c1, s1], [c2, s2], [-da * s1, da * c1], [-db * s2, db * c2]])
}

/// Sum of squared, weighted residuals with those of the priors.
pub(crate) fn chi_squared(pixel: &Pixel, parameters: &Parameters, priors: &[Prior; 2]) -> f64 {
    let [a, b, r1, r2] = *parameters;
    let misfit = |term: &Term| {
        let (s1, c1) = (term.wavenumber * r1).sin_cos();
        let (s2, c2) = (term.wavenumber * r2).sin_cos();
        let (re, im) = (term.re - a * c1 - b * c2, term.im - a * s1 - b * s2);
        term.weight * (re * re + im * im)
    };
    let of_priors = priors.iter().zip([r1, r2]).map(|(prior, range)| prior.weight * (prior.range_m - range).powi(2));
    pixel.terms().iter().map(misfit).sum::<f64>() + of_priors.sum::<f64>()
}

/// Normal equations about the parameters.
pub(crate) fn normal_equations(pixel: &Pixel, parameters: &Parameters, priors: &[Prior; 2]) -> NormalEquations {
    let mut normal = NormalEquations { matrix: [[0.0; 4]; 4], right: [0.0; 4], chi_squared: 0.0 };
    for term in pixel.terms() {
        let (value, jacobian) = value_and_jacobian(parameters, term.wavenumber);
        let residual = [term.re - value[0], term.im - value[1]];
        let dot = |a: &[f64; 2], b: &[f64; 2]| term.weight * (a[0] * b[0] + a[1] * b[1]);
        for (i, left) in jacobian.iter().enumerate() {
            normal.right[i] += dot(left, &residual);
            for (entry, right) in normal.matrix[i].iter_mut().zip(&jacobian) {
                *entry += dot(left, right);
            }
        }
        normal.chi_squared += dot(&residual, &residual);
    }
    for (prior, i) in priors.iter().zip([2, 3]) {
        let residual = prior.range_m - parameters[i];
        normal.matrix[i][i] += prior.weight;
        normal.right[i] += prior.weight * residual;
        normal.chi_squared += prior.weight * residual * residual;
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let parameters = [120.0, 35.0, 2.3, 3.9];
        for wavenumber in [0.4, 1.7, 3.4] {
            let (_, jacobian) = value_and_jacobian(&parameters, wavenumber);
            for (index, analytic) in jacobian.iter().enumerate() {
                let step = 1e-6 * parameters[index];
                let shifted = |sign: f64| {
                    let mut moved = parameters;
                    moved[index] += sign * step;
                    value_and_jacobian(&moved, wavenumber).0
                };
                let (plus, minus) = (shifted(1.0), shifted(-1.0));
                for part in 0..2 {
                    let numeric = (plus[part] - minus[part]) / (2.0 * step);
                    // Rounding of values near 150 over the step.
                    let tolerance = 1e-13 / step + 1e-8 * analytic[part].abs();
                    assert!((numeric - analytic[part]).abs() < tolerance, "{index}: {numeric} {}", analytic[part]);
                }
            }
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_misfit() {
        let mut pixel = Pixel::default();
        for (index, wavenumber) in [0.8, 2.1, 3.3].into_iter().enumerate() {
            let re = 10.0 - 7.0 * index as f64;
            pixel.push(Term { wavenumber, re, im: 4.0, weight: 0.5 + wavenumber });
        }
        let (parameters, priors) = ([9.0, 4.0, 1.1, 1.9], [Prior { range_m: 1.3, weight: 7.0 }, Prior::default()]);
        let normal = normal_equations(&pixel, &parameters, &priors);
        assert!((normal.chi_squared - chi_squared(&pixel, &parameters, &priors)).abs() < 1e-10);
        for index in 0..4 {
            let shifted = |step: f64| {
                let mut moved = parameters;
                moved[index] += step;
                chi_squared(&pixel, &moved, &priors)
            };
            let numeric = (shifted(1e-5) - shifted(-1e-5)) / 2e-5;
            // Central differences: third derivatives of some 1e4 times 1e-10 / 6.
            assert!((numeric + 2.0 * normal.right[index]).abs() < 1e-5, "{index}: {numeric}");
        }
    }
}
