use nalgebra::{DMatrix, Vector3};

use crate::equations::datum::{check_spread, displacement};
use crate::{BlockId, DatumDefect, Error, Result, RigidPose, Scale, Solution};

/// Share of a row of the design that may remain when the network is moved as a whole: differences of numerical
/// Jacobians leave 1e-8.
const MOVES_NOTHING: f64 = 1e-6;

/// A block that takes part when the network is shifted, turned or scaled as a whole. All others do not change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moving {
    /// A point: three Euclidean coordinates.
    Point(BlockId),
    /// The pose of a body in the network, [`RigidPose`] `world_from_body`.
    Pose(BlockId),
    /// A pose between two bodies, whose translation is scaled with the network, and no more.
    RelativePose(BlockId),
}

impl Moving {
    fn block(self) -> BlockId {
        match self {
            Self::Point(block) | Self::Pose(block) | Self::RelativePose(block) => block,
        }
    }
}

/// The covariances of a solution in another datum. The values are those of the solution: to first order they do not
/// change.
#[derive(Debug)]
pub struct DatumTransformation<'s> {
    solution: &'s Solution,
    /// How each moving block moves, `tangent dimension × defect`; sorted by block.
    motions: Vec<(BlockId, DMatrix<f64>)>,
    /// `(GᵀH)⁻¹`.
    inverse: DMatrix<f64>,
    /// `Q G`, prior-scaled covariance of all unknowns with `Gᵀδ` over the datum points.
    shares: DMatrix<f64>,
    /// `GᵀQG`.
    shift: DMatrix<f64>,
}

impl Solution {
    /// Covariances as they would be if the datum of the free network were carried by other points, without solving
    /// again: the S-transformation `Q' = S Q Sᵀ`, `S = I − H (GᵀH)⁻¹ Gᵀ`, block by block \[Baarda1973\]. H is how the
    /// unknowns move with the network, G the same for the datum points alone.
    ///
    /// `datum` are points (three or more, not in a line); they are moving themselves. `moving` names all other blocks
    /// that go with the network: the other points and the poses.
    ///
    /// # Errors
    /// [`Error::Datum`] where the points cannot carry the datum, a block is of another kind than said, or an observation
    /// (a prior, for example) changes when the network is moved: then its datum is no free choice, or a block is missing
    /// in `moving`. This is not examined where a moving block has held parameters.
    pub fn transformed_to(
        &self,
        datum: &[BlockId],
        moving: &[Moving],
        defect: DatumDefect,
    ) -> Result<DatumTransformation<'_>> {
        self.offsets(datum)?;
        let points = datum.iter().map(|&point| self.point(point)).collect::<Result<Vec<_>>>()?;
        if points.len() < 3 {
            return Err(Error::Datum { reason: format!("{} points do not carry a datum, three do", points.len()) });
        }
        let centroid = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        check_spread(points.iter(), &centroid)?;
        let size = (points.iter().map(|p| (p - centroid).norm_squared()).sum::<f64>() / points.len() as f64).sqrt();
        let motion = Motion { centroid, size, count: defect.count() };
        let mut motions = self.motions(datum, moving, &motion)?;
        motions.sort_by_key(|(block, _)| *block);
        self.check_motion(&motions, motion.count)?;
        let mut directions = DMatrix::zeros(self.unknowns(), motion.count);
        let mut gram = DMatrix::zeros(motion.count, motion.count);
        for (block, matrix) in motions.iter().filter(|(block, _)| datum.contains(block)) {
            gram += matrix.transpose() * matrix;
            for component in 0..matrix.nrows() {
                if let Some(column) = self.unknown_index(*block, component)? {
                    directions.row_mut(column).copy_from(&matrix.row(component));
                }
            }
        }
        let failed = Error::Decomposition { what: "inversion of the datum's normal equations" };
        let inverse = gram.try_inverse().ok_or(failed)?;
        let mut shares = DMatrix::zeros(self.unknowns(), motion.count);
        for (mut share, direction) in shares.column_iter_mut().zip(directions.column_iter()) {
            share.copy_from_slice(&self.cofactor.multiply(direction.into_owned().as_slice()));
        }
        let shift = directions.transpose() * &shares;
        Ok(DatumTransformation { solution: self, motions, inverse, shares, shift })
    }

    fn motions(&self, datum: &[BlockId], moving: &[Moving], motion: &Motion) -> Result<Vec<(BlockId, DMatrix<f64>)>> {
        let mut out: Vec<(BlockId, DMatrix<f64>)> = Vec::new();
        let others = moving.iter().copied().filter(|one| !datum.contains(&one.block()));
        for one in datum.iter().map(|&point| Moving::Point(point)).chain(others) {
            let matrix = match one {
                Moving::Point(block) => motion.of_point(&self.point(block)?),
                Moving::Pose(block) => motion.of_pose(&self.pose_or_refuse(block)?),
                Moving::RelativePose(block) => motion.of_relative(&self.pose_or_refuse(block)?),
            };
            out.push((one.block(), matrix));
        }
        let blocks: Vec<_> = out.iter().map(|(block, _)| *block).collect();
        self.offsets(&blocks)?;
        Ok(out)
    }

    fn point(&self, block: BlockId) -> Result<Vector3<f64>> {
        if let (&[x, y, z], 3) = (self.values(block)?, self.tangent_dimension(block)?) {
            return Ok(Vector3::new(x, y, z));
        }
        Err(Error::Datum { reason: format!("`{}` is not a block of three coordinates", self.block_label(block)) })
    }

    fn pose_or_refuse(&self, block: BlockId) -> Result<nalgebra::Isometry3<f64>> {
        match (RigidPose::isometry(self.values(block)?), self.tangent_dimension(block)?) {
            (Ok(pose), 6) => Ok(pose),
            _ => Err(Error::Datum { reason: format!("`{}` is not a rigid pose", self.block_label(block)) }),
        }
    }

    /// No observation may notice the motion.
    fn check_motion(&self, motions: &[(BlockId, DMatrix<f64>)], count: usize) -> Result<()> {
        let mut moved = vec![None; self.unknowns()];
        for (block, matrix) in motions {
            for component in 0..matrix.nrows() {
                let Some(column) = self.unknown_index(*block, component)? else { return Ok(()) };
                moved[column] = Some(matrix.row(component));
            }
        }
        for (index, place) in self.layout.observations.iter().enumerate() {
            let columns = self.columns_of(place);
            let rows = self.linearisation.jacobian[place.jacobian_range()].chunks_exact(columns.len().max(1));
            for (row, direction) in rows.flat_map(|row| (0..count).map(move |direction| (row, direction))) {
                let (mut sum, mut size) = (0.0, 0.0_f64);
                for (a, &column) in row.iter().zip(&columns) {
                    let part = moved[column].as_ref().map_or(0.0, |h| a * h[direction]);
                    sum += part;
                    size += part.abs();
                }
                if sum.abs() > MOVES_NOTHING * size {
                    let group = &self.groups[self.group_of[index].0];
                    let reason = format!(
                        "observation {index} (group `{group}`) changes when the network is moved as a whole: it fixes the \
                         datum, or a block that moves was not named"
                    );
                    return Err(Error::Datum { reason });
                }
            }
        }
        Ok(())
    }
}

/// The directions of a motion about the centroid of the datum points, all of the size of a length.
struct Motion {
    centroid: Vector3<f64>,
    /// Root mean square distance of the datum points from their centroid.
    size: f64,
    count: usize,
}

impl Motion {
    /// Unit of a direction: 1 for shifts, 1/size for turns and scale.
    fn unit(&self, direction: usize) -> f64 {
        if direction < 3 { 1.0 } else { 1.0 / self.size }
    }

    fn of_point(&self, point: &Vector3<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(3, self.count, |row, i| self.unit(i) * displacement(i, &(point - self.centroid))[row])
    }

    /// The step of a pose is `[dt world, dθ body]`.
    fn of_pose(&self, world_from_body: &nalgebra::Isometry3<f64>) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(6, self.count);
        out.rows_mut(0, 3).copy_from(&self.of_point(&world_from_body.translation.vector));
        let turn = world_from_body.rotation.inverse().to_rotation_matrix().into_inner() * self.unit(3);
        out.view_mut((3, 3), (3, 3)).copy_from(&turn);
        out
    }

    fn of_relative(&self, pose: &nalgebra::Isometry3<f64>) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(6, self.count);
        if self.count == 7 {
            out.view_mut((0, 6), (3, 1)).copy_from(&(pose.translation.vector * self.unit(6)));
        }
        out
    }
}

impl DatumTransformation<'_> {
    /// Covariance matrix of a block's tangent step in the new datum.
    pub fn covariance(&self, block: BlockId, scale: Scale) -> Result<DMatrix<f64>> {
        self.covariance_between(block, block, scale)
    }

    /// Covariance matrix between the tangent steps of two blocks in the new datum (rows: `first`).
    pub fn covariance_between(&self, first: BlockId, second: BlockId, scale: Scale) -> Result<DMatrix<f64>> {
        let factor = self.solution.variance_factor(scale)?;
        let mut out = self.solution.covariance_between(first, second, Scale::Prior)?;
        // δ' = δ − H M D with D = Gᵀδ over the datum points.
        let (left, right) = (self.influence(first), self.influence(second));
        if let Some(right) = &right {
            out -= self.covariance_with_shift(first)? * right.transpose();
        }
        if let Some(left) = &left {
            out -= left * self.covariance_with_shift(second)?.transpose();
        }
        if let (Some(left), Some(right)) = (&left, &right) {
            out += left * &self.shift * right.transpose();
        }
        Ok(out * factor)
    }

    /// Standard deviations of a block's parameters in the new datum.
    pub fn standard_deviations(&self, block: BlockId, scale: Scale) -> Result<Vec<f64>> {
        Ok(self.covariance(block, scale)?.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect())
    }

    fn motion(&self, block: BlockId) -> Option<&DMatrix<f64>> {
        let place = self.motions.binary_search_by_key(&block, |(block, _)| *block).ok()?;
        Some(&self.motions[place].1)
    }

    /// `H M` of a block; `None` where it does not move.
    fn influence(&self, block: BlockId) -> Option<DMatrix<f64>> {
        self.motion(block).map(|motion| motion * &self.inverse)
    }

    /// Covariance between a block and D.
    fn covariance_with_shift(&self, block: BlockId) -> Result<DMatrix<f64>> {
        let mut out = DMatrix::zeros(self.solution.tangent_dimension(block)?, self.inverse.nrows());
        for component in 0..out.nrows() {
            if let Some(column) = self.solution.unknown_index(block, component)? {
                out.row_mut(component).copy_from(&self.shares.row(column));
            }
        }
        Ok(out)
    }
}
