//! Essential matrices of five point pairs `[Nister2004]`, as eigenvectors of an action matrix `[Stewenius2006]`.
//!
//! The rays `a` and `b` of a target in two views fulfil `aᵀ E b = 0`, `E = [t]x R`. Five of these leave
//! `E = x E1 + y E2 + z E3 + E4`; that E is essential, `det E = 0` and `2 E Eᵀ E − trace(E Eᵀ) E = 0`, are ten equations
//! of third degree in x, y, z. Solved for their ten cubic monomials they say what becomes of the ten lower ones when they
//! are multiplied by x: a matrix whose eigenvectors are the lower monomials at the solutions.

use nalgebra::{Matrix3, SMatrix, SVector, Schur, Vector3};

/// Exponents of x, y, z of all monomials: the cubic ones first.
const EXPONENTS: [[usize; 3]; 20] = [
    [3, 0, 0],
    [2, 1, 0],
    [2, 0, 1],
    [1, 2, 0],
    [1, 1, 1],
    [1, 0, 2],
    [0, 3, 0],
    [0, 2, 1],
    [0, 1, 2],
    [0, 0, 3],
    [2, 0, 0],
    [1, 1, 0],
    [1, 0, 1],
    [0, 2, 0],
    [0, 1, 1],
    [0, 0, 2],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [0, 0, 0],
];
/// Places of the products of the monomials: `PLACES[i][j]`, 20 where the product has a higher degree than three.
const PLACES: [[usize; 20]; 20] = places();

const fn places() -> [[usize; 20]; 20] {
    let mut places = [[20; 20]; 20];
    let mut index = 0;
    while index < 8000 {
        let (i, j, k) = (index / 400, index / 20 % 20, index % 20);
        let (a, b, c) = (EXPONENTS[i], EXPONENTS[j], EXPONENTS[k]);
        if a[0] + b[0] == c[0] && a[1] + b[1] == c[1] && a[2] + b[2] == c[2] {
            places[i][j] = k;
        }
        index += 1;
    }
    places
}

/// First places of the monomials of second and of first degree.
const QUADRATIC: usize = 10;
const LINEAR: usize = 16;
/// Where x, y, z and 1 stand among the lower monomials.
const X: usize = 6;
const Y: usize = 7;
const Z: usize = 8;
const ONE: usize = 9;
/// The lower monomials times x: which cubic one that is (the first six), or which lower one.
const TIMES_X: [usize; 10] = [0, 1, 2, 3, 4, 5, 10, 11, 12, 16];

/// Imaginary part, relative to the size of an eigenvalue, up to which it counts as real: rounding makes that of double
/// solutions. A wrong one costs time, since every solution is judged by all pairs.
const REAL: f64 = 1e-6;
/// How far beside an eigenvalue, relative to its size, its vector is sought: nearer, the matrix is singular to rounding; two
/// iterations leave the square of this.
const BESIDE: f64 = 1e-10;
/// Most steps of an eigenvalue iteration; some dozens are usual.
const MOST_STEPS: usize = 1000;

/// A polynomial in x, y, z of third degree at most.
type Polynomial = SVector<f64, 20>;
type Action = SMatrix<f64, 10, 10>;

/// All essential matrices `E`, `aᵀ E b = 0`, of five pairs of rays; none where the pairs are degenerate.
pub(crate) fn essential_matrices(pairs: &[[Vector3<f64>; 2]; 5]) -> Vec<Matrix3<f64>> {
    let Some(basis) = null_space(pairs) else { return Vec::new() };
    let Some(action) = action_matrix(&constraints(&basis)) else { return Vec::new() };
    let Some(schur) = Schur::try_new(action, f64::EPSILON, MOST_STEPS) else { return Vec::new() };
    let eigenvalues = schur.complex_eigenvalues();
    let real = eigenvalues.iter().filter(|value| value.im.abs() <= REAL * value.norm().max(1.0));
    real.filter_map(|value| solution(&action, value.re, &basis)).collect()
}

/// Four matrices that span all E with `aᵀ E b = 0`.
fn null_space(pairs: &[[Vector3<f64>; 2]; 5]) -> Option<[Matrix3<f64>; 4]> {
    let mut rows = SMatrix::<f64, 9, 9>::zeros();
    for (row, [a, b]) in pairs.iter().enumerate() {
        for k in 0..9 {
            rows[(row, k)] = a[k / 3] * b[k % 3];
        }
    }
    let v = rows.try_svd(false, true, f64::EPSILON, MOST_STEPS)?.v_t?;
    Some([5, 6, 7, 8].map(|row| Matrix3::from_fn(|i, j| v[(row, 3 * i + j)])))
}

/// The ten equations, one a row.
fn constraints(basis: &[Matrix3<f64>; 4]) -> SMatrix<f64, 10, 20> {
    let entry = |i: usize, j: usize| {
        let mut polynomial = Polynomial::zeros();
        for (k, matrix) in basis.iter().enumerate() {
            polynomial[LINEAR + k] = matrix[(i, j)];
        }
        polynomial
    };
    let e: [[Polynomial; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
    let square: [[Polynomial; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| product(&e[i][k], LINEAR, &e[j][k])).sum()));
    let trace = square[0][0] + square[1][1] + square[2][2];
    let mut equations = SMatrix::<f64, 10, 20>::zeros();
    for row in 0..9 {
        let (i, j) = (row / 3, row % 3);
        let cubic: Polynomial = (0..3).map(|k| product(&square[i][k], QUADRATIC, &e[k][j])).sum();
        equations.set_row(row, &(cubic * 2.0 - product(&trace, QUADRATIC, &e[i][j])).transpose());
    }
    let minor = |j: usize, k: usize| product(&e[1][j], LINEAR, &e[2][k]) - product(&e[1][k], LINEAR, &e[2][j]);
    let part = |j: usize, k: usize, i: usize| product(&minor(j, k), QUADRATIC, &e[0][i]);
    let determinant = part(1, 2, 0) - part(0, 2, 1) + part(0, 1, 2);
    equations.set_row(9, &determinant.transpose());
    equations
}

/// Product with a linear polynomial of one whose terms begin at a place: [`LINEAR`] or [`QUADRATIC`].
fn product(a: &Polynomial, from: usize, linear: &Polynomial) -> Polynomial {
    let mut out = Polynomial::zeros();
    for i in from..20 {
        for j in LINEAR..20 {
            if let Some(sum) = out.get_mut(PLACES[i][j]) {
                *sum += a[i] * linear[j];
            }
        }
    }
    out
}

/// The matrix that multiplies the lower monomials by x; `None` where the equations do not give the cubic ones.
fn action_matrix(equations: &SMatrix<f64, 10, 20>) -> Option<Action> {
    let cubic: Action = equations.fixed_columns::<10>(0).into_owned();
    let lower: Action = equations.fixed_columns::<10>(10).into_owned();
    let reduced = cubic.full_piv_lu().solve(&lower)?;
    let mut action = Action::zeros();
    for (row, place) in TIMES_X.into_iter().enumerate() {
        match place.checked_sub(10) {
            Some(column) => action[(row, column)] = 1.0,
            None => action.set_row(row, &-reduced.row(place)),
        }
    }
    action.iter().all(|value| value.is_finite()).then_some(action)
}

/// The essential matrix of an eigenvalue, of unit length: the eigenvector by inverse iteration.
fn solution(action: &Action, eigenvalue: f64, basis: &[Matrix3<f64>; 4]) -> Option<Matrix3<f64>> {
    let beside = eigenvalue + BESIDE * eigenvalue.abs().max(1.0);
    let factor = (action - Action::identity() * beside).lu();
    let mut monomials = SVector::<f64, 10>::from_element(1.0);
    for _ in 0..2 {
        monomials = factor.solve(&monomials)?.try_normalize(0.0)?;
    }
    let parts = basis.iter().zip([X, Y, Z, ONE]).map(|(matrix, place)| matrix * monomials[place]);
    let matrix: Matrix3<f64> = parts.sum();
    let length = matrix.norm();
    (length > f64::EPSILON).then(|| matrix / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn the_true_matrix_is_among_them_and_all_fulfil_the_equations() {
        for case in 0..50 {
            let seed = f64::from(case);
            let wave = |k: f64| (12.9898 * (seed * 7.3 + k * 1.37)).sin();
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(wave(1.0), wave(2.0), wave(3.0)));
            let base = Vector3::new(wave(4.0), wave(5.0), wave(6.0)).normalize();
            let pairs: [[Vector3<f64>; 2]; 5] = std::array::from_fn(|i| {
                let k = 10.0 + 3.0 * i as f64;
                let point = Vector3::new(wave(k), wave(k + 1.0), 3.0 + wave(k + 2.0));
                [(rotation * point + base).normalize(), point.normalize()]
            });
            let truth = (base.cross_matrix() * rotation.to_rotation_matrix().matrix()).normalize();
            let found = essential_matrices(&pairs);
            let nearest =
                found.iter().map(|e| (e - truth).norm().min((e + truth).norm())).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-7, "{case}: {nearest}");
            for e in &found {
                for [a, b] in &pairs {
                    assert!(a.dot(&(e * b)).abs() < 1e-9, "{case}");
                }
                assert!(e.determinant().abs() < 1e-6, "{case}");
            }
        }
    }

    #[test]
    fn degenerate_pairs_give_no_panic() {
        for ray in [Vector3::z(), Vector3::zeros(), Vector3::from_element(f64::NAN)] {
            let _ = essential_matrices(&[[ray; 2]; 5]);
        }
    }
}
