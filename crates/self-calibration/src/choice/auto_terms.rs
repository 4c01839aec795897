//! The automatic choice of terms.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use statistics::Distribution;

use crate::choice::selection::all_terms;
use crate::methods::problem::Problem;
use crate::{CalibrationOutcome, Result, TermDecision};

/// Terms that are decided on together.
const GROUPS: [&[&str]; 10] = [
    &["d2", "d3"],
    &["h1", "h2", "h3"],
    &["b1", "b2"],
    &["k3"],
    &["k2"],
    &["p1", "p2"],
    &["d4", "d5"],
    &["d6", "d7"],
    &["e1", "e2"],
    &["k1"],
];
/// Probability of error at which a group is significant.
const LEVEL: f64 = 0.01;
/// The same for the wave of length U.
const LEVEL_OF_LONG_WAVE: f64 = 0.001;

/// Calibrates with all terms, each with what cameras show of it, and says which of them the observations speak for.
///
/// To hold at zero what the observations leave open would promise too much of all that it correlates with: a wave of length U
/// over a part of its length looks like an offset. With its usual size as an observation of zero its doubt stays in the
/// covariance, and a term that the observations show is what they say.
pub(crate) fn choose(problem: &Problem<'_>) -> Result<CalibrationOutcome> {
    let terms = all_terms(problem.network, problem.options.method);
    let mut outcome = problem.run(&terms)?;
    outcome.decisions = decisions(&outcome, terms);
    Ok(outcome)
}

/// Which groups the observations speak for. The group that speaks least for itself leaves, one after the other, as if it had
/// been held at zero: with the estimate x of the group and its covariance, `xᵀ Q⁻¹ x` is what vᵀPv would grow by. A group
/// stays if that is significant (F test) and lowers Schwarz's criterion. One by one, correlated groups would hide each other.
fn decisions(outcome: &CalibrationOutcome, mut terms: BTreeSet<String>) -> Vec<TermDecision> {
    let mut left = Vec::new();
    let mut current = Wald::new(outcome);
    while let Some((group, test)) = current.weakest_group(&terms).filter(|(group, test)| !test.stays(group)) {
        left.push(decision(group, false, &test, &current.offset_gain(group)));
        current = current.without(group);
        for name in group {
            terms.remove(*name);
        }
    }
    let stay = GROUPS.iter().filter(|group| terms.contains(group[0]));
    let stay = stay.filter_map(|group| Some(decision(group, true, &current.test(group)?, &current.offset_gain(group))));
    stay.chain(left).collect()
}

/// Joint test of estimated terms (those of all integration times): as if they had been held at zero.
pub(crate) fn joint_test(outcome: &CalibrationOutcome, terms: &[&str]) -> Option<Test> {
    Wald::new(outcome).test(terms)
}

/// Test of a group.
pub(crate) struct Test {
    /// Probability of estimates as far from zero, were they zero.
    pub(crate) p: f64,
    /// Change of Schwarz's criterion by the group.
    pub(crate) delta_bic: f64,
}

impl Test {
    fn stays(&self, group: &[&str]) -> bool {
        let level = if group[0] == "d2" { LEVEL_OF_LONG_WAVE } else { LEVEL };
        self.p < level && self.delta_bic < 0.0
    }
}

fn decision(group: &[&str], taken: bool, test: &Test, offset_gain: &str) -> TermDecision {
    let verdict =
        if taken { "significant" } else { "not significant enough, known by what cameras show and no better" };
    let criterion = if test.delta_bic < 0.0 { "for" } else { "against" };
    TermDecision {
        terms: group.iter().map(ToString::to_string).collect(),
        taken,
        significance_p: test.p,
        delta_bic: test.delta_bic,
        reason: format!(
            "{verdict}: p = {:.2e}, and Schwarz's criterion speaks {criterion} it ({:+.1}){offset_gain}",
            test.p, test.delta_bic
        ),
    }
}

/// Estimates with their covariance, from which parameters can be taken away as if they had been held at zero.
struct Wald {
    names: Vec<String>,
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    observations: f64,
    redundancy: f64,
    vtpv: f64,
}

impl Wald {
    fn new(outcome: &CalibrationOutcome) -> Self {
        let value = |name: &String| outcome.parameter(name).map_or(f64::NAN, |parameter| parameter.value);
        Self {
            names: outcome.estimated.clone(),
            values: DVector::from_iterator(outcome.estimated.len(), outcome.estimated.iter().map(value)),
            covariance: outcome.covariance.clone(),
            observations: outcome.observations as f64,
            redundancy: outcome.redundancy as f64,
            vtpv: outcome.vtpv,
        }
    }

    /// Places of a group, those of all integration times.
    fn places(&self, group: &[&str]) -> Vec<usize> {
        let base = |name: &String| name.split('@').next().unwrap_or_default().to_owned();
        (0..self.names.len()).filter(|&i| group.contains(&base(&self.names[i]).as_str())).collect()
    }

    fn part(&self, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
        self.covariance.select_rows(rows).select_columns(columns)
    }

    fn test(&self, group: &[&str]) -> Option<Test> {
        let places = self.places(group);
        let factor = self.part(&places, &places).cholesky().filter(|_| !places.is_empty())?;
        let values = self.values.select_rows(&places);
        let growth = values.dot(&factor.solve(&values));
        let k = places.len() as f64;
        let unit = (self.vtpv / self.redundancy.max(1.0)).max(f64::MIN_POSITIVE);
        let fisher = Distribution::Fisher { numerator: k, denominator: self.redundancy.max(1.0) };
        let p = fisher.p_value(growth / (k * unit));
        let ratio = growth / self.vtpv.max(f64::MIN_POSITIVE);
        Some(Test { p, delta_bic: k * self.observations.ln() - self.observations * ratio.ln_1p() })
    }

    /// The group that speaks least for itself.
    fn weakest_group(&self, terms: &BTreeSet<String>) -> Option<(&'static [&'static str], Test)> {
        // Over a part of its length this wave imitates shorter ones: these are judged without it if it can be spared.
        if let Some(long_wave) = GROUPS.into_iter().find(|group| group[0] == "d2" && terms.contains("d2"))
            && let Some(test) = self.test(long_wave).filter(|test| !test.stays(long_wave))
        {
            return Some((long_wave, test));
        }
        let present = GROUPS.into_iter().filter(|group| terms.contains(group[0]));
        let tested = present.filter_map(|group| Some((group, self.test(group)?)));
        // The radial terms leave from the highest on.
        let radial = |group: &[&str]| match group[0] {
            "k1" => terms.contains("k2") || terms.contains("k3"),
            "k2" => terms.contains("k3"),
            _ => false,
        };
        let tested = tested.filter(|(group, _)| !radial(group));
        tested.max_by(|a, b| {
            let badness = |(group, test): &(&[&str], Test)| (!test.stays(group), test.delta_bic);
            let (a, b) = (badness(a), badness(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
    }

    /// The estimate with a group held at zero.
    fn without(&self, group: &[&str]) -> Self {
        let gone = self.places(group);
        let kept: Vec<usize> = (0..self.names.len()).filter(|i| !gone.contains(i)).collect();
        let (cross, own) = (self.part(&kept, &gone), self.part(&gone, &gone));
        let values = self.values.select_rows(&gone);
        let gain = own.cholesky().map_or_else(
            || DMatrix::zeros(kept.len(), gone.len()),
            |factor| factor.solve(&cross.transpose()).transpose(),
        );
        let growth = self.test_growth(&gone);
        Self {
            names: kept.iter().map(|&i| self.names[i].clone()).collect(),
            values: self.values.select_rows(&kept) - &gain * values,
            covariance: self.part(&kept, &kept) - &gain * cross.transpose(),
            observations: self.observations,
            redundancy: self.redundancy + gone.len() as f64,
            vtpv: self.vtpv + growth,
        }
    }

    fn test_growth(&self, places: &[usize]) -> f64 {
        let values = self.values.select_rows(places);
        self.part(places, places).cholesky().map_or(0.0, |factor| values.dot(&factor.solve(&values)))
    }

    /// How much more certain d0 is without the group, where that matters.
    fn offset_gain(&self, group: &[&str]) -> String {
        let deviation = |wald: &Self| wald.places(&["d0"]).first().map(|&i| wald.covariance[(i, i)].max(0.0).sqrt());
        match (deviation(self), deviation(&self.without(group))) {
            (Some(with), Some(without)) if with > 1.5 * without => {
                format!("; d0 is {:.1} times less certain with it", with / without)
            }
            _ => String::new(),
        }
    }
}
