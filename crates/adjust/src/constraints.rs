use crate::datum::inner_constraints;
use crate::layout::Layout;
use crate::linearisation::Linearisation;
use crate::{Adjustment, Result};

/// Linearised constraints `B dx = d` over all unknowns: those of the user first, inner constraints last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Constraints {
    /// Number of rows.
    pub(crate) count: usize,
    /// First row that is an inner constraint.
    pub(crate) first_inner: usize,
    /// B, row-major, `count × unknowns`.
    pub(crate) rows: Vec<f64>,
    /// d.
    pub(crate) right: Vec<f64>,
}

impl Constraints {
    /// The constraints at the linearised values.
    pub(crate) fn new(
        adjustment: &Adjustment<'_>,
        layout: &Layout,
        linearisation: &Linearisation,
        values: &[f64],
    ) -> Result<Self> {
        let unknowns = layout.unknowns;
        let mut rows = vec![0.0; layout.constraint_rows * unknowns];
        for place in &layout.constraints {
            let (active, jacobian) = (layout.active(place), &linearisation.jacobian[place.jacobian_range()]);
            for (index, row) in place.rows().enumerate() {
                for (entry, &(_, column)) in active.iter().enumerate() {
                    rows[row * unknowns + column] += jacobian[index * active.len() + entry];
                }
            }
        }
        let mut right = linearisation.constraint.clone();
        let first_inner = layout.constraint_rows;
        if let Some(datum) = &adjustment.datum {
            rows.extend(inner_constraints(datum, adjustment, layout, values)?);
            right.resize(first_inner + datum.defect.count(), 0.0);
        }
        Ok(Self { count: right.len(), first_inner, rows, right })
    }

    /// The rows for unknowns in units of `scale` (`dx = scale · y`), each divided by its length, and `d` with them.
    /// The inner constraints are made orthonormal among themselves: in scaled unknowns they are oblique.
    /// The third list holds the lengths.
    pub(crate) fn scaled(&self, scale: &[f64]) -> ScaledConstraints {
        let unknowns = scale.len();
        let mut rows: Vec<f64> = self.rows.clone();
        let mut right = self.right.clone();
        let mut lengths = vec![0.0; self.count];
        for index in 0..self.count {
            let (before, rest) = rows.split_at_mut(index * unknowns);
            let row = &mut rest[..unknowns];
            row.iter_mut().zip(scale).for_each(|(b, s)| *b *= s);
            if index >= self.first_inner {
                // Twice is enough (Kahan, Parlett) for rows that were not yet dependent.
                for _ in 0..2 {
                    for other in before[self.first_inner * unknowns..].chunks_exact(unknowns) {
                        let shared: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                        row.iter_mut().zip(other).for_each(|(a, b)| *a -= shared * b);
                    }
                }
            }
            let length = row.iter().map(|b| b * b).sum::<f64>().sqrt();
            if length > 0.0 {
                for b in row {
                    *b /= length;
                }
                right[index] /= length;
            }
            lengths[index] = length;
        }
        ScaledConstraints { count: self.count, first_inner: self.first_inner, rows, right, lengths }
    }
}

/// See [`Constraints::scaled`].
#[derive(Debug, Clone, Default)]
pub(crate) struct ScaledConstraints {
    pub(crate) count: usize,
    pub(crate) first_inner: usize,
    pub(crate) rows: Vec<f64>,
    pub(crate) right: Vec<f64>,
    pub(crate) lengths: Vec<f64>,
}
