//! Whose corners are the better ones: judged by the camera and the board that are calibrated from each set alone.

use adjust::{
    Adjustment, BlockId, Covariance, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real,
    ResidualFunction, SolveOptions,
};
use targets::nalgebra::{DMatrix, Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};

/// Side of a field, metre, and nodes of a row.
const SQUARE_M: f64 = 0.025;
const COLUMNS: usize = 9;
/// Deviation of the image points, pixel, and of the nodes from where the print should have them, metre: wide enough to let the board
/// have any shape, and what tells its place.
const SIGMA_PX: f64 = 0.1;
const PRINT_SIGMA_M: f64 = 2e-3;
/// Focal lengths, principal point, k1, k2, k3, p1, p2 at the start: any that are near do.
const CAMERA: [f64; 9] = [530.0, 530.0, 320.0, 240.0, -0.25, 0.0, 0.0, 0.0, 0.0];

/// A node through Brown's lens.
struct Seen([f64; 2]);

impl ResidualFunction<2> for Seen {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 2], EvaluationFailure> {
        let [fx, fy, cx, cy, k1, k2, k3, p1, p2] = parameters.values::<9>(0)?;
        let [x, y, z] = parameters.pose(1)?.transform(parameters.values::<3>(2)?);
        let (u, v) = (x / z, y / z);
        let square = u * u + v * v;
        let radial = (square * (k1 + square * (k2 + square * k3))) + 1.0;
        let u_lens = u * radial + p1 * u * v * 2.0 + p2 * (square + u * u * 2.0);
        let v_lens = v * radial + p1 * (square + v * v * 2.0) + p2 * u * v * 2.0;
        Ok([-(fx * u_lens + cx) + self.0[0], -(fy * v_lens + cy) + self.0[1]])
    }
}

fn node(k: usize) -> Vector3<f64> {
    Vector3::new((k % COLUMNS) as f64, (k / COLUMNS) as f64, 0.0) * SQUARE_M
}

/// The pose of a flat board from its homography, lens aside.
fn start(corners: &[Vector2<f64>]) -> Isometry3<f64> {
    let mut rows = DMatrix::zeros(2 * corners.len(), 9);
    for (k, corner) in corners.iter().enumerate() {
        let (p, at) = (node(k), (corner - Vector2::new(CAMERA[2], CAMERA[3])) / CAMERA[0]);
        for (axis, value) in [at.x, at.y].into_iter().enumerate() {
            let place = Vector3::new(p.x, p.y, 1.0);
            for j in 0..3 {
                rows[(2 * k + axis, 3 * axis + j)] = place[j];
                rows[(2 * k + axis, 6 + j)] = -value * place[j];
            }
        }
    }
    let null = rows.svd(false, true).v_t.unwrap();
    let last = null.row(null.nrows() - 1);
    let h = Matrix3::from_fn(|i, j| last[3 * i + j]);
    let h = h * (2.0 / (h.column(0).norm() + h.column(1).norm()) * h[(2, 2)].signum());
    let (first, second) = (h.column(0).into_owned(), h.column(1).into_owned());
    let turn = Rotation3::from_matrix(&Matrix3::from_columns(&[first, second, first.cross(&second)]));
    let shift = Translation3::from(h.column(2).into_owned());
    Isometry3::from_parts(shift, UnitQuaternion::from_rotation_matrix(&turn))
}

/// Root mean square of what one camera and one rigid board of any shape leave of the corners, pixel, both coordinates together, and by
/// image: nodes row by row in each. The least that any corners of such a camera and board are from these.
pub fn left_by_one_camera(images: &[Vec<Vector2<f64>>]) -> (f64, Vec<f64>) {
    let mut adjustment = Adjustment::new();
    let camera = adjustment.add_block(ParameterBlock::euclidean(CAMERA));
    let board: Vec<BlockId> = (0..images[0].len())
        .map(|k| {
            let (at, sigma) = (node(k), Covariance::from_sigmas(&[PRINT_SIGMA_M; 3]));
            let block = adjustment.add_block(ParameterBlock::euclidean([at.x, at.y, at.z]));
            adjustment.add_prior(block, at.as_slice(), &sigma).unwrap();
            block
        })
        .collect();
    let group = adjustment.add_group("corners");
    let mut rows = Vec::new();
    for image in images {
        let pose = adjustment.add_block(ParameterBlock::pose(&start(image)));
        for (corner, node) in image.iter().zip(&board) {
            let seen = Differentiated::new(&adjustment, [camera, pose, *node], Seen((*corner).into())).unwrap();
            rows.push(adjustment.add_observation(group, seen, &Covariance::from_sigmas(&[SIGMA_PX; 2])).unwrap());
        }
    }
    let solution = adjustment.solve(&SolveOptions::default()).unwrap();
    let square = |id| solution.residual(id).unwrap().iter().map(|v| v * v).sum::<f64>();
    let squares: Vec<f64> = rows.into_iter().map(square).collect();
    let rms = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    (rms(&squares), squares.chunks(images[0].len()).map(rms).collect())
}
