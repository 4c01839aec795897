//! One adjustment of all stations from the reduced observations of all pairs.

use nalgebra::{DVector, Isometry3, Vector6};

use crate::adjustment::equations::Equations;
use crate::adjustment::known::Known;
use crate::adjustment::turns::MeasuredTurn;
use crate::error::Result;
use crate::planes::reduction::{PairContacts, Reduced};
use crate::relative_pose::RelativePose;
use crate::surfaces::point_model::Prior;
use rigid_pose::step_pose;

/// Steps onto what pairs observe end below this part of the radius, or after so many: relative poses bend with large turns.
const SMALL_STEP: f64 = 1e-6;
const MOST_STEPS: usize = 6;

/// Poses and shared parameters.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub poses: Vec<Isometry3<f64>>,
    pub parameters: Vec<f64>,
}

impl State {
    /// Takes a step of all unknowns.
    pub(crate) fn moved(&mut self, step: &DVector<f64>) {
        for (k, pose) in self.poses.iter_mut().enumerate() {
            *pose = step_pose(pose, &step.fixed_rows::<6>(6 * k).into_owned());
        }
        let shared = step.rows(6 * self.poses.len(), self.parameters.len());
        self.parameters.iter_mut().zip(shared.iter()).for_each(|(value, step)| *value += step);
    }
}

/// What stations are held by beside their contacts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Anchors<'a> {
    /// The station that keeps its pose; where there is none, the anchors alone fix the frame.
    pub fixed: Option<usize>,
    pub poses: &'a [Isometry3<f64>],
    /// How well these are known.
    pub known: Known,
    /// What variances of contacts are multiplied by: far from their places, patches say less than their points promise.
    pub factor: f64,
}

/// What does not change from round to round.
#[derive(Debug)]
pub(crate) struct Network<'a> {
    /// The station that keeps its pose.
    pub fixed: usize,
    /// How well each position is taken to be known where no contact says anything, metre; attitudes to a radian.
    pub hold_m: f64,
    pub names: Vec<String>,
    pub prior: Prior,
    pub turns: &'a [MeasuredTurn],
    /// Whether few stations are adjusted, or such as are not off each by itself.
    pub whole: bool,
}

impl Network<'_> {
    /// What poses are known to where nothing else says anything.
    pub(crate) fn held(&self) -> Known {
        Known::at(self.hold_m, self.hold_m)
    }

    /// Steps of all unknowns onto what the pairs observe.
    pub(crate) fn solve(
        &self,
        state: &State,
        pairs: &[(&PairContacts, Reduced)],
        anchors: &Anchors<'_>,
    ) -> Result<State> {
        let (mut now, parameters) = (state.clone(), state.parameters.len());
        let share = anchors.factor.max(1.0).sqrt().recip();
        for _ in 0..MOST_STEPS {
            let mut equations = Equations::new(now.poses.len(), anchors.fixed, parameters, 0);
            let changed = DVector::from_fn(parameters, |k, _| now.parameters[k] - state.parameters[k]);
            for (pair_contacts, reduced) in pairs.iter().filter(|(_, reduced)| reduced.rows.nrows() > 0) {
                let stations = [pair_contacts.target, pair_contacts.source];
                let (rows, shared) =
                    (share * reduced.rows.fixed_columns::<6>(0), share * reduced.rows.columns(6, parameters));
                let right = share * &reduced.right + &shared * &changed;
                let observed = RelativePose { stations, first_from_second: reduced.pose, rows };
                equations.add_relative_pose(&observed, (parameters > 0).then_some(&shared), &right, &now.poses);
            }
            for turn in self.turns {
                equations.add_turn(turn, &now.poses);
            }
            equations.hold(anchors.known, anchors.poses, &now.poses);
            equations.add_prior(&self.prior, &now.parameters);
            let before = now.clone();
            now.moved(&equations.step(&equations.cofactors(anchors.known)?));
            if largest_step(&before, &now, self.hold_m) <= SMALL_STEP * self.hold_m {
                break;
            }
        }
        Ok(now)
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
