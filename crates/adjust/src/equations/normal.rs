use crate::equations::constraints::{Constraints, ScaledConstraints};
use crate::linearised::layout::{Layout, Place};
use crate::linearised::linearisation::Linearisation;
use crate::{Error, Result};

/// Normal equations `N dx = g`, `N = AᵀPA`, `g = AᵀPv`.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations {
    pub(crate) unknowns: usize,
    /// Lower triangle, column-major.
    pub(crate) matrix: Vec<f64>,
    pub(crate) gradient: Vec<f64>,
}

impl NormalEquations {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { unknowns, matrix: vec![0.0; unknowns * unknowns], gradient: vec![0.0; unknowns] }
    }

    /// Sums over all observations in the order of adding.
    pub(crate) fn accumulate(&mut self, layout: &Layout, linearisation: &Linearisation) {
        self.matrix.fill(0.0);
        self.gradient.fill(0.0);
        for place in &layout.observations {
            let jacobian = &linearisation.jacobian[place.jacobian_range()];
            for (row, entries) in place.rows().zip(jacobian.chunks_exact(place.width.max(1))) {
                let (residual, weight) = (linearisation.whitened[row], linearisation.weights[row]);
                self.add_row(layout, place, entries, residual, weight);
            }
        }
    }

    fn add_row(&mut self, layout: &Layout, place: &Place, entries: &[f64], residual: f64, weight: f64) {
        let parts = layout.parts(place);
        for (index, part) in parts.iter().enumerate() {
            for (entry, column) in part.entries().zip(part.columns()) {
                let a = weight * entries[entry];
                self.gradient[column] += a * residual;
                let target = &mut self.matrix[column * self.unknowns..(column + 1) * self.unknowns];
                // Columns ascend: only the lower triangle is touched.
                let own = target[column..part.columns().end].iter_mut().zip(&entries[entry..]);
                own.for_each(|(sum, b)| *sum += a * b);
                for other in &parts[index + 1..] {
                    let target = target[other.columns()].iter_mut().zip(&entries[other.entries()]);
                    target.for_each(|(sum, b)| *sum += a * b);
                }
            }
        }
    }

    pub(crate) fn diagonal(&self) -> Vec<f64> {
        (0..self.unknowns).map(|i| self.matrix[i * self.unknowns + i]).collect()
    }

    pub(crate) fn scale(&self) -> Vec<f64> {
        unit_scale(&self.diagonal())
    }
}

/// What makes a diagonal one: `dx = scale · y`. An unknown without observations keeps its unit.
pub(crate) fn unit_scale(diagonal: &[f64]) -> Vec<f64> {
    diagonal.iter().map(|&n| if n > 0.0 { 1.0 / n.sqrt() } else { 1.0 }).collect()
}

/// Factor of `S(N + λD)S + BᵀB` with unit columns, and of the constraints' Schur complement.
#[derive(Debug, Clone)]
pub(crate) struct NormalFactor {
    pub(crate) scale: Vec<f64>,
    /// Cholesky factor L, column-major, lower.
    factor: Vec<f64>,
    pub(crate) constraints: ScaledConstraints,
    /// `N'⁻¹ Bᵀ`, column-major.
    pub(crate) influence: Vec<f64>,
    /// `K = B N'⁻¹ Bᵀ`, full, and its Cholesky factor.
    complement: Vec<f64>,
    complement_factor: Vec<f64>,
}

/// Why the normal equations could not be factorised.
#[derive(Debug)]
pub(crate) enum Singular {
    /// Some unknowns are not determined.
    Normal,
    /// The constraints depend on each other.
    Constraints(Error),
}

impl NormalFactor {
    /// `damping` are λ and the scale that the damping is measured in.
    pub(crate) fn new(
        normal: &NormalEquations,
        constraints: &Constraints,
        damping: Option<(f64, &[f64])>,
    ) -> std::result::Result<Self, Singular> {
        let (n, scale) = (normal.unknowns, normal.scale());
        let mut matrix = normal.matrix.clone();
        if let Some((lambda, reference)) = damping {
            for (i, (own, reference)) in scale.iter().zip(reference).enumerate() {
                matrix[i * n + i] += damping_of(lambda, *own, *reference);
            }
        }
        Self::of_matrix(matrix, scale, constraints)
    }

    /// From the lower triangle of a matrix that is used up, and the scale of its unknowns.
    pub(crate) fn of_matrix(
        mut factor: Vec<f64>,
        scale: Vec<f64>,
        constraints: &Constraints,
    ) -> std::result::Result<Self, Singular> {
        let n = scale.len();
        let constraints = constraints.scaled(&scale);
        equilibrate(&mut factor, &scale, &constraints);
        if !dense_matrices::cholesky(&mut factor, n) {
            return Err(Singular::Normal);
        }
        let mut influence = constraints.rows.clone();
        dense_matrices::solve_cholesky(&factor, n, &mut influence, constraints.count);
        let complement = complement(&constraints, &influence, n);
        let complement_factor = factor_complement(&complement, &constraints).map_err(Singular::Constraints)?;
        Ok(Self { scale, factor, constraints, influence, complement, complement_factor })
    }

    /// The step that follows `gradient` and takes away `share` of what the constraints miss.
    pub(crate) fn solve(&self, gradient: &[f64], share: f64) -> Vec<f64> {
        let (n, k) = (self.scale.len(), self.constraints.count);
        let mut step: Vec<f64> = gradient.iter().zip(&self.scale).map(|(g, s)| g * s).collect();
        for (row, d) in self.constraint_rows().zip(&self.constraints.right) {
            step.iter_mut().zip(row).for_each(|(y, b)| *y += b * d * share);
        }
        dense_matrices::solve_cholesky(&self.factor, n, &mut step, 1);
        let miss = |(row, d): (&[f64], &f64)| row.iter().zip(&step).map(|(b, y)| b * y).sum::<f64>() - d * share;
        let mut multipliers: Vec<f64> = self.constraint_rows().zip(&self.constraints.right).map(miss).collect();
        dense_matrices::solve_cholesky(&self.complement_factor, k, &mut multipliers, 1);
        for (column, multiplier) in self.influence.chunks_exact(n.max(1)).zip(&multipliers) {
            step.iter_mut().zip(column).for_each(|(y, f)| *y -= f * multiplier);
        }
        step.iter_mut().zip(&self.scale).for_each(|(y, s)| *y *= s);
        step
    }

    /// Solves with the equilibrated matrix alone, in scaled unknowns.
    pub(crate) fn solve_scaled(&self, right: &mut [f64]) {
        let n = self.scale.len();
        dense_matrices::solve_cholesky(&self.factor, n, right, right.len() / n.max(1));
    }

    /// 1-norm of the equilibrated matrix.
    pub(crate) fn norm(&self, normal: &NormalEquations) -> f64 {
        let n = self.scale.len();
        let mut matrix = normal.matrix.clone();
        equilibrate(&mut matrix, &self.scale, &self.constraints);
        dense_matrices::mirror_lower(&mut matrix, n);
        let sums = matrix.chunks_exact(n.max(1)).map(|column| column.iter().map(|v| v.abs()).sum::<f64>());
        sums.fold(0.0, f64::max)
    }

    fn constraint_rows(&self) -> impl Iterator<Item = &[f64]> {
        self.constraints.rows.chunks_exact(self.scale.len().max(1))
    }

    /// Cofactor matrix of the scaled unknowns, `N'⁻¹ − N'⁻¹Bᵀ K⁻¹ B N'⁻¹`, and the trace of `N'⁻¹`.
    pub(crate) fn cofactor(&self) -> (Vec<f64>, f64) {
        let (n, k) = (self.scale.len(), self.constraints.count);
        let mut cofactor = dense_matrices::inverse_of_cholesky(&self.factor, n);
        let trace = (0..n).map(|i| cofactor[i * n + i]).sum();
        // With K = M Mᵀ and F = N'⁻¹Bᵀ the correction is (F M⁻ᵀ)(F M⁻ᵀ)ᵀ.
        let mut reduced = self.influence.clone();
        for column in 0..k {
            for before in 0..column {
                let share = self.complement_factor[before * k + column];
                let (left, right) = reduced.split_at_mut(column * n);
                right[..n].iter_mut().zip(&left[before * n..]).for_each(|(a, b)| *a -= share * b);
            }
            let pivot = self.complement_factor[column * k + column];
            reduced[column * n..(column + 1) * n].iter_mut().for_each(|a| *a /= pivot);
        }
        for direction in reduced.chunks_exact(n.max(1)) {
            for (column, &factor) in direction.iter().enumerate() {
                let target = &mut cofactor[column * n..(column + 1) * n];
                target.iter_mut().zip(direction).for_each(|(q, f)| *q -= f * factor);
            }
        }
        (cofactor, trace)
    }

    /// Refuses inner constraints in directions that the observations already determine: only where they remove a
    /// defect and nothing else is `G'ᵀ N'⁻¹ G'` the identity.
    pub(crate) fn check_datum(&self) -> Result<()> {
        let (k, first) = (self.constraints.count, self.constraints.first_inner);
        let held = k - first;
        let mut block = vec![0.0; held * held];
        for column in 0..held {
            for row in 0..held {
                block[column * held + row] = self.complement[(column + first) * k + row + first];
            }
        }
        let (values, _) = dense_matrices::symmetric_eigen(&block, held)?;
        // A real observation takes a visible share (1e-4 even for one weak distance among thousands of directions);
        // rounding in a network of condition 1e6 leaves 1e-9.
        let determined = values.iter().filter(|&&value| 1.0 - value > 1e-7).count();
        match values.first() {
            Some(smallest) if determined > 0 => {
                Err(Error::DatumOverdetermined { held, determined, share: 1.0 - smallest })
            }
            _ => Ok(()),
        }
    }
}

/// What damping adds to the diagonal of N, for scales of the unknown at present and in the damping's memory.
pub(crate) fn damping_of(lambda: f64, own: f64, reference: f64) -> f64 {
    lambda * (own / reference).powi(2).max(1.0) / (own * own)
}

/// `S N S + BᵀB` in place, lower triangle.
pub(crate) fn equilibrate(matrix: &mut [f64], scale: &[f64], constraints: &ScaledConstraints) {
    let n = scale.len();
    for (column, &own) in scale.iter().enumerate() {
        let target = &mut matrix[column * n + column..(column + 1) * n];
        target.iter_mut().zip(&scale[column..]).for_each(|(value, other)| *value *= own * other);
        for row in constraints.rows.chunks_exact(n) {
            if row[column] != 0.0 {
                target.iter_mut().zip(&row[column..]).for_each(|(value, b)| *value += row[column] * b);
            }
        }
    }
}

fn complement(constraints: &ScaledConstraints, influence: &[f64], n: usize) -> Vec<f64> {
    let k = constraints.count;
    let mut out = vec![0.0; k * k];
    for column in 0..k {
        for row in 0..k {
            let (b, f) = (&constraints.rows[row * n..(row + 1) * n], &influence[column * n..(column + 1) * n]);
            out[column * k + row] = b.iter().zip(f).map(|(b, f)| b * f).sum();
        }
    }
    out
}

/// Cholesky factor of K. A pivot that vanishes means a constraint that those before it already hold.
fn factor_complement(complement: &[f64], constraints: &ScaledConstraints) -> Result<Vec<f64>> {
    let k = constraints.count;
    let mut factor = complement.to_vec();
    for column in 0..k {
        for row in column..k {
            let known: f64 = (0..column).map(|i| factor[i * k + row] * factor[i * k + column]).sum();
            factor[column * k + row] -= known;
        }
        let (pivot, whole) = (factor[column * k + column], complement[column * k + column]);
        // 1e-10: rows are of unit length, so this is an angle of 1e-5 rad between constraints.
        if constraints.lengths[column] == 0.0 || pivot.is_nan() || pivot <= 1e-10 * whole {
            return Err(Error::DependentConstraint { index: column });
        }
        factor[column * k + column..(column + 1) * k].iter_mut().for_each(|value| *value /= pivot.sqrt());
    }
    Ok(factor)
}
