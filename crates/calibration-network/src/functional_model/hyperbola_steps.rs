//! The amplitude hyperbola (Eq. 15) in the numbers that observations determine about linearly.
//!
//! h1, h2 and h3 of a network change together by a third of their values where one of them is known to a third: their
//! confidence region is bent like a banana, and an ellipsoid at the estimate misses the truth by many deviations. The level
//! `L = −h1 / h2` at large amplitudes, the height `Z = 1 / √h3` at amplitude zero and the slope `p = h2 / h3` have a region
//! that is an ellipsoid. Adjustments step in these, and the covariance of h1, h2, h3 follows from theirs with the second
//! order of `h1 = −L p / Z²`, `h2 = p / Z²`, `h3 = 1 / Z²`.

use std::collections::BTreeSet;

use adjust::{Manifold, ParameterBlock};
use error_models::{AmplitudeHyperbola, RangeErrorModel};
use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::functional_model::setup::RangeSet;
use crate::functional_model::terms::range_values;

/// The block of a range set.
pub fn range_block(model: &RangeErrorModel, estimated: &BTreeSet<String>) -> ParameterBlock {
    let values = range_values(model);
    if has_natural_steps(model, estimated) {
        let linear = values.len() - 3;
        ParameterBlock::manifold(values, RangeTermSteps { linear })
    } else {
        ParameterBlock::euclidean(values)
    }
}

/// Whether the hyperbola of a range set is stepped in level, height and slope: where all of it is estimated, from
/// coefficients that have these.
pub fn has_natural_steps(model: &RangeErrorModel, estimated: &BTreeSet<String>) -> bool {
    let all = AmplitudeHyperbola::NAMES.iter().all(|name| estimated.contains(*name));
    all && model.hyperbola.is_some_and(|hyperbola| Natural::of([hyperbola.h1, hyperbola.h2, hyperbola.h3]).is_some())
}

/// Turns derivatives by h1, h2, h3, the last of a row, into those by level, height and slope.
pub fn by_steps(values: &[f64], row: &mut [f64]) {
    let (Some(values), Some(row)) = (values.last_chunk::<3>(), row.last_chunk_mut::<3>()) else { return };
    let Some(natural) = Natural::of(*values) else { return };
    *row = (natural.jacobian().transpose() * Vector3::from(*row)).into();
}

/// Covariance of calibration parameters from that of the steps of their blocks.
pub struct OfTerms {
    /// Mean squares and products of the errors of their values.
    pub full: DMatrix<f64>,
    /// Its first-order part, which derivatives by the parameters carry to corrections.
    pub first_order: DMatrix<f64>,
    /// Derivative of the parameters by the steps.
    pub by_steps: DMatrix<f64>,
}

/// The covariance of the named parameters. `sets` are the range sets as they were at the start and as they were found.
pub fn covariance_of_terms(
    names: &[String],
    sets: [&[RangeSet]; 2],
    estimated: &BTreeSet<String>,
    steps: &DMatrix<f64>,
) -> OfTerms {
    let count = names.len();
    let mut by_steps = DMatrix::identity(count, count);
    let mut second = DMatrix::zeros(count, count);
    let [start, found] = sets;
    let natural = start.iter().zip(found).filter(|(start, _)| has_natural_steps(&start.model, estimated));
    for (_, set) in natural {
        let place = |name: &str| names.iter().position(|known| *known == format!("{name}{}", set.suffix));
        let [Some(first), Some(_), Some(_)] = AmplitudeHyperbola::NAMES.map(place) else { continue };
        let Some(natural) = set.model.hyperbola.and_then(|h| Natural::of([h.h1, h.h2, h.h3])) else { continue };
        let own: Matrix3<f64> = steps.fixed_view::<3, 3>(first, first).into_owned();
        by_steps.fixed_view_mut::<3, 3>(first, first).copy_from(&natural.jacobian());
        second.fixed_view_mut::<3, 3>(first, first).copy_from(&natural.second_order(&own));
    }
    let first_order = &by_steps * steps * by_steps.transpose();
    OfTerms { full: &first_order + second, first_order, by_steps }
}

/// Level and height (metre) and slope (metre per unit of amplitude) of a hyperbola.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Natural {
    level: f64,
    height: f64,
    slope: f64,
}

impl Natural {
    /// `None` where the coefficients have none: h3 is not positive, or h2 vanishes.
    fn of([h1, h2, h3]: [f64; 3]) -> Option<Self> {
        let natural = Self { level: -h1 / h2, height: 1.0 / h3.sqrt(), slope: h2 / h3 };
        let usable = h3 > 0.0 && [natural.level, natural.height, natural.slope].iter().all(|value| value.is_finite());
        usable.then_some(natural)
    }

    fn coefficients(&self) -> [f64; 3] {
        let h3 = self.height.powi(-2);
        [-self.level * self.slope * h3, self.slope * h3, h3]
    }

    /// Derivatives of h1, h2, h3 (rows) by level, height, slope.
    fn jacobian(&self) -> Matrix3<f64> {
        let Self { level, height, slope } = *self;
        let (h3, by_height) = (height.powi(-2), -2.0 * height.powi(-3));
        Matrix3::new(
            -slope * h3,
            -level * slope * by_height,
            -level * h3,
            0.0,
            slope * by_height,
            h3,
            0.0,
            by_height,
            0.0,
        )
    }

    /// Second derivatives of h1, h2, h3 by level, height, slope.
    fn curvatures(&self) -> [Matrix3<f64>; 3] {
        let Self { level, height, slope } = *self;
        let (h3, first, second) = (height.powi(-2), -2.0 * height.powi(-3), 6.0 * height.powi(-4));
        let mixed = Matrix3::new(
            0.0,
            -slope * first,
            -h3,
            -slope * first,
            -level * slope * second,
            -level * first,
            -h3,
            -level * first,
            0.0,
        );
        let of_h2 = Matrix3::new(0.0, 0.0, 0.0, 0.0, slope * second, first, 0.0, first, 0.0);
        let of_h3 = Matrix3::new(0.0, 0.0, 0.0, 0.0, second, 0.0, 0.0, 0.0, 0.0);
        [mixed, of_h2, of_h3]
    }

    /// What the second order adds to the mean squares and products of the errors of h1, h2, h3, where level, height and slope
    /// have normal errors of this covariance Q: with curvatures H, `tr(Hᵢ Q Hⱼ Q) / 2 + tr(Hᵢ Q) tr(Hⱼ Q) / 4`.
    fn second_order(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        let spread = self.curvatures().map(|curvature| curvature * covariance);
        Matrix3::from_fn(|i, j| 0.5 * (spread[i] * spread[j]).trace() + 0.25 * spread[i].trace() * spread[j].trace())
    }
}

/// A range set's values: linear terms, then h1, h2, h3, stepped in level, height and slope.
#[derive(Debug, Clone, Copy)]
struct RangeTermSteps {
    /// Number of linear terms.
    linear: usize,
}

/// Level, height and slope in place of the coefficients at the end of a set's values; NaN where these have none.
fn naturals(values: &[f64]) -> [f64; 3] {
    let natural = values.last_chunk::<3>().and_then(|values| Natural::of(*values));
    natural.map_or([f64::NAN; 3], |natural| [natural.level, natural.height, natural.slope])
}

impl Manifold for RangeTermSteps {
    fn ambient_dimension(&self) -> usize {
        self.linear + 3
    }

    fn tangent_dimension(&self) -> usize {
        self.linear + 3
    }

    fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]) {
        for ((out, value), step) in out.iter_mut().zip(values).zip(step) {
            *out = value + step;
        }
        let natural = naturals(values);
        let [level, height, slope] = std::array::from_fn(|i| natural[i] + step[self.linear + i]);
        out[self.linear..].copy_from_slice(&Natural { level, height, slope }.coefficients());
    }

    fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        for ((out, value), reference) in out.iter_mut().zip(values).zip(reference) {
            *out = value - reference;
        }
        let (from, to) = (naturals(reference), naturals(values));
        (0..3).for_each(|i| out[self.linear + i] = to[i] - from[i]);
    }

    fn check(&self, values: &[f64]) -> Result<(), &'static str> {
        let has_none = naturals(values).iter().any(|value| value.is_nan());
        if has_none { Err("a hyperbola whose h3 is not positive has no height") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const TRUE: [f64; 3] = [1.1e-4, 0.0286, 156.0];

    #[test]
    fn there_and_back() {
        let back = Natural::of(TRUE).unwrap().coefficients();
        for (there, back) in TRUE.iter().zip(back) {
            assert!((there - back).abs() < 1e-12 * there.abs(), "{there} {back}");
        }
    }

    #[test]
    fn derivatives_are_those_of_the_coefficients() {
        let natural = Natural::of(TRUE).unwrap();
        let sizes = [natural.level, natural.height, natural.slope];
        let moved = |column: usize, step: f64| {
            let mut moved = sizes;
            moved[column] += step * sizes[column];
            Natural { level: moved[0], height: moved[1], slope: moved[2] }
        };
        for column in 0..3 {
            let step = 1e-5;
            let (ahead, behind) = (moved(column, step), moved(column, -step));
            for row in 0..3 {
                let numeric = (ahead.coefficients()[row] - behind.coefficients()[row]) / (2.0 * step * sizes[column]);
                let analytic = natural.jacobian()[(row, column)];
                assert!((numeric - analytic).abs() < 1e-7 * (TRUE[row] / sizes[column]).abs(), "{row} {column}");
                let slopes = (ahead.jacobian() - behind.jacobian()) / (2.0 * step * sizes[column]);
                for other in 0..3 {
                    let scale = (TRUE[row] / (sizes[column] * sizes[other])).abs();
                    let off = slopes[(row, other)] - natural.curvatures()[row][(other, column)];
                    assert!(off.abs() < 1e-7 * scale, "{row} {other} {column}: {off}");
                }
            }
        }
    }

    #[test]
    fn steps_lead_where_they_should() {
        let steps = RangeTermSteps { linear: 1 };
        let values = [0.3, TRUE[0], TRUE[1], TRUE[2]];
        let step = [0.1, 0.002, 0.01, 1e-5];
        let (mut there, mut back) = ([0.0; 4], [0.0; 4]);
        steps.plus(&values, &step, &mut there);
        steps.minus(&there, &values, &mut back);
        for (step, back) in step.iter().zip(back) {
            assert!((step - back).abs() < 1e-12, "{step} {back}");
        }
        assert!(steps.check(&[0.0, 0.0, 1.0, -1.0]).is_err());
    }
}
