use crate::manifold::Euclidean;
use crate::product::with_wide_registers;
use crate::{Adjustment, BlockId, Dual, Error, EvaluationFailure, Jacobians, Observation, Real, RigidPose};

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
pub struct Parameters<'p, T> {
    values: &'p [&'p [f64]],
    parts: &'p [Part],
    number: std::marker::PhantomData<T>,
}

/// Where a block's derivatives begin, and whether it is a pose.
#[derive(Debug, Clone, Copy)]
struct Part {
    start: usize,
    is_pose: bool,
}

impl<T: Real> Parameters<'_, T> {
    /// All parameters of a block of plain numbers: `let [c, x0, y0] = parameters.values(2)?;`
    ///
    /// # Errors
    /// There is no such block, it is a pose, or it does not have `K` parameters.
    #[inline]
    pub fn values<const K: usize>(&self, block: usize) -> Result<[T; K], EvaluationFailure> {
        match (self.values.get(block), self.parts.get(block)) {
            (Some(values), Some(Part { start, is_pose: false })) if values.len() == K => {
                Ok(std::array::from_fn(|index| T::variable(values[index], start + index)))
            }
            (values, _) => Err(Self::unfit(block, values, &format!("{K} plain numbers"))),
        }
    }

    /// A block that is a pose.
    ///
    /// # Errors
    /// There is no such block, or it is no pose.
    #[inline]
    pub fn pose(&self, block: usize) -> Result<Pose<T>, EvaluationFailure> {
        let (Some(values), Some(&Part { start, is_pose: true })) = (self.values.get(block), self.parts.get(block))
        else {
            return Err(Self::unfit(block, self.values.get(block), "a pose"));
        };
        let isometry = RigidPose::isometry(values)?;
        let matrix = isometry.rotation.to_rotation_matrix();
        Ok(Pose {
            rotation: std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)])),
            translation: std::array::from_fn(|axis| T::variable(values[axis], start + axis)),
            turn: std::array::from_fn(|axis| T::variable(0.0, start + 3 + axis)),
        })
    }

    /// The parameters of a block of plain numbers, however many.
    ///
    /// # Errors
    /// There is no such block, or it is a pose.
    pub fn plain(&self, block: usize) -> Result<impl ExactSizeIterator<Item = T>, EvaluationFailure> {
        match (self.values.get(block), self.parts.get(block)) {
            (Some(values), Some(&Part { start, is_pose: false })) => {
                Ok(values.iter().enumerate().map(move |(index, &value)| T::variable(value, start + index)))
            }
            (values, _) => Err(Self::unfit(block, values, "plain numbers")),
        }
    }

    #[cold]
    fn unfit(block: usize, values: Option<&&[f64]>, wanted: &str) -> EvaluationFailure {
        let found = values.map_or(0, |values| values.len());
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
    #[inline]
    #[must_use]
    pub fn transform(&self, point: [T; 3]) -> [T; 3] {
        let turned = self.rotate(point);
        std::array::from_fn(|axis| turned[axis] + self.translation[axis])
    }

    /// `p_b` of `p_a`: a point in the camera's frame, where the pose is that of a camera in object space.
    #[inline]
    #[must_use]
    pub fn inverse_transform(&self, point: [T; 3]) -> [T; 3] {
        self.inverse_rotate(std::array::from_fn(|axis| point[axis] - self.translation[axis]))
    }

    /// A direction of frame b in frame a.
    #[inline]
    #[must_use]
    pub fn rotate(&self, vector: [T; 3]) -> [T; 3] {
        // R exp(dθ) v = R (v + dθ × v), exact at dθ = 0.
        let turned = self.turn_of(vector);
        let v: [T; 3] = std::array::from_fn(|axis| vector[axis] + turned[axis]);
        let r = &self.rotation;
        std::array::from_fn(|row| v[0] * r[row][0] + v[1] * r[row][1] + v[2] * r[row][2])
    }

    /// A direction of frame a in frame b.
    #[inline]
    #[must_use]
    pub fn inverse_rotate(&self, vector: [T; 3]) -> [T; 3] {
        let r = &self.rotation;
        let v: [T; 3] =
            std::array::from_fn(|row| vector[0] * r[0][row] + vector[1] * r[1][row] + vector[2] * r[2][row]);
        let turned = self.turn_of(v);
        std::array::from_fn(|axis| v[axis] - turned[axis])
    }

    /// Where the perspective centre of a camera lies.
    pub fn translation(&self) -> [T; 3] {
        self.translation
    }

    /// dθ × v. As dθ is zero, the derivatives of v have no part in it.
    #[inline]
    fn turn_of(&self, vector: [T; 3]) -> [T; 3] {
        let [x, y, z] = self.turn;
        let v = vector.map(T::value);
        [y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]]
    }
}

/// An observation with derivatives by dual numbers, made from one [`ResidualFunction`] of `D` components on blocks with at
/// most `N` parameters in all (poses have six).
///
/// The derivatives are exact to rounding. With `N` as large as needed and not larger, a solution takes less than twice as
/// long as with Jacobians derived by hand (`cargo bench -p adjust --bench derivatives`).
///
/// ```
/// use adjust::{
///     Adjustment, Covariance, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real, ResidualFunction,
///     SolveOptions,
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
/// # fn main() -> Result<(), adjust::Error> {
/// let mut a = Adjustment::new();
/// let decay = a.add_block(ParameterBlock::euclidean([1.0, 1.0]).with_parameter_names(["amount", "rate"]));
/// let group = a.add_group("activities");
/// for time in [0.0, 1.0, 2.0, 4.0] {
///     let model = Decay { time, observed: 3.0 * (-0.5 * time).exp() };
///     let observation = Differentiated::<2, 1, _>::new(&a, [decay], model)?;
///     a.add_observation(group, observation, &Covariance::from_sigma(0.01))?;
/// }
/// let solution = a.solve(&SolveOptions::default())?;
/// assert!((solution.values(decay)?[1] - 0.5).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Differentiated<const N: usize, const D: usize, F> {
    blocks: Vec<BlockId>,
    parts: Vec<Part>,
    function: F,
}

impl<const N: usize, const D: usize, F: ResidualFunction<D>> Differentiated<N, D, F> {
    /// An observation on blocks of the adjustment that it will be added to.
    ///
    /// # Errors
    /// A block is unknown; the blocks have more than `N` parameters; or one lies on a manifold of another kind than
    /// [`crate::Euclidean`] and [`RigidPose`]: its Jacobian has to be derived by hand.
    pub fn new(adjustment: &Adjustment<'_>, blocks: impl Into<Vec<BlockId>>, function: F) -> crate::Result<Self> {
        let blocks = blocks.into();
        let mut parts = Vec::with_capacity(blocks.len());
        let mut start = 0;
        for &id in &blocks {
            let block = adjustment.block(id)?;
            let manifold: &dyn std::any::Any = &*block.manifold;
            let is_pose = manifold.is::<RigidPose>();
            if !is_pose && !manifold.is::<Euclidean>() {
                let reason = "dual numbers are made for plain parameters and rigid poses";
                return Err(Error::Untestable { what: format!("block `{}`", block.label(id.index())), reason });
            }
            parts.push(Part { start, is_pose });
            start += block.tangent_dimension();
        }
        if start > N {
            let what = format!("the blocks have {start} parameters: a dual number of this observation");
            return Err(Error::Length { what, expected: start, found: N });
        }
        Ok(Self { blocks, parts, function })
    }

    #[inline]
    fn residual<T: Real>(&self, values: &[&[f64]]) -> Result<[T; D], EvaluationFailure> {
        let parameters = Parameters { values, parts: &self.parts, number: std::marker::PhantomData };
        self.function.residual(&parameters)
    }
}

impl<const N: usize, const D: usize, F: ResidualFunction<D>> Observation for Differentiated<N, D, F> {
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
            residual.copy_from_slice(&self.residual::<f64>(parameters)?);
            return Ok(());
        };
        let found = with_wide_registers(
            #[inline]
            || self.residual::<Dual<N>>(parameters),
        )?;
        for (row, (out, dual)) in residual.iter_mut().zip(&found).enumerate() {
            *out = dual.value;
            for (block, part) in self.parts.iter().enumerate() {
                // A is the Jacobian of the model, which v has with the other sign.
                let derivatives = dual.derivatives[part.start..].iter();
                jacobians.row(block, row).iter_mut().zip(derivatives).for_each(|(out, d)| *out = -d);
            }
        }
        Ok(())
    }
}
