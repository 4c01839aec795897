//! The error that all frames of a sensor share: how large it is, and how far it is alike in the image, from what frames see together.
//!
//! Two frames see a place in different pixels, and so apart by the difference of the error in these. Its values c at the nodes have
//! the expectation 0 and the covariance `σ² exp(-d / ℓ)`, d being the distance of two nodes, without their linear part: an error of
//! inverse depth that is linear in the image makes planes of planes (it is a projective map of what a frame sees), and frames that have
//! hardly moved fit as well with it. Of the equations `N c = r`, in which the planes of the places are eliminated and the other common
//! errors by what is known of them, σ and ℓ are those that make r most probable, `r ~ N(0, N + N C N)`: so nothing but the surfaces says
//! how large the error is. Where it does not show, it is none.
//!
//! With `C = σ² L Lᵀ` and `Lᵀ N L = U λ Uᵀ`, `b = Uᵀ Lᵀ r`, the logarithm of that probability over the one without the error is
//! `½ Σ (σ² b² / (1 + σ² λ) - ln(1 + σ² λ))`.

use nalgebra::{DMatrix, DVector};
use point_uncertainty::{CommonErrors, SharedErrorGrid};
use statistics::Distribution;

use super::equations::Equations;
use super::posterior::root;
use crate::outcome::SharedError;
use crate::{Error, Result};

/// Lengths of correlation that are tried, nodes. A twentieth of the image is what nodes can follow; what is alike beyond eight
/// twentieths differs by its linear part.
const LENGTHS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Standard deviations that are tried, 1/metre: from a hundredth of a millimetre to a decimetre at one metre.
const LEAST_SIGMA: f64 = 1e-5;
/// Steps of them, and the factor from one to the next: they end 6 % from the best.
const STEPS: usize = 81;
const FACTOR: f64 = 1.122;
/// Probability that surfaces show an error to a sensor that has none.
const FALSE_ALARM: f64 = 1e-3;

/// The common errors, of which the shared one is not known to be there.
pub(crate) fn without_shared(grid: Option<SharedErrorGrid>, common: &CommonErrors) -> Result<CommonErrors> {
    let mut covariance = common.covariance().clone();
    if let Some(grid) = grid {
        let (columns, errors) = (grid.columns(), covariance.nrows());
        if columns.end > errors {
            return Err(Error::SharedError { last: columns.end - 1, errors });
        }
        for column in columns {
            covariance.column_mut(column).fill(0.0);
            covariance.row_mut(column).fill(0.0);
        }
    }
    CommonErrors::new(common.errors().to_vec(), covariance).map_err(|_| Error::Decomposition)
}

/// The prior covariance of the common errors with that of the shared one, and what was found of it.
pub(crate) fn shared_error(
    grid: Option<SharedErrorGrid>,
    common: &CommonErrors,
    equations: &Equations,
) -> Result<(DMatrix<f64>, Option<SharedError>)> {
    let mut prior = common.covariance().clone();
    let Some(grid) = grid else { return Ok((prior, None)) };
    let reduced = Reduced::new(&grid, &prior, equations)?;
    let mut best = (0.0, 0.0, 0.0);
    for length in LENGTHS {
        let (evidence, sigma_per_m) = reduced.most_probable(&covariance(&grid, length))?;
        if evidence > best.0 {
            best = (evidence, sigma_per_m, length);
        }
    }
    let (evidence, sigma_per_m, length) = best;
    if evidence <= 0.0 || chance(evidence) >= FALSE_ALARM {
        return Ok((prior, None));
    }
    let nodes = covariance(&grid, length) * (sigma_per_m * sigma_per_m);
    let first = grid.columns().start;
    prior.view_mut((first, first), nodes.shape()).copy_from(&nodes);
    Ok((prior, Some(SharedError { sigma_per_m, length_px: length * grid.spacing_px(), evidence })))
}

/// Probability of so much evidence without an error: of a variance, whose estimate is none in half of the cases, for each of the lengths.
fn chance(evidence: f64) -> f64 {
    0.5 * LENGTHS.len() as f64 * Distribution::ChiSquared { dof: 1.0 }.survival(2.0 * evidence)
}

fn evidence(values: &[f64], along: &DVector<f64>, variance: f64) -> f64 {
    let term = |(value, along): (&f64, &f64)| {
        let gained = variance * value.max(0.0);
        variance * along * along / (1.0 + gained) - gained.ln_1p()
    };
    0.5 * values.iter().zip(along.iter()).map(term).sum::<f64>()
}

/// Covariance of the nodes for a standard deviation of one, without the linear part.
fn covariance(grid: &SharedErrorGrid, length: f64) -> DMatrix<f64> {
    let [across, down] = grid.nodes();
    let size = across * down;
    let place = |node: usize| [(node % across) as f64, (node / across) as f64];
    let alike = DMatrix::from_fn(size, size, |row, column| {
        let ([x, y], [u, v]) = (place(row), place(column));
        (-(x - u).hypot(y - v) / length).exp()
    });
    // On a whole grid, a constant and the places from the middle on are orthogonal.
    let middle = [across, down].map(|nodes| 0.5 * (nodes - 1) as f64);
    let linear = |node: usize, at: usize| if at == 0 { 1.0 } else { place(node)[at - 1] - middle[at - 1] };
    let mut basis = DMatrix::from_fn(size, 3, linear);
    for mut column in basis.column_iter_mut() {
        let length = column.norm();
        column /= length;
    }
    let left = &alike - &basis * (basis.transpose() * &alike);
    let both = &left - (&left * &basis) * basis.transpose();
    (&both + both.transpose()) * 0.5
}

/// The equations of the nodes alone, the other errors eliminated with their covariance: with its root L and `A = I + Lᵀ N L`,
/// `N_nn - N_no L A⁻¹ Lᵀ N_on`.
struct Reduced {
    normal: DMatrix<f64>,
    right: DVector<f64>,
}

impl Reduced {
    fn new(grid: &SharedErrorGrid, prior: &DMatrix<f64>, equations: &Equations) -> Result<Self> {
        let nodes: Vec<usize> = grid.columns().collect();
        let others: Vec<usize> = (0..prior.nrows()).filter(|at| !grid.columns().contains(at)).collect();
        let columns = equations.normal.select_columns(&nodes);
        let (own, across) = (columns.select_rows(&nodes), columns.select_rows(&others));
        let right = equations.right.select_rows(&nodes);
        if others.is_empty() {
            return Ok(Self { normal: own, right });
        }
        let root = root(&prior.select_rows(&others).select_columns(&others))?;
        let of_others = equations.normal.select_rows(&others).select_columns(&others);
        let size = others.len();
        let mut factor = root.transpose() * of_others * &root;
        for at in 0..size {
            factor[(at, at)] += 1.0;
        }
        if !dense_matrices::cholesky(factor.as_mut_slice(), size) {
            return Err(Error::Decomposition);
        }
        let with_nodes = root.transpose() * across;
        let mut of_nodes = with_nodes.clone();
        let mut of_right = root.transpose() * equations.right.select_rows(&others);
        dense_matrices::solve_cholesky(factor.as_slice(), size, of_nodes.as_mut_slice(), nodes.len());
        dense_matrices::solve_cholesky(factor.as_slice(), size, of_right.as_mut_slice(), 1);
        Ok(Self { normal: own - with_nodes.transpose() * of_nodes, right: right - with_nodes.transpose() * of_right })
    }

    /// The largest evidence of all standard deviations, for nodes with such a covariance, and the deviation.
    fn most_probable(&self, covariance: &DMatrix<f64>) -> Result<(f64, f64)> {
        let (root, size) = (root(covariance)?, covariance.nrows());
        let reduced = root.transpose() * &self.normal * &root;
        let (values, vectors) =
            dense_matrices::symmetric_eigen(reduced.as_slice(), size).map_err(|_| Error::Decomposition)?;
        let along = DMatrix::from_vec(size, size, vectors).transpose() * (root.transpose() * &self.right);
        let tried = (0..STEPS).map(|step| {
            let sigma_per_m = LEAST_SIGMA * FACTOR.powi(step as i32);
            (evidence(&values, &along, sigma_per_m * sigma_per_m), sigma_per_m)
        });
        Ok(tried.fold((0.0, 0.0), |best, next| if next.0 > best.0 { next } else { best }))
    }
}
