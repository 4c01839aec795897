use std::collections::BTreeMap;
use std::sync::Arc;

use crate::model::exclusion::Exclusion;
use crate::{
    BlockId, Covariance, DatumDefect, Error, GroupId, Kernel, Observation, ObservationId, ParameterBlock, Result,
};
use observation_equations::PriorObservation;

/// A Gauss-Markov model being put together: blocks, observations, constraints and datum.
///
/// `'a` is the lifetime of what observations borrow.
#[derive(Default)]
pub struct Adjustment<'a> {
    pub(crate) blocks: Vec<ParameterBlock>,
    pub(crate) groups: Vec<Group>,
    pub(crate) observations: Vec<StoredObservation<'a>>,
    /// Whitening matrices of all observations, see [`Covariance::whitening`]; excluded components are not correlated.
    pub(crate) whitening: Vec<f64>,
    pub(crate) constraints: Vec<Box<dyn Observation + 'a>>,
    pub(crate) datum: Option<Datum>,
    /// Excluded components, by number of the observation.
    pub(crate) exclusions: BTreeMap<usize, Exclusion>,
    prior_group: Option<GroupId>,
}

/// An observation with its place in the stochastic model.
pub(crate) struct StoredObservation<'a> {
    pub(crate) observation: Box<dyn Observation + 'a>,
    pub(crate) group: GroupId,
    /// Start of its whitening matrix.
    pub(crate) whitening: usize,
}

/// Observations of one kind.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    pub(crate) name: String,
    pub(crate) kernel: Kernel,
}

/// Inner constraints on chosen points.
#[derive(Debug, Clone)]
pub(crate) struct Datum {
    pub(crate) points: Vec<BlockId>,
    pub(crate) defect: DatumDefect,
}

impl std::fmt::Debug for Adjustment<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Adjustment")
            .field("blocks", &self.blocks.len())
            .field("observations", &self.observations.len())
            .field("constraints", &self.constraints.len())
            .field("datum", &self.datum)
            .finish_non_exhaustive()
    }
}

/// The blocks in the order of adding, with their approximate values.
impl AsRef<[ParameterBlock]> for Adjustment<'_> {
    fn as_ref(&self) -> &[ParameterBlock] {
        &self.blocks
    }
}

impl<'a> Adjustment<'a> {
    /// An empty model.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds unknown parameters with their approximate values. What is wrong with the values is said by the solution.
    pub fn add_block(&mut self, block: ParameterBlock) -> BlockId {
        self.blocks.push(block);
        BlockId::new(self.blocks.len() - 1)
    }

    /// Holds all parameters of a block at their values: they are no unknowns.
    pub fn hold(&mut self, block: BlockId) -> Result<()> {
        self.block_mut(block)?.held.fill(true);
        Ok(())
    }

    /// Holds one parameter (component of the tangent step) of a block.
    pub fn hold_parameter(&mut self, block: BlockId, component: usize) -> Result<()> {
        let held = &mut self.block_mut(block)?.held;
        let count = held.len();
        let flag = held.get_mut(component).ok_or(Error::UnknownId { what: "parameter", index: component, count })?;
        *flag = true;
        Ok(())
    }

    /// Makes all parameters of a block unknowns again.
    pub fn release(&mut self, block: BlockId) -> Result<()> {
        self.block_mut(block)?.held.fill(false);
        Ok(())
    }

    /// The approximate values of a block.
    pub fn values(&self, block: BlockId) -> Result<&[f64]> {
        Ok(&self.block(block)?.values)
    }

    /// Replaces the approximate values of a block, for another start.
    pub fn set_values(&mut self, block: BlockId, values: &[f64]) -> Result<()> {
        self.block(block)?.check(block.index(), values)?;
        values.clone_into(&mut self.block_mut(block)?.values);
        Ok(())
    }

    /// Adds a group: observations of one kind, reported together.
    pub fn add_group(&mut self, name: impl Into<String>) -> GroupId {
        self.groups.push(Group { name: name.into(), kernel: Kernel::default() });
        GroupId(self.groups.len() - 1)
    }

    /// Makes the observations of a group robust against gross errors.
    pub fn set_kernel(&mut self, group: GroupId, kernel: Kernel) -> Result<()> {
        kernel.check()?;
        let count = self.groups.len();
        let unknown = Error::UnknownId { what: "group", index: group.0, count };
        self.groups.get_mut(group.0).ok_or(unknown)?.kernel = kernel;
        Ok(())
    }

    /// Adds an observation with its covariance matrix (a priori).
    ///
    /// # Errors
    /// The group or a block does not exist, the dimension is zero or differs from the covariance's, or the covariance
    /// is not positive definite.
    pub fn add_observation(
        &mut self,
        group: GroupId,
        observation: impl Observation + 'a,
        covariance: &Covariance,
    ) -> Result<ObservationId> {
        let count = self.groups.len();
        let unknown = Error::UnknownId { what: "group", index: group.0, count };
        let name = self.groups.get(group.0).ok_or(unknown)?.name.clone();
        self.check_observation(&observation, &name)?;
        let (dimension, whitening) = (observation.dimension(), self.whitening.len());
        covariance.whitening(&name, dimension, &mut self.whitening)?;
        let observation = Box::new(observation);
        self.observations.push(StoredObservation { observation, group, whitening });
        Ok(ObservationId(self.observations.len() - 1))
    }

    /// Weights a block: its parameters were known before as `values` (ambient) with `covariance` (of the tangent step
    /// at `values`). Priors are observations of the group `prior`.
    pub fn add_prior(&mut self, block: BlockId, values: &[f64], covariance: &Covariance) -> Result<ObservationId> {
        let target = self.block(block)?;
        target.check(block.index(), values)?;
        let manifold = Arc::clone(&target.manifold);
        let group = self.prior_group();
        self.add_observation(group, PriorObservation::new(block, manifold, values.to_vec()), covariance)
    }

    /// The group that priors belong to, made when it is first needed.
    pub fn prior_group(&mut self) -> GroupId {
        if let Some(group) = self.prior_group {
            return group;
        }
        let group = self.add_group("prior");
        self.prior_group = Some(group);
        group
    }

    /// The group that priors belong to, where there are any.
    pub(crate) fn existing_prior_group(&self) -> Option<GroupId> {
        self.prior_group
    }

    /// Adds constraints that hold exactly: each component of the observation's residual becomes zero.
    /// They are linearised like observations; each takes one unknown away.
    pub fn add_constraint(&mut self, constraint: impl Observation + 'a) -> Result<()> {
        self.check_observation(&constraint, "constraint")?;
        self.constraints.push(Box::new(constraint));
        Ok(())
    }

    /// Gives the network its datum by inner constraints `Gᵀ dx = 0` on the chosen three-dimensional Euclidean blocks
    /// (Eq. 22): position and attitude (six) or also scale (seven) are those that the approximate coordinates of these
    /// points have on average, and the trace of their covariance is as small as it can be. A later call replaces an
    /// earlier one.
    ///
    /// # Errors
    /// A block is unknown, not three-dimensional or named twice, or there are fewer than three points. Points in one
    /// line, or held, are refused by the solution.
    pub fn add_inner_constraints(&mut self, points: &[BlockId], defect: DatumDefect) -> Result<()> {
        for &point in points {
            let block = self.block(point)?;
            if block.tangent_dimension() != 3 || block.manifold.ambient_dimension() != 3 {
                let reason = format!("`{}` is not a block of three coordinates", block.label(point.index()));
                return Err(Error::Datum { reason });
            }
        }
        let mut sorted = points.to_vec();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(Error::Datum { reason: "a point is named twice".to_owned() });
        }
        if points.len() < 3 {
            return Err(Error::Datum { reason: format!("{} points do not carry a datum, three do", points.len()) });
        }
        self.datum = Some(Datum { points: sorted, defect });
        Ok(())
    }

    pub(crate) fn block(&self, block: BlockId) -> Result<&ParameterBlock> {
        let count = self.blocks.len();
        self.blocks.get(block.index()).ok_or(Error::UnknownId { what: "block", index: block.index(), count })
    }

    fn block_mut(&mut self, block: BlockId) -> Result<&mut ParameterBlock> {
        let count = self.blocks.len();
        self.blocks.get_mut(block.index()).ok_or(Error::UnknownId { what: "block", index: block.index(), count })
    }

    fn check_observation(&self, observation: &dyn Observation, group: &str) -> Result<()> {
        for &block in observation.blocks() {
            self.block(block)?;
        }
        if observation.dimension() == 0 {
            return Err(Error::Length { what: format!("observation in `{group}`"), expected: 1, found: 0 });
        }
        Ok(())
    }
}
