//! What residuals of a fit are expected to be: from noise, from what neighbours share, and from common errors such as poses of stations
//! that see one surface from different sides.
//!
//! Standardised residuals are `r = P (ν + L c)` with the projection `P = I − Ā N⁻¹ Āᵀ`, noise ν of each point, and independent unit
//! errors c: one a neighbourhood, and the common errors whitened. Only `tr Q` and `tr Q²` of `Q = cov r` are needed, and `L` has
//! few dense columns; nothing of the size points by points is formed.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Matrix5, Vector3, Vector5};

use crate::Cloud;

/// One residual: everything across the surface, in metre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    pub(crate) index: usize,
    pub(crate) normal: Vector3<f64>,
    /// One over the square is the weight.
    pub(crate) unit: f64,
    pub(crate) noise: f64,
    pub(crate) sensor: Option<(u64, f64)>,
    pub(crate) by: Vector5<f64>,
}

/// Mean and spread of the weighted sum of squared residuals.
#[derive(Debug, Clone)]
pub(crate) struct Expected {
    /// `tr Q`: expectation of the sum of squares.
    pub(crate) mean: f64,
    /// `tr Q²`: half the variance of the sum of squares.
    pub(crate) squares: f64,
}

/// Common errors whitened: columns that move the points at all.
#[derive(Debug, Clone)]
pub(crate) struct Whitened {
    columns: Vec<usize>,
    transposed_root: DMatrix<f64>,
}

impl Whitened {
    pub(crate) fn new(cloud: &Cloud<'_>, points: impl Iterator<Item = usize>) -> Self {
        let mut touched = BTreeSet::new();
        let mut derivatives = Vec::new();
        for point in points {
            derivatives.clear();
            cloud.errors.common(point, &mut derivatives);
            touched.extend(derivatives.iter().map(|(column, _)| *column));
        }
        let covariance = cloud.common.covariance();
        let columns: Vec<usize> = touched.into_iter().filter(|column| covariance[(*column, *column)] > 0.0).collect();
        let size = columns.len();
        if size == 0 {
            return Self { columns, transposed_root: DMatrix::zeros(0, 0) };
        }
        let scale: Vec<f64> = columns.iter().map(|column| covariance[(*column, *column)].sqrt()).collect();
        let correlation =
            DMatrix::from_fn(size, size, |a, b| covariance[(columns[a], columns[b])] / (scale[a] * scale[b]));
        // A covariance from rounded numbers may be slightly indefinite.
        let eigen = correlation.symmetric_eigen();
        let transposed_root = DMatrix::from_fn(size, size, |column, row| {
            scale[row] * eigen.eigenvectors[(row, column)] * eigen.eigenvalues[column].max(0.0).sqrt()
        });
        Self { columns, transposed_root }
    }

    /// Shift of a point along a direction by one standard deviation of each whitened error, metre.
    pub(crate) fn shift(&self, cloud: &Cloud<'_>, point: usize, along: &Vector3<f64>) -> DVector<f64> {
        let mut derivatives = Vec::new();
        cloud.errors.common(point, &mut derivatives);
        let mut shift = DVector::zeros(self.columns.len());
        for (column, derivative) in derivatives {
            if let Ok(at) = self.columns.binary_search(&column) {
                shift.axpy(along.dot(&derivative), &self.transposed_root.column(at), 1.0);
            }
        }
        shift
    }
}

/// A neighbourhood: square of what it shares, with the parameters, with the common errors.
struct Cell {
    square: f64,
    with_parameters: Vector5<f64>,
    with_common: DVector<f64>,
}

/// The sums that `tr Q` and `tr Q²` are made of.
pub(crate) struct Sums {
    inverse: Matrix5<f64>,
    /// `Āᵀ diag(ν) Ā`.
    noise: Matrix5<f64>,
    cells: BTreeMap<u64, Cell>,
    common: DMatrix<f64>,
    /// `Lᵀ Ā` of the common errors.
    pub(crate) common_with_parameters: DMatrix<f64>,
    shifts: Vec<DVector<f64>>,
}

impl Sums {
    /// Of kept residuals; `inverse` is that of the normal matrix whose weights the terms have.
    pub(crate) fn new(cloud: &Cloud<'_>, terms: &[Term], whitened: &Whitened, inverse: &Matrix5<f64>) -> Self {
        let size = whitened.columns.len();
        let mut sums = Self {
            inverse: *inverse,
            noise: Matrix5::zeros(),
            cells: BTreeMap::new(),
            common: DMatrix::zeros(size, size),
            common_with_parameters: DMatrix::zeros(size, 5),
            shifts: Vec::with_capacity(terms.len()),
        };
        for term in terms {
            let row = term.by / term.unit;
            sums.noise += row * row.transpose() * (term.noise / (term.unit * term.unit));
            let shift = whitened.shift(cloud, term.index, &term.normal) / term.unit;
            sums.common.ger(1.0, &shift, &shift, 1.0);
            sums.common_with_parameters.ger(1.0, &shift, &row, 1.0);
            if let Some((cell, own)) = term.sensor {
                let own = own / term.unit;
                let empty =
                    || Cell { square: 0.0, with_parameters: Vector5::zeros(), with_common: DVector::zeros(size) };
                let cell = sums.cells.entry(cell).or_insert_with(empty);
                cell.square += own * own;
                cell.with_parameters += row * own;
                cell.with_common.axpy(own, &shift, 1.0);
            }
            sums.shifts.push(shift);
        }
        sums
    }

    /// Variance, in squared units, that common errors leave in a residual with these parameters and this shift.
    pub(crate) fn left_by_common(&self, row: &Vector5<f64>, shift: &DVector<f64>) -> f64 {
        let taken = &self.common_with_parameters * (self.inverse * row);
        (shift - taken).norm_squared()
    }

    pub(crate) fn expected(&self, terms: &[Term]) -> Expected {
        let inverse = &self.inverse;
        let common_taken = &self.common_with_parameters * inverse;
        let common_left = &self.common - &common_taken * self.common_with_parameters.transpose();
        let mut cells_squared = Matrix5::zeros();
        let (mut mean, mut squares) = (common_left.trace(), common_left.norm_squared());
        for cell in self.cells.values() {
            let taken = inverse * cell.with_parameters;
            let own = cell.with_parameters.dot(&taken);
            mean += cell.square - own;
            squares += cell.square * (cell.square - 2.0 * own);
            squares += 2.0 * (&cell.with_common - &common_taken * cell.with_parameters).norm_squared();
            cells_squared += cell.with_parameters * cell.with_parameters.transpose();
        }
        let product = inverse * cells_squared;
        squares += (product * product).trace();
        let cells_taken = product * inverse;
        let noise = inverse * self.noise;
        squares += (noise * noise).trace();
        for (term, shift) in terms.iter().zip(&self.shifts) {
            let row = term.by / term.unit;
            let (share, leverage) = (term.noise / (term.unit * term.unit), row.dot(&(inverse * row)));
            mean += share * (1.0 - leverage);
            squares += share * share * (1.0 - 2.0 * leverage);
            let mut left = (shift - &common_taken * row).norm_squared() + row.dot(&(cells_taken * row));
            if let Some((cell, own)) = term.sensor {
                let own = own / term.unit;
                let with = self.cells.get(&cell).map_or_else(Vector5::zeros, |cell| cell.with_parameters);
                left += own * own - 2.0 * own * row.dot(&(inverse * with));
            }
            squares += 2.0 * share * left;
        }
        Expected { mean, squares }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Point3};
    use point_uncertainty::{CommonError, CommonErrors, PointErrors, Source};

    use super::*;

    struct Some12;

    impl PointErrors for Some12 {
        fn noise(&self, _: usize) -> Matrix3<f64> {
            Matrix3::zeros()
        }

        fn sensor(&self, _: usize) -> Option<(u64, Vector3<f64>)> {
            None
        }

        fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
            derivatives.push((0, Vector3::new(0.0, 0.0, 1.0)));
            derivatives.push((2, Vector3::new(0.3, 0.0, if point < 5 { 2.0 } else { -0.5 })));
        }
    }

    fn terms() -> Vec<Term> {
        let of = |at: usize| {
            let x = at as f64 - 5.0;
            let unit = 0.5 + 0.1 * (at % 3) as f64;
            let own = if at % 4 == 3 { 0.0 } else { 0.3 * unit };
            Term {
                index: at,
                normal: Vector3::z(),
                unit,
                noise: unit * unit - own * own,
                sensor: (own > 0.0).then_some((at as u64 / 4, own)),
                by: Vector5::new(x, x * x * 0.1, -1.0, 0.0, 0.0),
            }
        };
        (0..12).map(of).collect()
    }

    #[test]
    fn sums_are_those_of_the_whole_matrix() {
        let errors = ["a", "b", "c"].map(|name| CommonError { name: name.to_owned(), source: Source::Pose });
        let covariance = DMatrix::from_row_slice(3, 3, &[0.2, 0.0, 0.05, 0.0, 1.0, 0.0, 0.05, 0.0, 0.1]);
        let common = CommonErrors::new(errors.to_vec(), covariance.clone()).unwrap_or_else(|_| CommonErrors::none());
        let points = [Point3::origin(); 12];
        let cloud = Cloud { points: &points, errors: &Some12, common: &common };
        let terms = terms();
        let design = DMatrix::from_fn(12, 5, |at, column| terms[at].by[column] / terms[at].unit);
        let mut normal = design.tr_mul(&design);
        (normal[(3, 3)], normal[(4, 4)]) = (1.0, 1.0);
        let mut inverse = normal.try_inverse().unwrap_or_else(|| DMatrix::zeros(5, 5));
        (inverse[(3, 3)], inverse[(4, 4)]) = (0.0, 0.0);
        let inverse = Matrix5::from_fn(|row, column| inverse[(row, column)]);

        let shift = |at: usize| {
            let mut derivatives = Vec::new();
            Some12.common(at, &mut derivatives);
            let mut by = DVector::zeros(3);
            for (column, by_error) in &derivatives {
                by[*column] = by_error.z / terms[at].unit;
            }
            by
        };
        let own = DMatrix::from_fn(12, 12, |a, b| {
            let noise = if a == b { terms[a].noise / terms[a].unit.powi(2) } else { 0.0 };
            let shared = match (terms[a].sensor, terms[b].sensor) {
                (Some((one, x)), Some((two, y))) if one == two => x * y / (terms[a].unit * terms[b].unit),
                _ => 0.0,
            };
            noise + shared + shift(a).dot(&(&covariance * shift(b)))
        });
        let projection = DMatrix::identity(12, 12) - &design * inverse * design.transpose();
        let whole = &projection * own * &projection;

        let whitened = Whitened::new(&cloud, 0..12);
        let sums = Sums::new(&cloud, &terms, &whitened, &inverse);
        let expected = sums.expected(&terms);
        assert!((expected.mean - whole.trace()).abs() < 1e-10 * whole.trace());
        let squares = (&whole * &whole).trace();
        assert!((expected.squares - squares).abs() < 1e-10 * squares, "{} {squares}", expected.squares);
    }
}
