//! Constraints on the reduced unknowns: those of the user, and the motions that the datum takes away.

use crate::block_normal::BlockNormal;
use crate::constraints::Constraints;
use crate::dense;

/// The user's constraints touch no eliminated block. In place of the inner constraints, which live on points, stand the
/// motions of the reduced unknowns that match those of the points: they make S regular as `G Gᵀ` does with N.
pub(crate) fn new(normal: &BlockNormal, constraints: &Constraints, scale: &[f64]) -> Constraints {
    let (structure, n) = (&normal.structure, normal.diagonal.len());
    let user = constraints.first_inner;
    let mut rows: Vec<f64> =
        constraints.rows.chunks_exact(n.max(1)).take(user).flat_map(|row| structure.gather(row)).collect();
    for motion in constraints.motions.chunks_exact(n.max(1)) {
        // A motion h of unknowns in units of `scale` is h / scale; rows are multiplied by the scale again.
        rows.extend(matching_motion(normal, motion).iter().zip(scale).map(|(h, s)| h / (s * s)));
    }
    Constraints {
        count: constraints.count,
        first_inner: user,
        rows,
        right: constraints.right.clone(),
        motions: Vec::new(),
    }
}

/// Motion of the reduced unknowns that goes with one of the points: the solution of `U h_c = −W h_o`, by one sweep of
/// substitution through its blocks. It is exact where stations are tied to each other only by a border that does not
/// move; elsewhere it is a start that the factorisation of S makes exact.
fn matching_motion(normal: &BlockNormal, motion: &[f64]) -> Vec<f64> {
    let structure = &normal.structure;
    let order = structure.order;
    let (mut force, mut out) = (vec![0.0; order], vec![0.0; order]);
    for block in &structure.eliminated {
        let own = &motion[block.columns()];
        for slot in &structure.slots[block.slots()] {
            let target = &mut force[slot.reduced_columns()];
            for (row, share) in normal.coupling[slot.offset..].chunks_exact(slot.width()).zip(own) {
                target.iter_mut().zip(row).for_each(|(sum, w)| *sum -= w * share);
            }
        }
    }
    for block in &structure.reduced {
        let (own, given) = (block.reduced_columns(), &motion[block.columns()]);
        if given.iter().any(|&h| h != 0.0) {
            // A point of the datum that is not eliminated moves as the others.
            out[own.clone()].copy_from_slice(given);
        } else {
            let mut factor: Vec<f64> =
                own.clone().flat_map(|column| &normal.reduced[column * order..][own.clone()]).copied().collect();
            let solution = &mut out[own.clone()];
            if dense::cholesky(&mut factor, block.width) {
                solution.copy_from_slice(&force[own.clone()]);
                dense::solve_cholesky(&factor, block.width, solution, 1);
            }
        }
        for column in own.clone() {
            let share = out[column];
            let values = &normal.reduced[column * order + own.end..(column + 1) * order];
            force[own.end..].iter_mut().zip(values).for_each(|(sum, u)| *sum -= u * share);
        }
    }
    out
}
