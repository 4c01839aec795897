//! Names the wrong Jacobian behind an adjustment that found no end.

use crate::{Adjustment, BlockId, Error, Observation, ParameterBlock, check_jacobian};

/// Share by which a Jacobian may miss the differences of its model before it is blamed. What is less wrong costs steps,
/// not the end; differences are good to 1e-7.
const WRONG: f64 = 1e-2;
/// Observations whose Jacobians are compared: the first and the last of each group, up to this number.
const SAMPLE: usize = 32;

impl Adjustment<'_> {
    /// Names a wrong Jacobian where it can have caused the error.
    pub(crate) fn blame(&self, error: Error) -> Error {
        if !matches!(error, Error::NotConverged { .. } | Error::RankDeficient { .. }) {
            return error;
        }
        let group_of = |index: usize| self.observations[index].group;
        let count = self.observations.len();
        let is_end = |index: &usize| {
            let (index, group) = (*index, group_of(*index));
            index == 0 || index + 1 == count || group_of(index - 1) != group || group_of(index + 1) != group
        };
        for index in (0..count).filter(is_end).take(SAMPLE) {
            let stored = &self.observations[index];
            if let Some(mut wrong) = self.wrong(stored.observation.as_ref(), &error) {
                if let Error::Jacobian { group, observation, .. } = &mut wrong {
                    (*group, *observation) = (self.groups[stored.group.0].name.clone(), index);
                }
                return wrong;
            }
        }
        let mut constraints = self.constraints.iter().enumerate().take(SAMPLE);
        let wrong = constraints.find_map(|(index, constraint)| {
            let mut wrong = self.wrong(constraint.as_ref(), &error)?;
            if let Error::Jacobian { observation, .. } = &mut wrong {
                *observation = index;
            }
            Some(wrong)
        });
        wrong.unwrap_or(error)
    }

    /// Whether the Jacobian is wrong at the approximate values and beside them: at a kink differences mean nothing.
    fn wrong(&self, observation: &dyn Observation, error: &Error) -> Option<Error> {
        let blocks = |ids: &[BlockId]| ids.iter().map(|id| self.blocks[id.index()].clone()).collect::<Vec<_>>();
        let mut blocks = blocks(observation.blocks());
        let check = check_jacobian(observation, &blocks).ok().filter(|check| check.worst > WRONG)?;
        blocks.iter_mut().for_each(move_a_little);
        check_jacobian(observation, &blocks).ok().filter(|check| check.worst > WRONG)?;
        let (component, place, parameter) = check.place;
        let id = observation.blocks()[place];
        let block = &self.blocks[id.index()];
        // Nobody needs the derivatives with respect to what is held.
        let is_free = !block.held[parameter];
        is_free.then(|| Error::Jacobian {
            group: "constraint".to_owned(),
            observation: 0,
            component,
            parameter: block.parameter_name(id.index(), parameter),
            given: check.analytic,
            differences: check.numeric,
            consequence: Box::new(error.clone()),
        })
    }
}

/// By about a thousandth of the block's size, in no special direction.
fn move_a_little(block: &mut ParameterBlock) {
    let size = block.values.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    let size = if size > 0.0 { size } else { 1.0 };
    let step: Vec<f64> = (0..block.tangent_dimension()).map(|i| 1e-3 * size * (1.0 + 0.3 * i as f64).cos()).collect();
    let from = block.values.clone();
    block.manifold.plus(&from, &step, &mut block.values);
}
