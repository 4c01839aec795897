//! Constraints in the eliminated form.

use nalgebra::{DMatrix, DVector, Dyn, LU};

use crate::equations::constraints::Constraints;
use crate::equations::elimination::EliminatedFactor;
use crate::equations::normal::Singular;

/// The factorised `N' = N + BᵀB + E Eᵀ` differs from N by the user's constraints B, which does no harm, and by the motions
/// E of the reduced unknowns, which stand for the datum. The step x is the one with
///
/// ```text
/// N' x + Bᵀμ + G γ − E ν = g + Bᵀd,   B x = d,   Gᵀx = 0,   Eᵀx = ν
/// ```
///
/// so that E is without effect. Without damping this is the S-transformation to the datum of the points G.
#[derive(Debug, Clone)]
pub(crate) struct Border {
    /// B, Gᵀ and Eᵀ over all unknowns, row-major.
    rows: Vec<f64>,
    /// d.
    right: Vec<f64>,
    /// `N'⁻¹ [Bᵀ, G, −E]`, column-major.
    columns: Vec<f64>,
    multipliers: LU<f64, Dyn, Dyn>,
    user: usize,
    inner: usize,
}

impl Border {
    pub(crate) fn new(factor: &EliminatedFactor, constraints: &Constraints) -> Result<Self, Singular> {
        let (n, user) = (factor.scale.len(), constraints.first_inner);
        let inner = constraints.count - user;
        let scaled = constraints.scaled(&factor.scale);
        let mut rows = scaled.rows;
        for row in rows.chunks_exact_mut(n) {
            row.iter_mut().zip(&factor.scale).for_each(|(b, s)| *b /= s);
        }
        let own = &factor.reduced;
        let order = own.scale.len();
        for row in own.constraints.rows.chunks_exact(order.max(1)).skip(user) {
            let unscaled: Vec<f64> = row.iter().zip(&own.scale).map(|(e, s)| e / s).collect();
            let start = rows.len();
            rows.resize(start + n, 0.0);
            factor.structure.scatter(&unscaled, &mut rows[start..], 1);
        }
        let columns = Self::influence(factor, &rows, user, inner);
        let count = user + 2 * inner;
        let product = |i: usize, j: usize| dot(&rows[i * n..(i + 1) * n], &columns[j * n..(j + 1) * n]);
        let mut system = DMatrix::from_fn(count, count, product);
        (user + inner..count).for_each(|i| system[(i, i)] += 1.0);
        let multipliers = system.lu();
        if !multipliers.is_invertible() {
            return Err(Singular::Normal);
        }
        Ok(Self { rows, right: scaled.right, columns, multipliers, user, inner })
    }

    fn influence(factor: &EliminatedFactor, rows: &[f64], user: usize, inner: usize) -> Vec<f64> {
        let (n, own) = (factor.scale.len(), &factor.reduced);
        let order = own.scale.len();
        let mut columns = vec![0.0; (user + 2 * inner) * n];
        let points = user * n..(user + inner) * n;
        columns[points.clone()].copy_from_slice(&rows[points.clone()]);
        factor.solve_columns(&mut columns[points]);
        // What acts on reduced unknowns alone has been solved for there already.
        let mut reduced = own.influence.clone();
        for (index, column) in reduced.chunks_exact_mut(order.max(1)).enumerate() {
            let sign = if index < user { 1.0 } else { -1.0 };
            column.iter_mut().zip(&own.scale).for_each(|(y, s)| *y *= sign * s);
        }
        let count = user + inner;
        let mut panel = vec![0.0; count * n];
        factor.backward(&mut panel, &dense_matrices::transposed(&reduced, order), count);
        let whole = dense_matrices::transposed(&panel, count);
        columns[..user * n].copy_from_slice(&whole[..user * n]);
        columns[(user + inner) * n..].copy_from_slice(&whole[user * n..]);
        columns
    }

    /// Replaces a gradient by its step, which takes away `share` of what the user's constraints miss.
    pub(crate) fn solve(&self, factor: &EliminatedFactor, step: &mut [f64], share: f64) {
        let n = step.len();
        for (row, d) in self.rows.chunks_exact(n).zip(&self.right).take(self.user) {
            step.iter_mut().zip(row).for_each(|(g, b)| *g += b * d * share);
        }
        factor.solve_columns(step);
        let mut miss =
            DVector::from_iterator(self.user + 2 * self.inner, self.rows.chunks_exact(n).map(|row| dot(row, step)));
        (0..self.user).for_each(|i| miss[i] -= self.right[i] * share);
        if self.multipliers.solve_mut(&mut miss) {
            for (column, multiplier) in self.columns.chunks_exact(n).zip(miss.iter()) {
                step.iter_mut().zip(column).for_each(|(x, f)| *x -= multiplier * f);
            }
        }
    }

    /// The motions `H = N'⁻¹ E` of the whole network, one after another.
    pub(crate) fn motions(&self, n: usize) -> Vec<f64> {
        self.columns[(self.user + self.inner) * n..].iter().map(|h| -h).collect()
    }

    /// The inner constraints `Gᵀ` that are held, one after another.
    pub(crate) fn datum(&self, n: usize) -> &[f64] {
        &self.rows[self.user * n..(self.user + self.inner) * n]
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
