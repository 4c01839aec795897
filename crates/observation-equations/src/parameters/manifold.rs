use std::any::Any;
use std::fmt::Debug;

/// A set of parameter values that is stepped in its tangent space.
///
/// A block stores `ambient_dimension` numbers; the adjustment estimates steps of `tangent_dimension` numbers, and
/// all covariances are those of the tangent step at the adjusted values.
pub trait Manifold: Any + Debug + Send + Sync {
    /// Number of stored values.
    fn ambient_dimension(&self) -> usize;

    /// Number of unknowns.
    fn tangent_dimension(&self) -> usize;

    /// `out = values ⊞ step`. `values` and `out` are ambient, `step` is tangent.
    fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]);

    /// `out = values ⊟ reference`: the tangent step with `reference ⊞ out = values`.
    fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]);

    /// Derivative of `(values ⊞ δ) ⊟ reference` with respect to δ at δ = 0, row-major
    /// `tangent_dimension × tangent_dimension`. Used by priors. The default differentiates numerically, good to
    /// about ten digits for values of order one.
    fn minus_jacobian(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        let n = self.tangent_dimension();
        let step_size = f64::EPSILON.cbrt();
        let mut step = vec![0.0; n];
        let mut moved = vec![0.0; self.ambient_dimension()];
        let (mut ahead, mut behind) = (vec![0.0; n], vec![0.0; n]);
        for column in 0..n {
            step[column] = step_size;
            self.plus(values, &step, &mut moved);
            self.minus(&moved, reference, &mut ahead);
            step[column] = -step_size;
            self.plus(values, &step, &mut moved);
            self.minus(&moved, reference, &mut behind);
            step[column] = 0.0;
            for row in 0..n {
                out[row * n + column] = (ahead[row] - behind[row]) / (2.0 * step_size);
            }
        }
    }

    /// Says what is wrong with values that do not lie on the manifold. The values are finite and of the right length.
    fn check(&self, values: &[f64]) -> Result<(), &'static str> {
        let _ = values;
        Ok(())
    }

    /// Name of a component of the tangent step, where it has one (otherwise its number is used).
    fn tangent_name(&self, component: usize) -> Option<&str> {
        let _ = component;
        None
    }
}

/// The vector space of `n` numbers: step and difference are plain sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Euclidean(pub usize);

impl Manifold for Euclidean {
    fn ambient_dimension(&self) -> usize {
        self.0
    }

    fn tangent_dimension(&self) -> usize {
        self.0
    }

    fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]) {
        for ((out, value), step) in out.iter_mut().zip(values).zip(step) {
            *out = value + step;
        }
    }

    fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        for ((out, value), reference) in out.iter_mut().zip(values).zip(reference) {
            *out = value - reference;
        }
    }

    fn minus_jacobian(&self, _values: &[f64], _reference: &[f64], out: &mut [f64]) {
        for (index, out) in out.iter_mut().enumerate() {
            *out = if index % (self.0 + 1) == 0 { 1.0 } else { 0.0 };
        }
    }
}
