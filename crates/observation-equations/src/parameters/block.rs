use std::sync::Arc;

use nalgebra::Isometry3;

use crate::{Error, Euclidean, Manifold, Result, RigidPose};

/// Approximate values of parameters that belong together, with the manifold on which they are stepped.
#[derive(Debug, Clone)]
pub struct ParameterBlock {
    /// Ambient values.
    pub values: Vec<f64>,
    /// How they are stepped.
    pub manifold: Arc<dyn Manifold>,
    /// Name of the block.
    pub name: Option<String>,
    /// Names of the parameters, as far as they have their own.
    pub parameter_names: Vec<String>,
    /// Which tangent components are not estimated.
    pub held: Vec<bool>,
}

impl ParameterBlock {
    /// A block of plain numbers.
    pub fn euclidean(values: impl Into<Vec<f64>>) -> Self {
        let values = values.into();
        let manifold = Euclidean(values.len());
        Self::manifold(values, manifold)
    }

    /// A block on a manifold; `values` are ambient.
    pub fn manifold(values: impl Into<Vec<f64>>, manifold: impl Manifold + 'static) -> Self {
        let held = vec![false; manifold.tangent_dimension()];
        Self { values: values.into(), manifold: Arc::new(manifold), name: None, parameter_names: Vec::new(), held }
    }

    /// A rigid pose, see [`RigidPose`].
    pub fn pose(pose: &Isometry3<f64>) -> Self {
        Self::manifold(RigidPose::values(pose), RigidPose)
    }

    /// Gives the block a name, for messages and tables. A block of one parameter lends it to the parameter;
    /// the parameters of others are called `name.component`.
    #[must_use]
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Gives each parameter (tangent component) a name of its own, used as it is. Names beyond the block's dimension
    /// are ignored; missing ones are made from the block's name.
    #[must_use]
    pub fn with_parameter_names<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.parameter_names = names.into_iter().map(Into::into).collect();
        self
    }

    /// Number of unknowns of the block when none is held.
    pub fn tangent_dimension(&self) -> usize {
        self.manifold.tangent_dimension()
    }

    /// Name of the block, or its number where it has none.
    pub fn label(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("block {index}"))
    }

    /// Name of a parameter (tangent component) of the block of this number.
    pub fn parameter_name(&self, index: usize, component: usize) -> String {
        if let Some(name) = self.parameter_names.get(component) {
            return name.clone();
        }
        let label = self.label(index);
        match self.manifold.tangent_name(component) {
            Some(part) => format!("{label}.{part}"),
            None if self.tangent_dimension() == 1 => label,
            None => format!("{label}.{component}"),
        }
    }

    /// Checks length, finiteness and the manifold's own rule.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::InvalidBlock`].
    pub fn check(&self, index: usize, values: &[f64]) -> Result<()> {
        let expected = self.manifold.ambient_dimension();
        if values.len() != expected {
            let what = format!("parameter block `{}`", self.label(index));
            return Err(Error::Length { what, expected, found: values.len() });
        }
        let finite = if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err("not finite") };
        finite.and_then(|()| self.manifold.check(values)).map_err(|reason| Error::InvalidBlock {
            block: self.label(index),
            values: values.to_vec(),
            reason,
        })
    }
}
