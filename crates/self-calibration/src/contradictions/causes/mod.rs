//! What explains a network that contradicts itself: alternatives of the catalogue, each fitted robustly and compared.

mod control;
mod fit;
mod station;

use std::collections::BTreeSet;

use calibration_network::functional_model::{Misfit, Scales, Setup};
use calibration_network::start_values::{fits_as_given, start_limit, start_range_limit};
use rayon::prelude::*;
use statistics::upper_median;

use crate::choice::selection::all_terms;
use crate::contradictions::catalogue::{Alternative, of_sightings, of_tables};
use crate::contradictions::suspicion::unit_factor;
use crate::findings::contradiction::{Cause, CauseKind, Contradiction};
use crate::methods::problem::Problem;
use crate::options::{datum, ranged_stations};
use crate::{Error, Method, Network, NetworkError, Result, TermSelection};
use fit::{Fit, HALF, WIDESPREAD};
use station::of_station;

/// Natural logarithm of the odds from which on an explanation is believed: one in 500 million.
const BELIEVED: f64 = 20.0;
/// Explanations whose odds differ by less are both told.
const APART: f64 = 10.0;
/// Noise as a share of what start values may be off by: 2 pixels of 176 x 144, and 40 cm of 7.5 m.
const NOISE: f64 = 0.2;
/// Known places that may each be wrong for a reason of its own; for more, one that they have in common is looked for.
const SINGLE: usize = 3;
/// Terms that robust fits leave at their start values where terms are chosen automatically: waves and lens terms that
/// many networks cannot tell from others.
const WEAK_TERMS: [&str; 8] = ["d2", "d3", "b1", "b2", "k3", "h1", "h2", "h3"];

impl Problem<'_> {
    /// A contradiction with what explains it, or with what contradicts most; and whether the observations contradict each
    /// other even where most of them agree best.
    ///
    /// `suspected` are names of stations that are suspected already.
    pub(crate) fn contradiction(
        &self,
        stage: &'static str,
        failure: Option<&Error>,
        suspected: &[String],
    ) -> (Contradiction, bool) {
        let parameter = match failure {
            Some(Error::Network(NetworkError::Adjust(adjust::Error::NotConverged { parameter, .. }))) => {
                Some(parameter.clone())
            }
            _ => None,
        };
        let base = self.fit(self.network);
        let mut causes = base.as_ref().map_or_else(|_| Vec::new(), sigma_units);
        if causes.is_empty() {
            let misplaced = base.as_ref().map_or_else(|_| Vec::new(), Fit::misplaced);
            if misplaced.len() > SINGLE {
                causes = self.of_all(base.as_ref().ok());
            }
            if causes.is_empty() {
                causes = misplaced;
            }
        }
        if causes.is_empty() && (!suspected.is_empty() || base.as_ref().map_or(true, Fit::is_conspicuous)) {
            causes = self.causes(base.as_ref().ok(), suspected);
        }
        let contradicts = base.as_ref().is_ok_and(|fit| !fit.is_consistent());
        let worst = base.ok().and_then(|fit| fit.worst());
        let parameter = parameter.filter(|name| !name.is_empty());
        (Contradiction { stage, causes, worst, parameter }, contradicts)
    }

    fn causes(&self, base: Option<&Fit<'_>>, suspected: &[String]) -> Vec<Cause> {
        let Some(base) = base else { return self.of_all(None) };
        let mut suspects = base.suspects();
        let stations = self.network.stations.iter().enumerate();
        suspects.extend(stations.filter(|(_, station)| suspected.contains(&station.name)).map(|(index, _)| index));
        suspects.sort_unstable();
        suspects.dedup();
        let widespread = suspects.len() as f64 > WIDESPREAD * base.wrong.len() as f64;
        let of_all = if widespread { self.of_all(Some(base)) } else { Vec::new() };
        if !of_all.is_empty() {
            return of_all;
        }
        // Where most stations contradict each other, there are no others to compare one with.
        if suspects.len() as f64 > HALF * base.wrong.len() as f64 {
            return Vec::new();
        }
        let found: Vec<Option<Cause>> = suspects.par_iter().map(|&station| of_station(base, station)).collect();
        let explained: Vec<Cause> = found.iter().flatten().cloned().collect();
        if widespread || !suspects.is_empty() && explained.len() == suspects.len() {
            return explained;
        }
        let of_all = self.of_all(Some(base));
        let odds = |causes: &[Cause]| causes.iter().map(|cause| cause.log_odds).sum::<f64>();
        if odds(&of_all) > odds(&explained) { of_all } else { explained }
    }

    /// What explains all observations at once.
    fn of_all(&self, base: Option<&Fit<'_>>) -> Vec<Cause> {
        let mut alternatives = of_sightings(self.network, None);
        alternatives.extend(of_tables(self.network));
        // Other ranges help no image points that do not fit.
        if base.is_some_and(|base| base.setup.misses()[0] > HALF) {
            alternatives.retain(|found| !found.kind.is_of_ranges());
        }
        // A free network is as good as its mirror image: approximate poses tell which of the mirrored ones is meant.
        if alternatives.iter().any(|found| fits_as_given(&found.network)) {
            alternatives.retain(|found| fits_as_given(&found.network));
        }
        let fits: Vec<Option<Fit<'_>>> = alternatives
            .par_iter()
            .map(|alternative| {
                let fit = Fit::settled(self.alternative(&alternative.network).ok()?)?;
                (fit.is_consistent() && fit.keeps_scale()).then_some(fit)
            })
            .collect();
        let as_stated = Scales { image: 1.0, range: 1.0 };
        let first = |a: &&Fit<'_>, b: &&Fit<'_>| a.implausibility(as_stated).total_cmp(&b.implausibility(as_stated));
        let Some(scales) = fits.iter().flatten().min_by(first).map(Fit::scales) else { return Vec::new() };
        let fitted: Vec<Option<f64>> =
            fits.iter().map(|fit| fit.as_ref().map(|fit| fit.implausibility(scales))).collect();
        let best = fitted.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        // Where not even a start was found, each value counts as hopelessly wrong.
        let before = base.map_or(1e9, |base| base.implausibility(scales).min(1e9));
        if before - best < BELIEVED {
            return Vec::new();
        }
        let near = |(_, fitted): &(&Alternative, &Option<f64>)| fitted.is_some_and(|value| value - best < APART);
        let equal: Vec<&Alternative> = alternatives.iter().zip(&fitted).filter(near).map(|(found, _)| found).collect();
        let Some(first) = equal.first() else { return Vec::new() };
        let words = equal.iter().map(|found| found.words.as_str()).collect::<Vec<_>>().join(", or ");
        vec![Cause {
            kind: first.kind,
            station: None,
            names: Vec::new(),
            words,
            remedy: first.remedy,
            log_odds: before - best,
        }]
    }

    /// A network fitted robustly with the terms of the options.
    fn fit<'n>(&self, network: &'n Network) -> Result<Fit<'n>> {
        let mut setup = self.alternative(network)?;
        setup.settle()?;
        Ok(Fit::new(setup))
    }

    /// Another network with the terms of the options, at its start values.
    fn alternative<'n>(&self, network: &'n Network) -> Result<Setup<'n>> {
        let passive = matches!(self.options.method, Method::JointTwoStep | Method::JointIntegrated);
        let ranged = ranged_stations(network, self.options);
        self.setup(network, &self.robust_terms(), ranged, passive, datum(network, self.options)?)
    }

    fn robust_terms(&self) -> BTreeSet<String> {
        let mut terms = match &self.options.terms {
            TermSelection::List(names) => names.iter().cloned().collect(),
            TermSelection::Auto => all_terms(self.network, self.options.method),
        };
        terms.retain(|name| !WEAK_TERMS.contains(&name.as_str()));
        terms
    }
}

/// Standard deviations in another unit, from how residuals scatter where most observations agree.
fn sigma_units(fit: &Fit<'_>) -> Vec<Cause> {
    // Wrong deviations leave the residuals themselves small.
    let network = fit.setup.network;
    let pixels = upper_median(&mut fit.misfits.iter().filter_map(Misfit::pixels).collect::<Vec<f64>>());
    let ranges =
        upper_median(&mut fit.misfits.iter().filter_map(|misfit| misfit.range_m).map(f64::abs).collect::<Vec<f64>>());
    if pixels > NOISE * start_limit(network) || ranges > NOISE * start_range_limit(network, 0.0) {
        return Vec::new();
    }
    let scales = Scales::new(fit.misfits.iter());
    let kinds = [(scales.image, "image points", "sigma_col and sigma_row"), (scales.range, "ranges", "sigma_range")];
    let cause = |(scale, of, columns): (f64, &str, &str)| {
        let factor = unit_factor(scale)?;
        let way = if factor > 1.0 { "small" } else { "large" };
        let words = format!(
            "the {of} scatter {scale:.3e} times as much as stated: {columns} are a thousand times too {way}, as in another \
             unit"
        );
        let remedy = "mend these columns of observations.csv, or the deviation that was given for all";
        let log_odds = fit.misfits.len() as f64 * scale.ln().abs();
        Some(Cause { kind: CauseKind::SigmaUnit, station: None, names: Vec::new(), words, remedy, log_odds })
    };
    kinds.into_iter().filter_map(cause).collect()
}
