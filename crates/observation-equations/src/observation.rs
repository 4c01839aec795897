use nalgebra::{Dim, Matrix, RawStorage};

use crate::derivatives::dual::TapeMemory;
use crate::{BlockId, EvaluationFailure};

/// One observation: some numbers that belong together (an image point, a range, a prior) and their model.
///
/// `evaluate` writes the residual **v = observed − model** and, when asked, the Jacobian **of the model**,
/// `A = ∂model/∂(tangent step)`, for each of its blocks. (For an observation that is no plain vector the residual is
/// whatever difference fits, and A is minus its derivative.)
pub trait Observation: Send + Sync {
    /// Number of components.
    fn dimension(&self) -> usize;

    /// The blocks it depends on, in the order in which `evaluate` wants them.
    fn blocks(&self) -> &[BlockId];

    /// Computes residual and Jacobian. `parameters[i]` are the ambient values of `blocks()[i]`; `residual` has
    /// `dimension()` elements; `jacobians` come filled with zeros.
    ///
    /// # Errors
    /// Where the model has no value at these parameters.
    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure>;
}

/// The Jacobians of one observation, to be filled in: for each block a matrix of `dimension × tangent dimension`.
#[derive(Debug)]
pub struct Jacobians<'a> {
    pub(crate) data: &'a mut [f64],
    /// Where each block begins in a row.
    pub(crate) named: &'a [Named],
    /// Length of a row.
    pub(crate) width: usize,
    dimension: usize,
    misused: bool,
    pub(crate) tape: &'a mut TapeMemory,
}

impl<'a> Jacobians<'a> {
    /// Over memory of `dimension × width` zeros, in which the columns of each block lie where `named` says.
    #[inline]
    pub fn new(
        data: &'a mut [f64],
        named: &'a [Named],
        [dimension, width]: [usize; 2],
        tape: &'a mut TapeMemory,
    ) -> Self {
        Self { data, named, width, dimension, misused: false, tape }
    }

    /// What was written, row by row; `None` where something of the wrong shape was.
    #[inline]
    pub fn written(&self) -> Option<&[f64]> {
        (!self.misused).then_some(&*self.data)
    }

    /// Row `row` of the matrix of block `block` (its place in `blocks()`). Where there is no such row or block the
    /// slice is empty, and the adjustment ends with an error that names the observation.
    pub fn row(&mut self, block: usize, row: usize) -> &mut [f64] {
        match self.named.get(block) {
            Some(named) if row < self.dimension => {
                let start = row * self.width + named.start as usize;
                &mut self.data[start..start + named.width as usize]
            }
            _ => {
                self.misused = true;
                &mut []
            }
        }
    }

    /// Copies a whole matrix of `dimension × tangent dimension`. A matrix of another shape ends the adjustment with an
    /// error that names the observation.
    pub fn set<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(&mut self, block: usize, matrix: &Matrix<f64, R, C, S>) {
        if matrix.nrows() != self.dimension {
            self.misused = true;
            return;
        }
        for index in 0..matrix.nrows() {
            let row = self.row(block, index);
            if row.len() != matrix.ncols() {
                self.misused = true;
                return;
            }
            row.iter_mut().zip(matrix.row(index).iter()).for_each(|(out, value)| *out = *value);
        }
    }
}

/// An observation written as a closure.
pub struct FunctionObservation<F> {
    blocks: Vec<BlockId>,
    dimension: usize,
    function: F,
}

impl<F> FunctionObservation<F>
where
    F: Fn(&[&[f64]], &mut [f64], Option<&mut Jacobians<'_>>) -> Result<(), EvaluationFailure> + Send + Sync,
{
    /// An observation of `dimension` components on `blocks`; the closure is [`Observation::evaluate`].
    pub fn new(blocks: impl Into<Vec<BlockId>>, dimension: usize, function: F) -> Self {
        Self { blocks: blocks.into(), dimension, function }
    }
}

impl<F> std::fmt::Debug for FunctionObservation<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FunctionObservation")
            .field("blocks", &self.blocks)
            .field("dimension", &self.dimension)
            .finish_non_exhaustive()
    }
}

impl<F> Observation for FunctionObservation<F>
where
    F: Fn(&[&[f64]], &mut [f64], Option<&mut Jacobians<'_>>) -> Result<(), EvaluationFailure> + Send + Sync,
{
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        (self.function)(parameters, residual, jacobians)
    }
}

/// An observation (or a constraint) that is linear in Euclidean blocks: `model = Σ aᵢᵀ xᵢ`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearObservation {
    observed: f64,
    blocks: Vec<BlockId>,
    rows: Vec<Vec<f64>>,
}

impl LinearObservation {
    /// The observed value and, for each block, its part of the design row.
    pub fn new<R: Into<Vec<f64>>>(observed: f64, terms: impl IntoIterator<Item = (BlockId, R)>) -> Self {
        let (blocks, rows) = terms.into_iter().map(|(block, row)| (block, row.into())).unzip();
        Self { observed, blocks, rows }
    }
}

impl Observation for LinearObservation {
    fn dimension(&self) -> usize {
        1
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        mut jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        residual[0] = self.observed;
        for (block, (values, row)) in parameters.iter().zip(&self.rows).enumerate() {
            if values.len() != row.len() {
                let message = format!("design row of {} values for a block of {}", row.len(), values.len());
                return Err(EvaluationFailure::new(message));
            }
            residual[0] -= values.iter().zip(row).map(|(x, a)| x * a).sum::<f64>();
            if let Some(jacobians) = jacobians.as_deref_mut() {
                let out = jacobians.row(block, 0);
                if out.len() != row.len() {
                    return Err(EvaluationFailure::new("a linear observation needs Euclidean blocks"));
                }
                out.copy_from_slice(row);
            }
        }
        Ok(())
    }
}

/// A block as an observation names it, and where its columns lie in a row of the Jacobian that the model writes.
#[derive(Debug, Clone, Copy)]
pub struct Named {
    /// Number of the block.
    pub block: u32,
    /// First of its columns.
    pub start: u32,
    /// Number of its columns.
    pub width: u32,
}
