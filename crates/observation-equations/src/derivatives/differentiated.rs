// Parameters and poses are seeds of numbers whose operations are inlined as well.
#![allow(clippy::inline_always)]

use crate::observation::Named;
use crate::{
    BlockId, Dual, Error, Euclidean, EvaluationFailure, Jacobians, Observation, ParameterBlock, Real, RigidPose,
};

/// A residual of `D` components, written once for numbers with and without derivatives: [`Differentiated`] makes an
/// [`Observation`] of it, so that no Jacobian is derived by hand.
pub trait ResidualFunction<const D: usize>: Send + Sync {
    /// **v = observed − model** at these parameters.
    ///
    /// # Errors
    /// Where the model has no value at these parameters.
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; D], EvaluationFailure>;
}

/// The parameters of one observation, block by block in the order in which its blocks were given.
#[derive(Debug)]
pub struct Parameters<'p, T: Real> {
    values: &'p [&'p [f64]],
    is_pose: &'p [bool],
    /// Where the derivatives of each block belong; empty where none are wanted.
    columns: &'p [Named],
    tape: T::Tape,
}

impl<'p, T: Real> Parameters<'p, T> {
    /// All parameters of a block of plain numbers: `let [c, x0, y0] = parameters.values(2)?;`
    ///
    /// # Errors
    /// There is no such block, it is a pose, or it does not have `K` parameters.
    #[inline(always)]
    pub fn values<const K: usize>(&self, block: usize) -> Result<[T; K], EvaluationFailure> {
        let Some(Ok(values)) = self.of(block, false).map(<&[f64; K]>::try_from) else {
            return Err(self.unfit(block, &format!("{K} plain numbers")));
        };
        let (start, tape) = (self.start(block), self.tape);
        let mut out = [T::variable(0.0, start, tape); K];
        for index in 0..K {
            out[index] = T::variable(values[index], start + index, tape);
        }
        Ok(out)
    }

    /// A block that is a pose.
    ///
    /// # Errors
    /// There is no such block, or it is no pose.
    #[inline(always)]
    pub fn pose(&self, block: usize) -> Result<Pose<T>, EvaluationFailure> {
        let Some(values) = self.of(block, true) else { return Err(self.unfit(block, "a pose")) };
        let isometry = RigidPose::isometry(values)?;
        let matrix = isometry.rotation.to_rotation_matrix();
        let (start, tape) = (self.start(block), self.tape);
        let variable = |index: usize, value: f64| T::variable(value, start + index, tape);
        Ok(Pose {
            rotation: std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)])),
            translation: [variable(0, values[0]), variable(1, values[1]), variable(2, values[2])],
            turn: [variable(3, 0.0), variable(4, 0.0), variable(5, 0.0)],
        })
    }

    /// The parameters of a block of plain numbers, however many.
    ///
    /// # Errors
    /// There is no such block, or it is a pose.
    pub fn plain(&self, block: usize) -> Result<impl ExactSizeIterator<Item = T>, EvaluationFailure> {
        let Some(values) = self.of(block, false) else { return Err(self.unfit(block, "plain numbers")) };
        let (start, tape) = (self.start(block), self.tape);
        Ok(values.iter().enumerate().map(move |(index, &value)| T::variable(value, start + index, tape)))
    }

    /// The values of a block of this kind.
    #[inline(always)]
    fn of(&self, block: usize, is_pose: bool) -> Option<&'p [f64]> {
        let kind = self.is_pose.get(block)?;
        self.values.get(block).copied().filter(|_| *kind == is_pose)
    }

    #[inline(always)]
    fn start(&self, block: usize) -> usize {
        self.columns.get(block).map_or(0, |named| named.start as usize)
    }

    #[cold]
    fn unfit(&self, block: usize, wanted: &str) -> EvaluationFailure {
        let found = self.values.get(block).map_or(0, |values| values.len());
        EvaluationFailure::new(format!("block {block} of the observation ({found} values) is taken for {wanted}"))
    }
}

/// A pose `a_from_b` with its derivatives with respect to the tangent step of a [`RigidPose`].
#[derive(Debug, Clone, Copy)]
pub struct Pose<T> {
    rotation: [[f64; 3]; 3],
    translation: [T; 3],
    /// The step dθ: its value is zero, its derivatives are not.
    turn: [T; 3],
}

impl<T: Real> Pose<T> {
    /// `p_a` of `p_b`.
    #[inline(always)]
    #[must_use]
    pub fn transform(&self, point: [T; 3]) -> [T; 3] {
        let ([x, y, z], [tx, ty, tz]) = (self.rotate(point), self.translation);
        [x + tx, y + ty, z + tz]
    }

    /// `p_b` of `p_a`: a point in the camera's frame, where the pose is that of a camera in object space.
    #[inline(always)]
    #[must_use]
    pub fn inverse_transform(&self, point: [T; 3]) -> [T; 3] {
        let ([x, y, z], [tx, ty, tz]) = (point, self.translation);
        self.inverse_rotate([x - tx, y - ty, z - tz])
    }

    /// A direction of frame b in frame a.
    #[inline(always)]
    #[must_use]
    pub fn rotate(&self, vector: [T; 3]) -> [T; 3] {
        let v = values_of(&vector);
        let [x, y, z] = vector;
        // R exp(dθ) v = R (v + dθ × v), exact at dθ = 0: the derivative of row r with respect to dθ is v × r.
        let row = |r: &[f64; 3]| {
            let value = v[0] * r[0] + v[1] * r[1] + v[2] * r[2];
            let turn = [v[1] * r[2] - v[2] * r[1], v[2] * r[0] - v[0] * r[2], v[0] * r[1] - v[1] * r[0]];
            let [first, second, third] = self.turn;
            T::function_of([x, y, z, first, second, third], value, [r[0], r[1], r[2], turn[0], turn[1], turn[2]])
        };
        let [first, second, third] = &self.rotation;
        [row(first), row(second), row(third)]
    }

    /// A direction of frame a in frame b.
    #[inline(always)]
    #[must_use]
    pub fn inverse_rotate(&self, vector: [T; 3]) -> [T; 3] {
        let (r, v) = (&self.rotation, values_of(&vector));
        let turned = |row: usize| v[0] * r[0][row] + v[1] * r[1][row] + v[2] * r[2][row];
        let p = [turned(0), turned(1), turned(2)];
        let [x, y, z] = vector;
        // exp(−dθ) Rᵀ v = Rᵀ v − dθ × Rᵀ v, exact at dθ = 0.
        let row = |row: usize, next: usize, last: usize| {
            let slopes = [r[0][row], r[1][row], r[2][row], -p[last], p[next]];
            T::function_of([x, y, z, self.turn[next], self.turn[last]], p[row], slopes)
        };
        [row(0, 1, 2), row(1, 2, 0), row(2, 0, 1)]
    }

    /// Where the perspective centre of a camera lies.
    pub fn translation(&self) -> [T; 3] {
        self.translation
    }
}

#[inline(always)]
fn values_of<T: Real>(vector: &[T; 3]) -> [f64; 3] {
    [vector[0].value(), vector[1].value(), vector[2].value()]
}

/// An observation with derivatives by dual numbers, made from one [`ResidualFunction`] of `D` components.
///
/// The derivatives are exact to rounding, and a solution takes little longer than with Jacobians derived by hand
/// (`cargo bench -p adjust --bench derivatives`).
///
/// ```
/// use observation_equations::{
///     BlockId, Differentiated, EvaluationFailure, Observation, ParameterBlock, Parameters, Real, ResidualFunction,
/// };
///
/// /// An observed activity, and a sum that decays with time.
/// struct Decay {
///     time: f64,
///     observed: f64,
/// }
///
/// impl ResidualFunction<1> for Decay {
///     fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
///         let [amount, rate] = parameters.values(0)?;
///         Ok([-(amount * (-rate * self.time).exp()) + self.observed])
///     }
/// }
///
/// let blocks = [ParameterBlock::euclidean([3.0, 0.5]).with_parameter_names(["amount", "rate"])];
/// let model = Decay { time: 2.0, observed: 1.1 };
/// let observation = Differentiated::new(&blocks, [BlockId::new(0)], model)?;
/// let mut residual = [0.0];
/// observation.evaluate(&[&blocks[0].values], &mut residual, None)?;
/// assert!((residual[0] - (1.1 - 3.0 * (-1.0_f64).exp())).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Differentiated<const D: usize, F> {
    blocks: Vec<BlockId>,
    is_pose: Vec<bool>,
    function: F,
}

impl<const D: usize, F: ResidualFunction<D>> Differentiated<D, F> {
    /// An observation on blocks of the adjustment, or of the list of blocks, that it will be added to.
    ///
    /// # Errors
    /// A block is unknown, or lies on a manifold of another kind than [`crate::Euclidean`] and [`RigidPose`]: its Jacobian
    /// has to be derived by hand.
    pub fn new(
        known: &(impl AsRef<[ParameterBlock]> + ?Sized),
        blocks: impl Into<Vec<BlockId>>,
        function: F,
    ) -> crate::Result<Self> {
        let (known, blocks) = (known.as_ref(), blocks.into());
        let mut poses = Vec::with_capacity(blocks.len());
        for &id in &blocks {
            let (index, count) = (id.index(), known.len());
            let block = known.get(index).ok_or(Error::UnknownId { what: "block", index, count })?;
            let manifold: &dyn std::any::Any = &*block.manifold;
            let is_pose = manifold.is::<RigidPose>();
            if !is_pose && !manifold.is::<Euclidean>() {
                let reason = "dual numbers are made for plain parameters and rigid poses";
                return Err(Error::Untestable { what: format!("block `{}`", block.label(index)), reason });
            }
            poses.push(is_pose);
        }
        Ok(Self { blocks, is_pose: poses, function })
    }

    #[inline(always)]
    fn residual<T: Real>(
        &self,
        values: &[&[f64]],
        columns: &[Named],
        tape: T::Tape,
    ) -> Result<[T; D], EvaluationFailure> {
        self.function.residual(&Parameters { values, is_pose: &self.is_pose, columns, tape })
    }

    /// Whether there is a column for each variable that the function can ask for.
    fn fits(&self, values: &[&[f64]], columns: &[Named]) -> bool {
        let own = values.iter().zip(&self.is_pose).map(|(values, &is_pose)| if is_pose { 6 } else { values.len() });
        columns.len() == self.is_pose.len() && columns.iter().zip(own).all(|(named, own)| named.width as usize == own)
    }
}

impl<const D: usize, F: ResidualFunction<D>> Observation for Differentiated<D, F> {
    fn dimension(&self) -> usize {
        D
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
        let Some(jacobians) = jacobians else {
            residual.copy_from_slice(&self.residual::<f64>(parameters, &[], ())?);
            return Ok(());
        };
        let Jacobians { data, named, width, tape, .. } = jacobians;
        if !self.fits(parameters, named) {
            return Err(EvaluationFailure::new("the blocks are not those that the observation was made for"));
        }
        let found = tape.differentiate(
            *width,
            #[inline(always)]
            |tape| self.residual::<Dual<'_>>(parameters, named, tape),
            #[inline(always)]
            |derivatives| {
                // A is the Jacobian of the model, which v has with the other sign.
                for (index, row) in data.chunks_exact_mut((*width).max(1)).enumerate().take(D) {
                    for (out, column) in row.iter_mut().zip(derivatives) {
                        *out = -column[index];
                    }
                }
            },
        )?;
        residual.copy_from_slice(&found);
        Ok(())
    }
}
