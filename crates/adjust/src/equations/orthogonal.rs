use crate::equations::constraints::{Constraints, ScaledConstraints};
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::Linearisation;
use crate::{Error, Result};

/// Orthogonal factorisation of the whitened Jacobian with unit columns in the null space of the constraints: loses half
/// as many digits as the normal equations. For problems that are small or badly conditioned.
#[derive(Debug, Clone)]
pub(crate) struct OrthogonalFactor {
    pub(crate) scale: Vec<f64>,
    /// Householder vectors of `Bᵀ`, each of length `unknowns` and norm √2.
    reflectors: Vec<Vec<f64>>,
    /// The part of the step that the constraints fix, in reflected coordinates.
    fixed: Vec<f64>,
    /// R of `[J Z | v]`, column-major, `(free + 1)²`.
    upper: Vec<f64>,
    /// Unknowns that the constraints leave free.
    pub(crate) free: usize,
}

/// Elements of a dense Jacobian up to which it is formed (160 MB).
const LARGEST: usize = 20_000_000;

impl OrthogonalFactor {
    /// Whether the dense Jacobian fits.
    pub(crate) fn fits(layout: &Layout) -> bool {
        layout.rows.saturating_mul(layout.unknowns + 1) <= LARGEST
    }

    /// Whether it costs so little (about 10 ms) that there is no reason to do without.
    pub(crate) fn is_cheap(layout: &Layout) -> bool {
        layout.rows.saturating_mul(layout.unknowns.saturating_mul(layout.unknowns)) <= 5_000_000
    }

    pub(crate) fn new(layout: &Layout, linearisation: &Linearisation, constraints: &Constraints) -> Result<Self> {
        let (n, rows) = (layout.unknowns, layout.rows);
        let scale = column_scale(layout, linearisation);
        let constraints = constraints.scaled(&scale);
        let (reflectors, fixed) = reflect_constraints(&constraints, n)?;
        let (k, free) = (fixed.len(), n - fixed.len());
        let height = rows.max(free + 1);
        let mut matrix = vec![0.0; height * (free + 1)];
        let mut row = vec![0.0; n];
        for place in &layout.observations {
            let jacobian = &linearisation.jacobian[place.jacobian_range()];
            for (index, target) in place.rows().enumerate() {
                row.fill(0.0);
                let weight = linearisation.weights[target].sqrt();
                for (a, column) in jacobian[index * place.width..].iter().zip(layout.columns(place)) {
                    row[column] = weight * a * scale[column];
                }
                for reflector in &reflectors {
                    reflect(reflector, &mut row);
                }
                let known: f64 = row.iter().zip(&fixed).map(|(a, y)| a * y).sum();
                for (column, a) in row[k..].iter().enumerate() {
                    matrix[column * height + target] = *a;
                }
                matrix[free * height + target] = weight * linearisation.whitened[target] - known;
            }
        }
        let upper = dense_matrices::upper_factor(&mut matrix, height, free + 1);
        Ok(Self { scale, reflectors, fixed, upper, free })
    }

    /// R without the right-hand side.
    fn triangle(&self) -> Vec<f64> {
        let (n, wide) = (self.free, self.free + 1);
        (0..n).flat_map(|column| self.upper[column * wide..column * wide + n].iter().copied()).collect()
    }

    /// Whether no singular value lies below `tolerance` times the largest.
    pub(crate) fn is_determined(&self, tolerance: f64) -> Result<bool> {
        if let Some(inverse) = dense_matrices::inverse_of_triangular(&self.triangle(), self.free) {
            let trace: f64 = (0..self.free).map(|i| inverse[i * self.free + i]).sum();
            // √(n·trace) bounds the condition from above; a tenth of the limit leaves the bound's own slack.
            if (self.free as f64 * trace).sqrt() * tolerance < 0.1 {
                return Ok(true);
            }
        }
        Ok(self.null_space(tolerance)?.is_empty())
    }

    /// The step; its elements are not finite where R is singular.
    pub(crate) fn solve(&self) -> Vec<f64> {
        let wide = self.free + 1;
        let mut right = self.upper[self.free * wide..self.free * wide + self.free].to_vec();
        dense_matrices::solve_upper(&self.triangle(), self.free, &mut right);
        self.expand(&self.fixed, &right)
    }

    /// Cofactor matrix of the scaled unknowns, and the trace of the free part; `None` where R is singular.
    pub(crate) fn cofactor(&self) -> Option<(Vec<f64>, f64)> {
        let (n, k) = (self.scale.len(), self.fixed.len());
        let inner = dense_matrices::inverse_of_triangular(&self.triangle(), self.free)?;
        let trace = (0..self.free).map(|i| inner[i * self.free + i]).sum();
        let mut out = vec![0.0; n * n];
        for column in 0..self.free {
            let target = &mut out[(column + k) * n + k..(column + k) * n + n];
            target.copy_from_slice(&inner[column * self.free..(column + 1) * self.free]);
        }
        for _ in 0..2 {
            for column in out.chunks_exact_mut(n.max(1)) {
                self.reflectors.iter().rev().for_each(|reflector| reflect(reflector, column));
            }
            transpose(&mut out, n);
        }
        Some((out, trace))
    }

    /// Directions (scaled unknowns) whose singular value is below `tolerance` times the largest.
    pub(crate) fn null_space(&self, tolerance: f64) -> Result<Vec<Vec<f64>>> {
        let (values, vectors) = dense_matrices::singular_values(&self.triangle(), self.free)?;
        let limit = tolerance * values.first().copied().unwrap_or(0.0);
        let small = values.iter().zip(vectors.chunks_exact(self.free.max(1))).filter(|&(&value, _)| value <= limit);
        let zero = vec![0.0; self.fixed.len()];
        let unscaled = small.map(|(_, vector)| {
            let mut direction = [zero.as_slice(), vector].concat();
            self.reflectors.iter().rev().for_each(|reflector| reflect(reflector, &mut direction));
            direction
        });
        Ok(unscaled.collect())
    }

    fn expand(&self, fixed: &[f64], free: &[f64]) -> Vec<f64> {
        let mut step = [fixed, free].concat();
        self.reflectors.iter().rev().for_each(|reflector| reflect(reflector, &mut step));
        step.iter_mut().zip(&self.scale).for_each(|(y, s)| *y *= s);
        step
    }
}

/// What makes the columns of the whitened Jacobian of unit length.
fn column_scale(layout: &Layout, linearisation: &Linearisation) -> Vec<f64> {
    let mut squares = vec![0.0; layout.unknowns];
    for place in &layout.observations {
        let rows = linearisation.jacobian[place.jacobian_range()].chunks_exact(place.width.max(1));
        for (row, target) in rows.zip(place.rows()) {
            let weight = linearisation.weights[target];
            row.iter().zip(layout.columns(place)).for_each(|(a, column)| squares[column] += weight * a * a);
        }
    }
    squares.into_iter().map(|s: f64| if s > 0.0 { 1.0 / s.sqrt() } else { 1.0 }).collect()
}

/// `x ← x − u (uᵀx)` for a reflector of norm √2.
fn reflect(reflector: &[f64], vector: &mut [f64]) {
    let share: f64 = reflector.iter().zip(vector.iter()).map(|(u, x)| u * x).sum();
    vector.iter_mut().zip(reflector).for_each(|(x, u)| *x -= share * u);
}

/// QR of `Bᵀ` and the solution of `Rᵀ y = d`.
fn reflect_constraints(constraints: &ScaledConstraints, n: usize) -> Result<(Vec<Vec<f64>>, Vec<f64>)> {
    let (mut reflectors, mut fixed): (Vec<Vec<f64>>, Vec<f64>) = (Vec::new(), Vec::new());
    for (index, row) in constraints.rows.chunks_exact(n.max(1)).enumerate() {
        let mut row = row.to_vec();
        for reflector in &reflectors {
            reflect(reflector, &mut row);
        }
        let tail = row[index.min(n)..].iter().map(|b| b * b).sum::<f64>().sqrt();
        // Rows are of unit length: below this angle to the rows before, nothing new is held (as for the normal equations).
        if constraints.lengths[index] == 0.0 || tail <= 1e-5 {
            return Err(Error::DependentConstraint { index });
        }
        let diagonal = if row[index] > 0.0 { -tail } else { tail };
        let known: f64 = row[..index].iter().zip(&fixed).map(|(r, y)| r * y).sum();
        fixed.push((constraints.right[index] - known) / diagonal);
        let mut reflector = vec![0.0; n];
        reflector[index..].copy_from_slice(&row[index..]);
        reflector[index] -= diagonal;
        let norm = reflector.iter().map(|u| u * u).sum::<f64>().sqrt();
        for u in &mut reflector {
            *u *= std::f64::consts::SQRT_2 / norm;
        }
        reflectors.push(reflector);
    }
    if constraints.count > reflectors.len() {
        return Err(Error::DependentConstraint { index: reflectors.len() });
    }
    Ok((reflectors, fixed))
}

fn transpose(matrix: &mut [f64], n: usize) {
    for column in 0..n {
        for row in column + 1..n {
            matrix.swap(column * n + row, row * n + column);
        }
    }
}
