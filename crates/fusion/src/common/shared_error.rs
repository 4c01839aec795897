//! The error that all frames of a sensor share: how large it is, and how far it is alike in the image, from what frames see together.
//!
//! Two frames see a place in different pixels, and so apart by the difference of the error in these. Its values c at the nodes have
//! the expectation 0 and the covariance `σ² exp(-d / ℓ)`, d being the distance of two nodes, without what polynomials up to the second
//! degree have of it: on surfaces at one depth, those cannot be told from turns and shifts of the frames, whose registration has taken them
//! in, and poses that are stated without that would be pulled by centimetres. Of the equations `N c = r`, in which the
//! planes of the places are eliminated and the other common errors by what is known of them, σ and ℓ are those that make r most
//! probable, `r ~ N(0, N + N C N)`: so nothing but the surfaces says how large the error is. Where it does not show, it is none.
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

/// Lengths of correlation that are tried, nodes. A twentieth of the image is what nodes can follow; of what is alike beyond eight
/// twentieths, polynomials leave the same as of what is alike over eight.
const LENGTHS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Degree of the polynomials that belong to the poses.
const DEGREE: usize = 2;
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
    let Some((nodes, shared)) = most_probable(&grid, &prior, equations)? else { return Ok((prior, None)) };
    let columns = grid.columns();
    prior.view_mut((columns.start, columns.start), nodes.shape()).copy_from(&nodes);
    Ok((prior, Some(shared)))
}

/// The covariance of the nodes that makes the equations most probable; `None` where they are as probable without it.
fn most_probable(
    grid: &SharedErrorGrid,
    prior: &DMatrix<f64>,
    equations: &Equations,
) -> Result<Option<(DMatrix<f64>, SharedError)>> {
    let (normal, right) = of_nodes(grid, prior, equations)?;
    let mut best: Option<(f64, f64, f64)> = None;
    for length in LENGTHS {
        let factor = root(&correlation(grid, length))?;
        let size = factor.nrows();
        let reduced = factor.transpose() * &normal * &factor;
        let (values, vectors) =
            dense_matrices::symmetric_eigen(reduced.as_slice(), size).map_err(|_| Error::Decomposition)?;
        let along = DMatrix::from_vec(size, size, vectors).transpose() * (factor.transpose() * &right);
        for step in 0..STEPS {
            let sigma = LEAST_SIGMA * FACTOR.powi(step as i32);
            let found = evidence(&values, &along, sigma * sigma);
            if best.is_none_or(|(most, _, _)| found > most) {
                best = Some((found, sigma, length));
            }
        }
    }
    let found = best.filter(|(evidence, _, _)| *evidence > 0.0 && chance(*evidence) < FALSE_ALARM);
    Ok(found.map(|(evidence, sigma_per_m, length)| {
        let shared = SharedError { sigma_per_m, length_px: length * grid.spacing_px(), evidence };
        (correlation(grid, length) * (sigma_per_m * sigma_per_m), shared)
    }))
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

/// Covariance of the nodes for a standard deviation of one, without the polynomials.
fn correlation(grid: &SharedErrorGrid, length: f64) -> DMatrix<f64> {
    let [across, down] = grid.nodes();
    let size = across * down;
    let place = |node: usize| [(node % across) as f64, (node / across) as f64];
    let alike = DMatrix::from_fn(size, size, |row, column| {
        let ([x, y], [u, v]) = (place(row), place(column));
        (-(x - u).hypot(y - v) / length).exp()
    });
    let powers: Vec<[i32; 2]> =
        (0..=DEGREE as i32).flat_map(|degree| (0..=degree).map(move |down| [degree - down, down])).collect();
    // From -1 to 1 over the longer side: powers that differ enough to be made orthogonal.
    let half = 0.5 * (across.max(down) - 1) as f64;
    let polynomials = DMatrix::from_fn(size, powers.len(), |node, at| {
        let [x, y] = place(node).map(|v| v / half - 1.0);
        x.powi(powers[at][0]) * y.powi(powers[at][1])
    });
    let basis = polynomials.qr().q();
    let left = &alike - &basis * (basis.transpose() * &alike);
    let both = &left - (&left * &basis) * basis.transpose();
    (&both + both.transpose()) * 0.5
}

/// The equations of the nodes alone, the other errors eliminated with their covariance: with its root L and `A = I + Lᵀ N L`,
/// `N_nn - N_no L A⁻¹ Lᵀ N_on`.
fn of_nodes(
    grid: &SharedErrorGrid,
    prior: &DMatrix<f64>,
    equations: &Equations,
) -> Result<(DMatrix<f64>, DVector<f64>)> {
    let nodes: Vec<usize> = grid.columns().collect();
    let others: Vec<usize> = (0..prior.nrows()).filter(|at| !grid.columns().contains(at)).collect();
    let columns = equations.normal.select_columns(&nodes);
    let (own, across) = (columns.select_rows(&nodes), columns.select_rows(&others));
    let right = equations.right.select_rows(&nodes);
    if others.is_empty() {
        return Ok((own, right));
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
    let with_right = root.transpose() * equations.right.select_rows(&others);
    let (mut solved, mut of_right) = (with_nodes.clone(), with_right);
    dense_matrices::solve_cholesky(factor.as_slice(), size, solved.as_mut_slice(), nodes.len());
    dense_matrices::solve_cholesky(factor.as_slice(), size, of_right.as_mut_slice(), 1);
    Ok((own - with_nodes.transpose() * solved, right - with_nodes.transpose() * of_right))
}
