//! Start values: a board's pose from the homography between board and image.

use nalgebra::{DMatrix, Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// `camera_from_board` of a camera with focal length `f` and principal point `centre` (pixel), lens ignored.
pub fn pose(corners: &[([f64; 2], [f64; 2])], f: f64, centre: [f64; 2]) -> Option<Isometry3<f64>> {
    // The board is brought to unit size so that the columns of the design are alike.
    let size = corners.iter().flat_map(|(board, _)| board).fold(0.0_f64, |a, b| a.max(b.abs()));
    let mut design = DMatrix::zeros(2 * corners.len(), 9);
    for (index, ([bx, by], [col, row])) in corners.iter().enumerate() {
        let (x, y) = ((col - centre[0]) / f, (row - centre[1]) / f);
        let (bx, by) = (bx / size, by / size);
        let rows =
            [[bx, by, 1.0, 0.0, 0.0, 0.0, -x * bx, -x * by, -x], [0.0, 0.0, 0.0, bx, by, 1.0, -y * bx, -y * by, -y]];
        for (offset, row) in rows.iter().enumerate() {
            design.row_mut(2 * index + offset).copy_from_slice(row);
        }
    }
    // The null vector of the design is the eigenvector of the smallest eigenvalue of its normal matrix.
    let eigen = (design.transpose() * &design).symmetric_eigen();
    let h = Matrix3::from_row_slice(eigen.eigenvectors.column(eigen.eigenvalues.imin()).as_slice());
    let length = 0.5 * (h.column(0).norm() + h.column(1).norm());
    let h = h / if h[(2, 2)] < 0.0 { -length } else { length };
    let (first, second): (Vector3<f64>, Vector3<f64>) = (h.column(0).into(), h.column(1).into());
    let near = Matrix3::from_columns(&[first, second, first.cross(&second)]);
    let rotation = Rotation3::from_matrix_eps(&near, 1e-12, 100, Rotation3::identity());
    let shift: Vector3<f64> = h.column(2) * size;
    shift.z.is_finite().then(|| Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from(rotation)))
}
