use nalgebra::Vector3;

use crate::adjustment::Datum;
use crate::layout::{HELD, Layout};
use crate::structure::Structure;
use crate::{Adjustment, Error, Result};

/// How many directions the network leaves undetermined, for [`Adjustment::add_inner_constraints`].
///
/// There is no default: it follows from what was observed. One constraint too many would bend the network
/// ([`Error::DatumOverdetermined`]), one too few leaves a rank defect ([`Error::RankDeficient`]).
///
/// Three points with three distances, free in space:
///
/// ```
/// use adjust::{
///     Adjustment, Covariance, DatumDefect, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real,
///     ResidualFunction, Scale, SolveOptions,
/// };
///
/// struct Distance(f64);
///
/// impl ResidualFunction<1> for Distance {
///     fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
///         let ([x, y, z], [a, b, c]) = (parameters.values(0)?, parameters.values(1)?);
///         Ok([-((x - a).powi(2) + (y - b).powi(2) + (z - c).powi(2)).sqrt() + self.0])
///     }
/// }
///
/// # fn main() -> Result<(), adjust::Error> {
/// let mut a = Adjustment::new();
/// let start = [[0.0, 0.0, 0.0], [3.1, 0.0, 0.0], [0.0, 3.9, 0.0]];
/// let points = start.map(|point| a.add_block(ParameterBlock::euclidean(point)));
/// let tape = a.add_group("tape");
/// for (first, second, metres) in [(0, 1, 3.0), (0, 2, 4.0), (1, 2, 5.0)] {
///     let distance = Differentiated::new(&a, [points[first], points[second]], Distance(metres))?;
///     a.add_observation(tape, distance, &Covariance::from_sigma(0.001))?;
/// }
/// a.add_inner_constraints(&points, DatumDefect::Six)?;
/// let solution = a.solve(&SolveOptions::default())?;
/// // Nine coordinates, three distances, six constraints. The centroid of the points stays where it was.
/// assert_eq!(solution.redundancy(), 0);
/// let x: f64 = points.iter().map(|&point| solution.values(point).map(|values| values[0])).sum::<Result<f64, _>>()?;
/// assert!((x - 3.1).abs() < 1e-12);
/// assert!(solution.standard_deviations(points[1], Scale::Prior)?[0] < 0.001);
///
/// // The distances carry the scale: it cannot be held as well.
/// a.add_inner_constraints(&points, DatumDefect::Seven)?;
/// assert!(matches!(a.solve(&SolveOptions::default()), Err(adjust::Error::DatumOverdetermined { .. })));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DatumDefect {
    /// Position and attitude (three shifts, three rotations): ranges or distances carry the scale.
    Six,
    /// Position, attitude and scale: directions and image points only.
    Seven,
}

impl DatumDefect {
    /// Number of inner constraints.
    pub fn count(self) -> usize {
        match self {
            Self::Six => 6,
            Self::Seven => 7,
        }
    }
}

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
        datum.points.iter().map(|id| coordinates(id.0)).sum::<Vector3<f64>>() / datum.points.len().max(1) as f64;
    let mut rows = vec![0.0; count * layout.unknowns];
    let others = structure.eliminated.iter().map(|eliminated| eliminated.block);
    for block in others.chain(datum.points.iter().map(|id| id.0)) {
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
        let columns = layout.block_columns(id.0);
        let &[x, y, z] = columns else {
            return Err(Error::Datum { reason: "a point is not a block of three coordinates".to_owned() });
        };
        if columns.contains(&HELD) {
            let label = adjustment.blocks[id.0].label(id.0);
            return Err(Error::Datum { reason: format!("`{label}` carries the datum and is held as well") });
        }
        let range = layout.block_values(id.0);
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
