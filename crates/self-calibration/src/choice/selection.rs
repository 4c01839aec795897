//! Which terms are estimated: those of a list, or what the observations speak for.

use std::borrow::Cow;
use std::collections::BTreeSet;

use calibration_network::functional_model::{SINES, camera_names};
use error_models::AmplitudeHyperbola;

use crate::choice::hyperbola::{is_worth_trying, with_hyperbola};
use crate::choice::term_words::{expand, with_shape};
use crate::methods::problem::Problem;
use crate::options::ranged_stations;
use crate::{CalibrationOutcome, Method, Network, Result, TermDecision, TermSelection, choice::auto_terms};

/// Knots of the spline that is tried instead of the sines: three to the shortest wave of Eq. 14, so that it can follow all
/// that the sines can, and more.
const KNOTS: usize = 12;
/// By how much Schwarz's criterion has to be lower for a model of another kind: "very strong" evidence
/// `[KassRaftery1995]`.
const CLEAR_MARGIN: f64 = 10.0;

impl Problem<'_> {
    pub(crate) fn calibrate(&self) -> Result<CalibrationOutcome> {
        match &self.options.terms {
            TermSelection::List(names) => {
                let (network, terms) = expand(self.network, names, self.options)?;
                Problem { network: &network, ..*self }.listed(&terms)
            }
            TermSelection::Auto => self.automatic(),
        }
    }

    /// Estimates the terms of a list. A hyperbola without start values takes them from a calibration without it.
    fn listed(&self, terms: &BTreeSet<String>) -> Result<CalibrationOutcome> {
        self.require_ranges(terms)?;
        let is_hyperbola = |name: &String| AmplitudeHyperbola::NAMES.contains(&name.as_str());
        if !terms.iter().any(is_hyperbola) {
            return self.run(terms);
        }
        self.require_amplitudes()?;
        if self.network.range_model.hyperbola.is_some() {
            return self.run(terms);
        }
        let (hyperbola, others): (BTreeSet<String>, _) = terms.iter().cloned().partition(is_hyperbola);
        if hyperbola.len() < AmplitudeHyperbola::NAMES.len() {
            return Err(self.needs("start values of h1, h2, h3 in the range model, to hold one and estimate another"));
        }
        let network = with_hyperbola(self.network, &self.run(&others)?)?;
        Problem { network: &network, ..*self }.run(terms)
    }

    /// Chooses the terms of Eqs. 14 and 15, then tries a spline instead of the sines.
    fn automatic(&self) -> Result<CalibrationOutcome> {
        let (network, mut chosen) = self.with_or_without_hyperbola()?;
        let problem = Problem { network: &network, ..*self };
        if network.range_model.further.spline.is_some() {
            return Ok(chosen);
        }
        let tried = match problem.unseen_part() {
            None => problem.with_spline(&chosen).map_err(|error| format!("not possible: {error}")),
            Some([from, to]) => Err(format!(
                "not possible: no range lies from {from:.2} m to {to:.2} m of the ambiguity interval of {:.2} m",
                network.range_model.ambiguity_interval_m
            )),
        };
        match tried {
            Ok(spline) => Ok(better_of(chosen, spline)),
            Err(reason) => {
                chosen.decisions.push(spline_decision(false, f64::NAN, reason));
                Ok(chosen)
            }
        }
    }

    /// The largest part of the ambiguity interval without a range, where it is so large that a coefficient of the spline
    /// would rest on the tails of its neighbours: two knots. A part across the end of the interval ends beyond it.
    fn unseen_part(&self) -> Option<[f64; 2]> {
        let interval = self.network.range_model.ambiguity_interval_m;
        let ranged = ranged_stations(self.network, self.options);
        let seen = self.network.sightings.iter().filter(|seen| ranged[seen.station]);
        let mut ranges: Vec<f64> = seen.filter_map(|seen| Some(seen.range_m?.rem_euclid(interval))).collect();
        ranges.sort_by(f64::total_cmp);
        let first = ranges.first().map_or(interval, |first| first + interval);
        let next = ranges.iter().skip(1).copied().chain([first]);
        let gaps = ranges.iter().zip(next).map(|(from, to)| [*from, to]);
        let largest = gaps.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
        largest.filter(|[from, to]| to - from > 2.0 * interval / KNOTS as f64)
    }

    /// Chooses among the terms of Eqs. 14 and 15; a hyperbola is among them where all ranges have amplitudes, and is
    /// taken if it is the better model.
    fn with_or_without_hyperbola(&self) -> Result<(Cow<'_, Network>, CalibrationOutcome)> {
        let own = Cow::Borrowed(self.network);
        let without = auto_terms::choose(self)?;
        if self.network.range_model.hyperbola.is_some() || self.require_amplitudes().is_err() {
            return Ok((own, without));
        }
        // Residuals that show no hyperbola, or one that the adjustment can't hold on to, speak for the plain model.
        let Ok(network) = with_hyperbola(self.network, &without) else { return Ok((own, without)) };
        if !is_worth_trying(&network, &without) {
            return Ok((own, without));
        }
        match auto_terms::choose(&Problem { network: &network, ..*self }) {
            Ok(with) if comparable_bic(&with) < comparable_bic(&without) => Ok((Cow::Owned(network), with)),
            _ => Ok((own, without)),
        }
    }

    /// Calibrates with a spline in place of the sines, and all else that was chosen.
    fn with_spline(&self, chosen: &CalibrationOutcome) -> Result<CalibrationOutcome> {
        let mut network = self.network.clone();
        let shape = network.range_model.further.shape();
        with_shape(&mut network, &error_models::FurtherShape { spline_knots: Some(KNOTS), ..shape })?;
        let base = |name: &String| name.split('@').next().unwrap_or_default().to_owned();
        let mut terms: BTreeSet<String> = chosen.estimated.iter().map(base).collect();
        terms.retain(|name| !SINES.contains(&name.as_str()));
        terms.extend((0..KNOTS - 1).map(|knot| format!("s{knot}")));
        Problem { network: &network, ..*self }.run(&terms)
    }

    /// Ranges, where any of these terms is one of theirs.
    fn require_ranges(&self, terms: &BTreeSet<String>) -> Result<()> {
        let ranged = ranged_stations(self.network, self.options);
        let seen = &self.network.sightings;
        // Where nothing was seen at all, that is the better answer.
        if seen.is_empty() || seen.iter().any(|seen| seen.range_m.is_some() && ranged[seen.station]) {
            return Ok(());
        }
        let camera = camera_names();
        match terms.iter().find(|name| !camera.contains(&name.as_str())) {
            None => Ok(()),
            Some(name) => Err(self.needs(&format!("ranges to estimate {name}: none takes part"))),
        }
    }

    fn require_amplitudes(&self) -> Result<()> {
        match self.network.sightings.iter().find(|seen| seen.range_m.is_some() && seen.amplitude.is_none()) {
            None => Ok(()),
            Some(seen) => {
                let pair = self.network.pair(seen.station, seen.target);
                Err(self.needs(&format!("amplitudes to estimate h1, h2, h3: {pair} has none")))
            }
        }
    }
}

/// All terms that a network might determine.
pub(crate) fn all_terms(network: &Network, method: Method) -> BTreeSet<String> {
    let camera = camera_names().into_iter().filter(|_| method != Method::Laboratory);
    let hyperbola = network.range_model.hyperbola.map_or(&[][..], |_| &AmplitudeHyperbola::NAMES);
    let fixed = camera.chain(hyperbola.iter().copied()).map(str::to_owned);
    fixed.chain(network.range_model.parameter_names()).collect()
}

/// The sines, or the spline where that is clearly better, with the decision.
fn better_of(mut sines: CalibrationOutcome, mut spline: CalibrationOutcome) -> CalibrationOutcome {
    let delta = comparable_bic(&spline) - comparable_bic(&sines);
    if delta < -CLEAR_MARGIN {
        let reason = format!("instead of the sines: Schwarz's criterion is lower by {:.1}", -delta);
        spline.decisions = std::mem::take(&mut sines.decisions);
        for decision in spline.decisions.iter_mut().filter(|d| d.taken && SINES.contains(&d.terms[0].as_str())) {
            decision.taken = false;
            decision.reason = format!("a spline stands instead ({})", decision.reason);
        }
        spline.decisions.push(spline_decision(true, delta, reason));
        return spline;
    }
    let reason = format!(
        "the sines stay: Schwarz's criterion changes by {delta:+.1} with a spline, less than {CLEAR_MARGIN} for it"
    );
    sines.decisions.push(spline_decision(false, delta, reason));
    sines
}

fn spline_decision(taken: bool, delta_bic: f64, reason: String) -> TermDecision {
    // Neither model is a part of the other: there is no test of one within the other.
    TermDecision { terms: vec![format!("spline{KNOTS}")], taken, significance_p: f64::NAN, delta_bic, reason }
}

/// Schwarz's criterion over all values, rejected ones too: each of these counts as a parameter of its own that takes up
/// its residual. Otherwise a model would look the better for rejecting what contradicts it.
fn comparable_bic(outcome: &CalibrationOutcome) -> f64 {
    let rejected = outcome.rejected() as f64;
    let n = outcome.observations as f64 + rejected;
    let free = outcome.unknowns as f64 - outcome.datum_defect as f64 + 1.0 + rejected;
    n * (outcome.vtpv / n).max(f64::MIN_POSITIVE).ln() + free * n.ln()
}
