//! Constraints on the reduced unknowns: those of the user, and the motions that the datum takes away.

use crate::equations::block_normal::BlockNormal;
use crate::equations::constraints::Constraints;
use crate::equations::structure::Reduced;
use dense_matrices::{Left, Right, add_product, with_wide_registers};

/// The user's constraints touch no eliminated block. In place of the inner constraints, which live on points, stand the
/// motions of the reduced unknowns that match those of the points: they make S regular as `G Gᵀ` does with N.
pub(crate) fn new(normal: &BlockNormal, constraints: &Constraints, scale: &[f64]) -> Constraints {
    let (structure, n) = (&normal.structure, normal.diagonal.len());
    let user = constraints.first_inner;
    let mut rows: Vec<f64> =
        constraints.rows.chunks_exact(n.max(1)).take(user).flat_map(|row| structure.gather(row, 1)).collect();
    let count = constraints.motions.len() / n.max(1);
    let motions = matching_motions(normal, &dense_matrices::transposed(&constraints.motions, n), count);
    for motion in dense_matrices::transposed(&motions, count).chunks_exact(structure.order.max(1)) {
        // A motion h of unknowns in units of `scale` is h / scale; rows are multiplied by the scale again.
        rows.extend(motion.iter().zip(scale).map(|(h, s)| h / (s * s)));
    }
    Constraints {
        count: constraints.count,
        first_inner: user,
        rows,
        right: constraints.right.clone(),
        motions: Vec::new(),
    }
}

/// Motions of the reduced unknowns that go with `count` motions of the points, all side by side: the solutions of
/// `U h_c = −W h_o`, by one sweep of substitution through its blocks. They are exact where stations are tied to each other
/// only by a border that does not move; elsewhere they are a start that the factorisation of S makes exact.
fn matching_motions(normal: &BlockNormal, motions: &[f64], count: usize) -> Vec<f64> {
    let structure = &normal.structure;
    let order = structure.order;
    let (mut force, mut out) = (vec![0.0; order * count], vec![0.0; order * count]);
    if count == 0 {
        return out;
    }
    with_wide_registers(|| {
        for block in &structure.eliminated {
            let left = Left { data: &motions[block.column * count..], stride: count, rows: count };
            for slot in &structure.slots[block.slots()] {
                let data = &normal.coupling[slot.offset..];
                let right = Right { data, inner: slot.width(), column: 1, columns: slot.width() };
                add_product(&mut force[slot.start as usize * count..], count, left, right, block.width, -1.0);
            }
        }
    });
    for block in &structure.reduced {
        let own = block.start * count..(block.start + block.width) * count;
        let given = &motions[block.column * count..][..block.width * count];
        if given.iter().any(|&h| h != 0.0) {
            // A point of the datum that is not eliminated moves as the others.
            out[own.clone()].copy_from_slice(given);
        } else if let Some(solution) = solve_block(normal, block, &force[own.clone()], count) {
            out[own.clone()].copy_from_slice(&solution);
        }
        let end = block.start + block.width;
        with_wide_registers(|| {
            let left = Left { data: &out[own], stride: count, rows: count };
            let data = &normal.reduced[block.start * order + end..];
            let right = Right { data, inner: order, column: 1, columns: order - end };
            add_product(&mut force[end * count..], count, left, right, block.width, -1.0);
        });
    }
    out
}

/// Solution with a block on the diagonal of U, for vectors side by side; `None` where it is singular.
fn solve_block(normal: &BlockNormal, block: &Reduced, force: &[f64], count: usize) -> Option<Vec<f64>> {
    let (own, order) = (block.reduced_columns(), normal.structure.order);
    let mut factor: Vec<f64> =
        own.clone().flat_map(|column| &normal.reduced[column * order..][own.clone()]).copied().collect();
    let mut columns = dense_matrices::transposed(force, count);
    dense_matrices::cholesky(&mut factor, block.width).then(|| {
        dense_matrices::solve_cholesky(&factor, block.width, &mut columns, count);
        dense_matrices::transposed(&columns, block.width)
    })
}
