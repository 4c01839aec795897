//! One adjustment of all stations from the reduced observations of all pairs.

use adjust::{Adjustment, BlockId, Covariance, FunctionObservation, ParameterBlock, SolveOptions};
use nalgebra::{DVector, Isometry3, Matrix6, Vector6};

use crate::adjustment::sparse_equations::SparseEquations;
use crate::adjustment::turns::MeasuredTurn;
use crate::error::Result;
use crate::planes::reduction::{PairContacts, Reduced};
use crate::relative_pose::{adjustment, relative_pose_parts};
use rigid_pose::{InputError, step_pose};

/// Steps of many stations onto what their pairs observe: relative poses bend with large turns, and contacts are found anew anyway.
const RELATIVE_STEPS: usize = 2;

/// Poses and shared parameters.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub poses: Vec<Isometry3<f64>>,
    pub parameters: Vec<f64>,
}

/// What many stations are held by beside their contacts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Anchors<'a> {
    /// Poses that are known to what the network holds them at.
    pub poses: &'a [Isometry3<f64>],
    /// What variances of contacts are multiplied by.
    pub factor: f64,
}

/// What does not change from round to round.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Network<'a> {
    /// The station that keeps its pose.
    pub fixed: usize,
    /// How well each position is taken to be known where no contact says anything, metre, and each rotation, radian.
    pub hold_m: f64,
    pub turn_rad: f64,
    pub names: &'a [String],
    pub prior: &'a (Vec<f64>, Vec<f64>),
    pub turns: &'a [MeasuredTurn],
    /// Whether the normal matrix is factorised as a whole.
    pub whole: bool,
}

impl Network<'_> {
    /// The same with each pose taken to be known to a length, rotations at the radius at which they are held now.
    pub(crate) fn near(&self, known_m: f64) -> Self {
        Self { hold_m: known_m, turn_rad: known_m / self.hold_m, ..*self }
    }

    /// One over the variance of a component of a pose where no contact says anything.
    pub(crate) fn hold_weight(&self, component: usize) -> f64 {
        if component < 3 { self.hold_m.powi(-2) } else { self.turn_rad.powi(-2) }
    }

    /// One linearised step for all unknowns.
    pub(crate) fn solve(&self, state: &State, pairs: &[(&PairContacts, Reduced)]) -> Result<State> {
        if state.poses.len() == 1 && state.parameters.is_empty() {
            return Ok(state.clone());
        }
        let mut network = Adjustment::new();
        let mut stations = Vec::with_capacity(state.poses.len());
        for (index, pose) in state.poses.iter().enumerate() {
            let block = network.add_block(ParameterBlock::pose(pose).named(format!("station {index}")));
            if index == self.fixed {
                network.hold(block).map_err(adjustment)?;
            } else {
                let sigmas = [0, 1, 2, 3, 4, 5].map(|k| if k < 3 { self.hold_m } else { self.turn_rad });
                let values = adjust::RigidPose::values(pose);
                network.add_prior(block, &values, &Covariance::from_sigmas(&sigmas)).map_err(adjustment)?;
            }
            stations.push(block);
        }
        let shared = self.shared_block(&mut network, state)?;
        let group = network.add_group("contacts of surfaces");
        for (pair_contacts, reduced) in pairs.iter().filter(|(_, reduced)| reduced.rows.nrows() > 0) {
            let mut blocks = vec![stations[pair_contacts.target], stations[pair_contacts.source]];
            blocks.extend(shared);
            let observation = observation(blocks, reduced, &state.parameters);
            let unit = Covariance::from_sigmas(&vec![1.0; reduced.rows.nrows()]);
            network.add_observation(group, observation, &unit).map_err(adjustment)?;
        }
        let group = network.add_group("measured turns");
        for (turn, reduced) in self.turns.iter().filter_map(|turn| Some((turn, turn.reduced(&state.poses)?))) {
            let observation = observation(vec![stations[turn.first], stations[turn.second]], &reduced, &[]);
            network.add_observation(group, observation, &Covariance::from_sigmas(&[1.0; 3])).map_err(adjustment)?;
        }
        // Contacts are found anew after each step: below a thousandth of a standard deviation there is nothing to gain.
        let options = SolveOptions { step_tolerance: 1e-3, ..SolveOptions::default() };
        let solution = network.solve(&options).map_err(adjustment)?;
        let poses =
            stations.iter().map(|block| solution.pose(*block)).collect::<std::result::Result<Vec<_>, adjust::Error>>();
        let parameters = match shared {
            Some(block) => solution.values(block).map_err(adjustment)?.to_vec(),
            None => Vec::new(),
        };
        Ok(State { poses: poses.map_err(adjustment)?, parameters })
    }

    /// The same of many stations, of which each meets a few others. `anchors` have the poses that are known beforehand and what the
    /// variances of contacts are multiplied by: far from their places, patches say less than their points promise.
    pub(crate) fn solve_sparse(
        &self,
        state: &State,
        pairs: &[(&PairContacts, Reduced)],
        anchors: &Anchors<'_>,
    ) -> Result<State> {
        let mut state = state.clone();
        let share = anchors.factor.max(1.0).sqrt().recip();
        for _ in 0..RELATIVE_STEPS {
            // The anchors alone fix the frame.
            let mut equations = SparseEquations::new(state.poses.len(), usize::MAX, 0);
            for (pair_contacts, reduced) in pairs.iter().filter(|(_, reduced)| reduced.rows.nrows() > 0) {
                let ends = [pair_contacts.target, pair_contacts.source];
                let values = ends.map(|station| adjust::RigidPose::values(&state.poses[station]));
                let (v, by_target, by_source) =
                    relative_pose_parts(&reduced.pose, &[&values[0], &values[1]]).map_err(|_| {
                        InputError::Numerical { what: "the relative pose of two stations", why: "it is no pose" }
                    })?;
                let residual = share * (&reduced.right - &reduced.rows * v);
                let rows = share * &reduced.rows;
                equations.add_rows(ends, [&(&rows * by_target), &(&rows * by_source)], &residual);
            }
            for turn in self.turns {
                equations.add_turn(turn, &state.poses);
            }
            equations.hold(self, anchors.poses, &state.poses);
            let step = equations.step(&equations.cofactors(self)?);
            for (k, pose) in state.poses.iter_mut().enumerate() {
                *pose = step_pose(pose, &step.fixed_rows::<6>(6 * k).into_owned());
            }
        }
        Ok(state)
    }

    fn shared_block(&self, network: &mut Adjustment<'_>, state: &State) -> Result<Option<BlockId>> {
        if state.parameters.is_empty() {
            return Ok(None);
        }
        let block = ParameterBlock::euclidean(state.parameters.clone()).named("shared parameters");
        let block = network.add_block(block.with_parameter_names(self.names.iter().cloned()));
        let group = network.prior_group();
        for (index, sigma) in self.prior.1.iter().enumerate().filter(|(_, sigma)| sigma.is_finite()) {
            let row = (0..state.parameters.len()).map(|k| f64::from(u8::from(k == index))).collect::<Vec<f64>>();
            let observation = adjust::LinearObservation::new(self.prior.0[index], [(block, row)]);
            network.add_observation(group, observation, &Covariance::from_sigma(*sigma)).map_err(adjustment)?;
        }
        Ok(Some(block))
    }
}

/// The rows of a pair: `√λ vᵀ x` is observed as `−vᵀ g / √λ`.
fn observation(blocks: Vec<BlockId>, reduced: &Reduced, linearised_at: &[f64]) -> impl adjust::Observation + use<> {
    let (rows, right, pose, start) =
        (reduced.rows.clone(), reduced.right.clone(), reduced.pose, linearised_at.to_vec());
    let count = rows.nrows();
    FunctionObservation::new(blocks, count, move |values, residual, jacobians| {
        // v = pose_difference(model, T), so that x = -v.
        let (v, by_target, by_source) = relative_pose_parts(&pose, values)?;
        let mut x = DVector::zeros(rows.ncols());
        x.fixed_rows_mut::<6>(0).copy_from(&-v);
        for (k, first) in start.iter().enumerate() {
            x[6 + k] = values[2][k] - first;
        }
        let predicted = &rows * x;
        for row in 0..count {
            residual[row] = -right[row] - predicted[row];
        }
        if let Some(jacobians) = jacobians {
            let of_pose = rows.columns(0, 6);
            jacobians.set(0, &(of_pose * by_target));
            jacobians.set(1, &(of_pose * by_source));
            if !start.is_empty() {
                jacobians.set(2, &rows.columns(6, start.len()).into_owned());
            }
        }
        Ok(())
    })
}

/// How the relative pose of two stations moves with their poses: Jacobians by target and by source at `state`.
pub(crate) fn relative_jacobians(target: &Isometry3<f64>, source: &Isometry3<f64>) -> [Matrix6<f64>; 2] {
    let relative = target.inverse() * source;
    let values = [adjust::RigidPose::values(target), adjust::RigidPose::values(source)];
    match relative_pose_parts(&relative, &[&values[0], &values[1]]) {
        Ok((_, by_target, by_source)) => [by_target, by_source],
        // Poses have seven values: there is no other way to fail.
        Err(_) => [Matrix6::zeros(); 2],
    }
}

/// Largest movement between two states, metre; rotations at `radius_m`.
pub(crate) fn largest_step(before: &State, after: &State, radius_m: f64) -> f64 {
    let moved = before.poses.iter().zip(&after.poses).map(|(a, b)| {
        let d: Vector6<f64> = rigid_pose::pose_difference(a, b);
        d.fixed_rows::<3>(0).norm().max(d.fixed_rows::<3>(3).norm() * radius_m)
    });
    moved.fold(0.0, f64::max)
}

#[cfg(test)]
#[path = "../../tests/inside/network.rs"]
mod tests;
