//! What of a network is left undetermined by its observations.

/// How many directions the network leaves undetermined, for [`crate::Adjustment::add_inner_constraints`].
///
/// There is no default: it follows from what was observed. One constraint too many would bend the network
/// ([`crate::Error::DatumOverdetermined`]), one too few leaves a rank defect ([`crate::Error::RankDeficient`]).
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
