//! Descents that run to where the observations do not depend on a parameter any more.

use crate::descent::iteration::Iteration;
use crate::linearised::evaluation::Want;
use crate::{Adjustment, Error, Method, Result};

/// Share of its derivatives at the start below which a parameter acts no more. Half the digits of a product of two
/// derivatives; plateaus that were met lay below 1e-15.
const VANISHED: f64 = 1e-6;

/// Share of a parameter's derivatives that each step of a cautious descent keeps. From 1e-8 to 1e-2 a curve of
/// saturation is found from all of 400 starts; less caution loses some of them, more caution creeps onto the plateau.
const KEPT: f64 = 1e-4;

impl Iteration<'_, '_> {
    /// The parameter that lost most of its derivatives since the start, where it lost practically all.
    pub(crate) fn vanished(&mut self) -> Result<Option<usize>> {
        let start = self.adjustment.start();
        self.trial.evaluate(self.adjustment, self.layout, &start, Want::Jacobians)?;
        let (before, now) = (self.trial.column_squares(self.layout), self.current.column_squares(self.layout));
        let shares = before.iter().zip(now).map(|(before, now)| now / before);
        let least = shares.enumerate().filter(|(_, share)| *share < VANISHED * VANISHED);
        Ok(least.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(unknown, _)| unknown))
    }

    /// The error of a descent that ran away.
    pub(crate) fn ran_away(&self) -> Error {
        self.not_converged(if self.options.method == Method::GaussNewton {
            "full steps ran away to where the observations do not depend on a parameter; damped steps may find the way"
        } else {
            "the values ran away to where the observations do not depend on a parameter; start closer"
        })
    }

    /// Goes back to the start for a damped descent whose steps leave every parameter its action. One that goes far in one
    /// parameter while another has not yet found its size can end on a plateau, where nothing leads back.
    pub(crate) fn start_again(&mut self) -> Result<()> {
        self.values = self.adjustment.start();
        self.current.evaluate(self.adjustment, self.layout, &self.values, Want::Jacobians)?;
        (self.cautious, self.penalty, self.last_gain) = (true, 0.0, 0.0);
        (self.damping, self.growth) = (self.options.initial_damping, 2.0);
        self.metric.fill(f64::INFINITY);
        self.linearise()
    }

    /// Whether a parameter keeps too little of its action at the trial values.
    pub(crate) fn loses_action(&self) -> bool {
        let (before, after) = (self.current.column_squares(self.layout), self.trial.column_squares(self.layout));
        before.iter().zip(after).any(|(before, after)| after < KEPT * KEPT * before)
    }
}

impl Adjustment<'_> {
    /// The approximate values of all blocks.
    pub(crate) fn start(&self) -> Vec<f64> {
        self.blocks.iter().flat_map(|block| block.values.iter().copied()).collect()
    }
}
