use nalgebra::Vector3;

use crate::equations::structure::Structure;
use crate::linearised::layout::{HELD, Layout};
use crate::model::adjustment::Datum;
use crate::{Adjustment, Error, Result};

/// The rows of `Gᵀ` over all unknowns, row-major, at the current coordinates. They are referred to the centroid, where
/// translations, rotations and scale do not mix, and of unit length.
pub(crate) fn inner_constraints(
    datum: &Datum,
    adjustment: &Adjustment<'_>,
    layout: &Layout,
    values: &[f64],
) -> Result<Vec<f64>> {
    let points = points(datum, adjustment, layout, values)?;
    let centroid = points.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / points.len() as f64;
    check_spread(points.iter().map(|(point, _)| point), &centroid)?;
    let count = datum.defect.count();
    let mut rows = vec![0.0; count * layout.unknowns];
    for (point, columns) in &points {
        for (axis, &column) in columns.iter().enumerate() {
            for row in 0..count {
                rows[row * layout.unknowns + column] = displacement(row, &(point - centroid))[axis];
            }
        }
    }
    for row in rows.chunks_exact_mut(layout.unknowns) {
        let norm = row.iter().map(|g| g * g).sum::<f64>().sqrt();
        for g in row {
            *g /= norm;
        }
    }
    Ok(rows)
}

/// How points move in the directions of the datum, row-major, `count × unknowns`: the points of the datum, and all
/// eliminated blocks of three coordinates, which are points of the same network. What else there is stays zero.
pub(crate) fn point_motions(
    datum: &Datum,
    adjustment: &Adjustment<'_>,
    layout: &Layout,
    values: &[f64],
    structure: &Structure,
) -> Vec<f64> {
    let coordinates = |block: usize| Vector3::from_column_slice(&values[layout.block_values(block)]);
    let count = datum.defect.count();
    let middle =
        datum.points.iter().map(|id| coordinates(id.index())).sum::<Vector3<f64>>() / datum.points.len().max(1) as f64;
    let mut rows = vec![0.0; count * layout.unknowns];
    let others = structure.eliminated.iter().map(|eliminated| eliminated.block);
    for block in others.chain(datum.points.iter().map(|id| id.index())) {
        let (free, ambient) = (layout.free(block), adjustment.blocks[block].manifold.ambient_dimension());
        if free.len() == 3 && ambient == 3 {
            let arm = coordinates(block) - middle;
            for row in 0..count {
                let target = &mut rows[row * layout.unknowns..][free.clone()];
                target.copy_from_slice(displacement(row, &arm).as_slice());
            }
        }
    }
    rows
}

/// How a point at `arm` from the centroid moves under the direction: three translations, three rotations, scale.
pub(crate) fn displacement(direction: usize, arm: &Vector3<f64>) -> Vector3<f64> {
    let axis = |index| Vector3::from_fn(|row, _| if row == index { 1.0 } else { 0.0 });
    match direction {
        0..3 => axis(direction),
        3..6 => axis(direction - 3).cross(arm),
        _ => *arm,
    }
}

type DatumPoint = (Vector3<f64>, [usize; 3]);

fn points(datum: &Datum, adjustment: &Adjustment<'_>, layout: &Layout, values: &[f64]) -> Result<Vec<DatumPoint>> {
    let point = |id: &crate::BlockId| {
        let columns = layout.block_columns(id.index());
        let &[x, y, z] = columns else {
            return Err(Error::Datum { reason: "a point is not a block of three coordinates".to_owned() });
        };
        if columns.contains(&HELD) {
            let label = adjustment.blocks[id.index()].label(id.index());
            return Err(Error::Datum { reason: format!("`{label}` carries the datum and is held as well") });
        }
        let range = layout.block_values(id.index());
        Ok((Vector3::from_column_slice(&values[range]), [x, y, z]))
    };
    datum.points.iter().map(point).collect()
}

/// Points in one line leave the rotation about it open.
pub(crate) fn check_spread<'p>(
    points: impl ExactSizeIterator<Item = &'p Vector3<f64>>,
    centroid: &Vector3<f64>,
) -> Result<()> {
    let count = points.len();
    let mut scatter = nalgebra::Matrix3::zeros();
    for point in points {
        let arm = point - centroid;
        scatter += arm * arm.transpose();
    }
    let mut spread = scatter.symmetric_eigenvalues();
    spread.as_mut_slice().sort_by(f64::total_cmp);
    // The second spread must stand above the rounding of the coordinates: 1e-6 of the length, squared.
    if spread[1] > 1e-12 * spread[2] && spread[2] > 0.0 {
        return Ok(());
    }
    Err(Error::Datum { reason: format!("its {count} points lie in one line") })
}
