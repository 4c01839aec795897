use crate::equations::datum::{inner_constraints, point_motions};
use crate::equations::structure::Structure;
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::Linearisation;
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
    /// How the points move in the directions that the inner constraints hold, row-major, `inner × unknowns`. Only for
    /// the eliminated form, see [`crate::equations::datum::point_motions`].
    pub(crate) motions: Vec<f64>,
}

impl Constraints {
    /// The constraints at the linearised values.
    pub(crate) fn new(
        adjustment: &Adjustment<'_>,
        layout: &Layout,
        linearisation: &Linearisation,
        values: &[f64],
        structure: Option<&Structure>,
    ) -> Result<Self> {
        let unknowns = layout.unknowns;
        let mut rows = vec![0.0; layout.constraint_rows * unknowns];
        for place in &layout.constraints {
            let jacobian = &linearisation.jacobian[place.jacobian_range()];
            // Parts of an observation do not repeat a column.
            for (row, entries) in place.rows().zip(jacobian.chunks_exact(place.width.max(1))) {
                for (a, column) in entries.iter().zip(layout.columns(place)) {
                    rows[row * unknowns + column] = *a;
                }
            }
        }
        let mut right = linearisation.constraint.clone();
        let first_inner = layout.constraint_rows;
        let mut motions = Vec::new();
        if let Some(datum) = &adjustment.datum {
            rows.extend(inner_constraints(datum, adjustment, layout, values)?);
            right.resize(first_inner + datum.defect.count(), 0.0);
            if let Some(structure) = structure {
                motions = point_motions(datum, adjustment, layout, values, structure);
            }
        }
        Ok(Self { count: right.len(), first_inner, rows, right, motions })
    }

    /// Those of the user alone.
    pub(crate) fn of_user(&self) -> Self {
        let count = self.first_inner;
        let unknowns = self.rows.len() / self.count.max(1);
        let (rows, right) = (self.rows[..count * unknowns].to_vec(), self.right[..count].to_vec());
        Self { count, first_inner: count, rows, right, motions: Vec::new() }
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

    /// Lagrange multipliers λ of the user's constraints that balance `force = Bᵀλ` in the least-squares sense.
    pub(crate) fn multipliers(&self, scale: &[f64], force: &[f64]) -> Vec<f64> {
        let scaled = self.scaled(scale);
        let (n, k) = (scale.len(), self.count);
        let row = |index: usize| &scaled.rows[index * n..(index + 1) * n];
        let mut gram = vec![0.0; k * k];
        for column in 0..k {
            for other in column..k {
                gram[column * k + other] = row(column).iter().zip(row(other)).map(|(a, b)| a * b).sum();
            }
        }
        let project = |index: usize| row(index).iter().zip(scale).zip(force).map(|((b, s), f)| b * s * f).sum();
        let mut out: Vec<f64> = (0..k).map(project).collect();
        if !dense_matrices::cholesky(&mut gram, k) {
            // Dependent constraints: the factorisation says so with their names.
            return Vec::new();
        }
        dense_matrices::solve_cholesky(&gram, k, &mut out, 1);
        out.iter_mut().zip(&scaled.lengths).for_each(|(multiplier, length)| *multiplier /= length);
        out.truncate(self.first_inner);
        out
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
