//! Directions that nothing determines, in the eliminated form.

use nalgebra::DMatrix;

use crate::Result;
use crate::cofactors::rank::{HOPELESS, Problem};
use crate::equations::block_normal::BlockNormal;
use crate::equations::elimination::EliminatedFactor;
use crate::equations::normal::{Singular, unit_scale};

/// Damping of the inverse iteration: an undetermined direction grows by its reciprocal in each round, one that is known a
/// million times worse than the best by a millionth of that.
const SHIFT: f64 = 1e-13;
/// Directions looked for at first; twice as many while all of them are undetermined.
const FIRST: usize = 16;
/// Rounds of inverse iteration.
const ROUNDS: usize = 3;

/// Directions (scaled unknowns) in which N is zero to rounding and which the inner constraints do not hold; the weakest one
/// in any case, for the decision against the matrix has fallen already. Inverse iteration: the reduced unknowns by their
/// factor, the eliminated ones by back substitution.
pub(crate) fn find(problem: &Problem<'_>, normal: &BlockNormal) -> Result<Vec<Vec<f64>>> {
    let user = problem.constraints.of_user();
    let scale = unit_scale(&normal.diagonal);
    let n = scale.len();
    let mut shift = SHIFT;
    let factor = loop {
        match EliminatedFactor::new(normal, &user, Some((shift, &scale))) {
            Ok(factor) => break factor,
            Err(Singular::Constraints(error)) => return Err(error),
            Err(Singular::Normal) if shift < 1e-6 => shift *= 10.0,
            Err(Singular::Normal) => return Ok(Vec::new()),
        }
    };
    let limit = factor.norm(normal) / HOPELESS;
    let mut count = FIRST.min(n);
    loop {
        let space = subspace(problem, &factor, &scale, count)?;
        let small = space.iter().filter(|(value, _)| *value <= limit).count();
        if small < count || count == n {
            let directions = space.into_iter().take(small.max(1)).map(|(_, direction)| direction).collect();
            return Ok(outside_of_datum(problem, &scale, directions));
        }
        count = (2 * count).min(n);
    }
}

/// The weakest directions, of unit length, with `xᵀN x`, ascending.
fn subspace(
    problem: &Problem<'_>,
    factor: &EliminatedFactor,
    scale: &[f64],
    count: usize,
) -> Result<Vec<(f64, Vec<f64>)>> {
    let n = scale.len();
    // Any start will do that no direction of interest is orthogonal to.
    let mut space = DMatrix::from_fn(n, count, |i, j| ((i * 7919 + j * 104_729 + 1) as f64 * 0.618_034).sin());
    for _ in 0..ROUNDS {
        for mut column in space.column_iter_mut() {
            column.iter_mut().zip(scale).for_each(|(value, s)| *value /= s);
        }
        factor.solve_columns(space.as_mut_slice());
        for mut column in space.column_iter_mut() {
            column.iter_mut().zip(scale).for_each(|(value, s)| *value /= s);
        }
        space = space.qr().q();
    }
    let images = images(problem, scale, &space);
    let (values, vectors) = dense_matrices::symmetric_eigen((images.transpose() * images).as_slice(), count)?;
    let turned = space * DMatrix::from_vec(count, count, vectors);
    Ok(values.into_iter().zip(turned.column_iter().map(|column| column.iter().copied().collect())).collect())
}

/// The whitened Jacobian and the user's constraints times the directions.
fn images(problem: &Problem<'_>, scale: &[f64], space: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, user) = (problem.layout.rows, problem.constraints.first_inner);
    let scaled = problem.constraints.scaled(scale);
    let mut out = DMatrix::zeros(rows + user, space.ncols());
    for (direction, mut image) in space.column_iter().zip(out.column_iter_mut()) {
        let step: Vec<f64> = direction.iter().zip(scale).map(|(y, s)| y * s).collect();
        let image = image.as_mut_slice();
        problem.linearisation.apply(problem.layout, &step, &mut image[..rows]);
        for (value, weight) in image.iter_mut().zip(&problem.linearisation.weights) {
            *value *= weight.sqrt();
        }
        for (value, row) in image[rows..].iter_mut().zip(scaled.rows.chunks_exact(scale.len().max(1))) {
            *value = row.iter().zip(direction.iter()).map(|(b, y)| b * y).sum();
        }
    }
    out
}

/// The part of a space that the inner constraints do not hold.
fn outside_of_datum(problem: &Problem<'_>, scale: &[f64], directions: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let (n, count) = (scale.len(), directions.len());
    let scaled = problem.constraints.scaled(scale);
    let inner: Vec<&[f64]> = scaled.rows.chunks_exact(n.max(1)).skip(scaled.first_inner).collect();
    if inner.is_empty() {
        return directions;
    }
    let held = DMatrix::from_fn(inner.len().max(count), count, |i, j| {
        inner.get(i).map_or(0.0, |row| row.iter().zip(&directions[j]).map(|(g, y)| g * y).sum())
    });
    let decomposition = held.svd(false, true);
    let Some(turned) = decomposition.v_t else { return directions };
    let free = decomposition.singular_values.iter().zip(turned.row_iter());
    // Directions are of unit length and so are the constraints; those that hold nothing are zero to the accuracy of the
    // directions.
    let out: Vec<Vec<f64>> = free
        .filter(|(value, _)| **value <= 1e-6)
        .map(|(_, weights)| {
            let mut sum = vec![0.0; n];
            for (weight, direction) in weights.iter().zip(&directions) {
                sum.iter_mut().zip(direction).for_each(|(sum, y)| *sum += weight * y);
            }
            sum
        })
        .collect();
    if out.is_empty() { directions.into_iter().take(1).collect() } else { out }
}
