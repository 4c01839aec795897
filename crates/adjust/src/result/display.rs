//! A solution as a short table.

use std::any::Any;
use std::fmt;

use crate::{BlockId, Manifold, RigidPose, Scale, Solution};
use observation_equations::Euclidean;

/// Parameters listed; of larger adjustments the first ones.
const LISTED: usize = 60;
/// Significance level of the verdict.
const LEVEL: f64 = 0.05;

/// The parameters with their prior-scaled standard deviations, and the global test at the 5 % level. Of more than 60
/// parameters the first are listed. The values of a pose are its translation and its rotation vector (radian).
impl fmt::Display for Solution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = vec![["parameter", "value", "sigma"].map(str::to_owned)];
        let mut left_out = 0;
        for (index, block) in self.blocks.iter().enumerate() {
            let count = block.tangent_dimension();
            if rows.len() + count > LISTED + 1 {
                left_out += count;
                continue;
            }
            let ambient = self.values(BlockId::new(index)).unwrap_or_default();
            let values = shown(&*block.manifold, ambient);
            let sigmas = self.standard_deviations(BlockId::new(index), Scale::Prior).unwrap_or_default();
            for (component, sigma) in sigmas.into_iter().enumerate() {
                let is_held = block.held[component];
                let [value, sigma] = digits(values.get(component).copied(), if is_held { f64::NAN } else { sigma });
                let sigma = if is_held { "held".to_owned() } else { sigma };
                rows.push([block.parameter_name(index, component), value, sigma]);
            }
        }
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let (first, second, third) = (width(0), width(1), width(2));
        for [name, value, sigma] in &rows {
            writeln!(f, "{name:first$}  {value:>second$}  {sigma:>third$}")?;
        }
        if left_out > 0 {
            writeln!(f, "and {left_out} more parameters")?;
        }
        let (values, redundancy) = (self.observations(), self.redundancy());
        writeln!(f, "{values} observed values, redundancy {redundancy}, v'Pv {:.6e}", self.vtpv())?;
        match self.global_test(LEVEL) {
            Ok(test) => write!(f, "{test}"),
            Err(error) => write!(f, "no global test: {error}"),
        }
    }
}

/// Values that belong to the components of the tangent step; none for manifolds that have no such values.
fn shown(manifold: &dyn Manifold, values: &[f64]) -> Vec<f64> {
    let kind: &dyn Any = manifold;
    if kind.is::<Euclidean>() {
        return values.to_vec();
    }
    if !kind.is::<RigidPose>() {
        return Vec::new();
    }
    let mut out = vec![0.0; manifold.tangent_dimension()];
    manifold.minus(values, &RigidPose::values(&nalgebra::Isometry3::identity()), &mut out);
    out
}

/// A value to the second digit of its standard deviation.
fn digits(value: Option<f64>, sigma: f64) -> [String; 2] {
    let Some(value) = value else { return ["-".to_owned(), format!("{sigma:.1e}")] };
    if !(sigma > 0.0 && sigma.is_finite()) {
        return [format!("{value}"), format!("{sigma}")];
    }
    let order = sigma.log10().floor();
    if (-9.0..6.0).contains(&order) && value.abs() < 1e9 {
        let decimals = (1.0 - order).max(0.0) as usize;
        return [format!("{value:.decimals$}"), format!("{sigma:.decimals$}")];
    }
    let shown = (value.abs().max(sigma).log10().floor() - order + 1.0).clamp(1.0, 16.0) as usize;
    [format!("{value:.shown$e}"), format!("{sigma:.1e}")]
}
