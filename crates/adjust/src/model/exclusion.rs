use nalgebra::DMatrix;

use crate::{Adjustment, Covariance, Error, GroupId, ObservationId, Result};

/// Components of one observation that take no part.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Exclusion {
    /// Which components are excluded.
    pub(crate) mask: Vec<bool>,
    /// Whitening matrix of the whole observation, see [`Covariance::whitening`].
    whole: Vec<f64>,
}

impl Adjustment<'_> {
    /// Leaves one component of an observation out, as a gross error; its other components stay, with their own part of
    /// the covariance matrix. Its residual in the solution is that of a prediction, its redundancy number zero.
    pub fn exclude(&mut self, observation: ObservationId, component: usize) -> Result<()> {
        self.set_excluded(observation, component, Part::Excluded)
    }

    /// Lets a component that was excluded take part again.
    pub fn readmit(&mut self, observation: ObservationId, component: usize) -> Result<()> {
        self.set_excluded(observation, component, Part::Used)
    }

    /// Whether a component is excluded.
    pub fn is_excluded(&self, observation: ObservationId, component: usize) -> Result<bool> {
        self.check_component(observation, component)?;
        Ok(self.exclusions.get(&observation.0).is_some_and(|exclusion| exclusion.mask[component]))
    }

    /// Multiplies the covariance matrices of all observations of a group with `factor`, a variance component.
    pub fn scale_covariance(&mut self, group: GroupId, factor: f64) -> Result<()> {
        let count = self.groups.len();
        if group.0 >= count {
            return Err(Error::UnknownId { what: "group", index: group.0, count });
        }
        let share = 1.0 / factor.sqrt();
        if !(share.is_normal() && factor.is_normal()) {
            return Err(Error::Option { name: "factor", value: factor, expected: "a positive number" });
        }
        for (index, stored) in self.observations.iter().enumerate().filter(|(_, stored)| stored.group == group) {
            let dimension = stored.observation.dimension();
            let packed = dimension * (dimension + 1) / 2;
            self.whitening[stored.whitening..stored.whitening + packed].iter_mut().for_each(|w| *w *= share);
            if let Some(exclusion) = self.exclusions.get_mut(&index) {
                exclusion.whole.iter_mut().for_each(|w| *w *= share);
            }
        }
        Ok(())
    }

    /// Number of excluded components.
    pub(crate) fn excluded_components(&self) -> usize {
        self.exclusions.values().map(|exclusion| exclusion.mask.iter().filter(|&&out| out).count()).sum()
    }

    /// Covariance matrix of a whole observation, excluded components and their correlations included.
    pub(crate) fn whole_covariance(&self, observation: ObservationId) -> Result<DMatrix<f64>> {
        let dimension = self.check_component(observation, 0)?;
        let packed = self.whole_whitening(observation, dimension);
        let root = DMatrix::from_fn(dimension, dimension, |row, column| {
            if column <= row { packed[row * (row + 1) / 2 + column] } else { 0.0 }
        });
        let singular = Error::Decomposition { what: "inversion of a whitening matrix" };
        let factor = root.solve_lower_triangular(&DMatrix::identity(dimension, dimension)).ok_or(singular)?;
        Ok(&factor * factor.transpose())
    }

    fn whole_whitening(&self, observation: ObservationId, dimension: usize) -> &[f64] {
        let start = self.observations[observation.0].whitening;
        let used = &self.whitening[start..start + dimension * (dimension + 1) / 2];
        self.exclusions.get(&observation.0).map_or(used, |exclusion| &exclusion.whole)
    }

    fn set_excluded(&mut self, observation: ObservationId, component: usize, part: Part) -> Result<()> {
        let dimension = self.check_component(observation, component)?;
        let whole = self.whole_whitening(observation, dimension).to_vec();
        let mut mask =
            self.exclusions.get(&observation.0).map_or_else(|| vec![false; dimension], |old| old.mask.clone());
        mask[component] = part == Part::Excluded;
        // What is excluded is not correlated with anything: then the rows of the others do not contain it, and its own
        // whitened row can be given the weight zero.
        let mut covariance = self.whole_covariance(observation)?;
        for (first, second) in (0..dimension).flat_map(|i| (0..dimension).map(move |j| (i, j))) {
            if first != second && (mask[first] || mask[second]) {
                covariance[(first, second)] = 0.0;
            }
        }
        let used = if mask.contains(&true) {
            let group = &self.groups[self.observations[observation.0].group.0].name;
            let mut used = Vec::with_capacity(whole.len());
            Covariance::from_matrix(&covariance).whitening(group, dimension, &mut used)?;
            self.exclusions.insert(observation.0, Exclusion { mask, whole });
            used
        } else {
            self.exclusions.remove(&observation.0);
            whole
        };
        let start = self.observations[observation.0].whitening;
        self.whitening[start..start + used.len()].copy_from_slice(&used);
        Ok(())
    }

    /// The dimension of the observation, where it has this component.
    fn check_component(&self, observation: ObservationId, component: usize) -> Result<usize> {
        let count = self.observations.len();
        let stored = self.observations.get(observation.0);
        let unknown = Error::UnknownId { what: "observation", index: observation.0, count };
        let dimension = stored.ok_or(unknown)?.observation.dimension();
        let unknown = Error::UnknownId { what: "component", index: component, count: dimension };
        if component < dimension { Ok(dimension) } else { Err(unknown) }
    }
}

/// Whether a component takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Used,
    Excluded,
}
