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

    /// A step of all unknowns onto what the pairs observe.
    pub(crate) fn solve(
        &self,
        state: &State,
        pairs: &[(&PairContacts, Reduced)],
        anchors: &Anchors<'_>,
    ) -> Result<State> {
        let (poses, parameters) = (&state.poses, state.parameters.len());
        let share = anchors.factor.max(1.0).sqrt().recip();
        let mut equations = Equations::new(poses.len(), anchors.fixed, parameters, 0);
        for (pair_contacts, reduced) in pairs.iter().filter(|(_, reduced)| reduced.rows.nrows() > 0) {
            let stations = [pair_contacts.target, pair_contacts.source];
            let rows = share * reduced.rows.fixed_columns::<6>(0);
            let shared = share * reduced.rows.columns(6, parameters);
            let observed = RelativePose { stations, first_from_second: reduced.pose, rows };
            let shared = (parameters > 0).then_some(&shared);
            equations.add_relative_pose(&observed, shared, &(share * &reduced.right), poses);
        }
        for turn in self.turns {
            equations.add_turn(turn, poses);
        }
        equations.hold(anchors.known, anchors.poses, poses);
        equations.add_prior(&self.prior, &state.parameters);
        let mut next = state.clone();
        next.moved(&equations.step(&equations.cofactors(anchors.known)?));
        Ok(next)
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
