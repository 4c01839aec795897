//! What explains a network that contradicts itself: alternatives of the catalogue, each fitted robustly and compared.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use super::calibrate::{Problem, datum, ranged_stations};
use super::catalogue::{Alternative, of_labels, of_sightings, of_tables};
use super::contradiction::{Cause, CauseKind, Contradiction, WorstValue};
use super::misfit::{Misfit, Scales, implausibility, median};
use super::problem::{Calibration, Excluded, Setup};
use super::selection::all_terms;
use super::settle::{start_limit, start_range_limit};
use super::start::fits_as_given;
use super::start_finder::station_pose;
use super::suspicion::{EXPLAINED_SCALE, is_too_many, unit_factor};
use super::{Method, Network, TermSelection};
use crate::{Error, Result};

/// Natural logarithm of the odds from which on an explanation is believed: one in 500 million.
const BELIEVED: f64 = 20.0;
/// Explanations whose odds differ by less are both told.
const APART: f64 = 10.0;
/// Share of stations with too much wrong from which on the cause is looked for in all at once.
const WIDESPREAD: f64 = 1.0 / 3.0;
/// Noise as a share of what start values may be off by: 2 pixels of 176 x 144, and 40 cm of 7.5 m.
const NOISE: f64 = 0.2;
/// Share of image points or ranges.
const HALF: f64 = 0.5;
/// Explanations of a station that are fitted together with all other stations: those that fit it best beside them.
const FITTED: usize = 3;
/// Robust standard deviation of unit weight beyond which the observations as a whole are in doubt.
const CONSPICUOUS: f64 = 1.5;
/// Factor within which a network is as large as it was given.
const SAME_SIZE: f64 = 1.5;
/// Terms that robust fits leave at their start values where terms are chosen automatically: waves and lens terms that
/// many networks cannot tell from others.
const WEAK_TERMS: [&str; 8] = ["d2", "d3", "b1", "b2", "k3", "h1", "h2", "h3"];

/// A network fitted robustly.
struct Fit<'n> {
    setup: Setup<'n>,
    misfits: Vec<Misfit>,
    /// Of each station: sightings that contradict, and all.
    wrong: Vec<(usize, usize)>,
}

impl<'n> Fit<'n> {
    fn new(setup: Setup<'n>) -> Self {
        let misfits = setup.misfits();
        let contradicting = setup.contradicting();
        let mut wrong = vec![(0, 0); setup.network.stations.len()];
        for (index, seen) in setup.network.sightings.iter().enumerate() {
            wrong[seen.station].1 += 1;
            let image = contradicting.image_points.contains(&index);
            wrong[seen.station].0 += usize::from(image || contradicting.ranges.contains(&index));
        }
        Self { setup, misfits, wrong }
    }

    /// The same, where start values explain at least half of the observations: from farther off no fit explains them.
    fn settled(mut setup: Setup<'n>) -> Option<Self> {
        if setup.misses().into_iter().any(|share| share > HALF) {
            return None;
        }
        setup.settle().ok()?;
        Some(Self::new(setup))
    }

    /// Stations with more wrong than single errors explain.
    fn suspects(&self) -> Vec<usize> {
        let [wrong, of] = [0, 1].map(|part| self.wrong.iter().map(|(wrong, of)| [*wrong, *of][part]).sum::<usize>());
        let ordinary = |(own, seen): (usize, usize)| (wrong - own) as f64 / (of - seen).max(1) as f64;
        let suspected = |station: &usize| {
            let (own, seen) = self.wrong[*station];
            is_too_many(own, seen, ordinary((own, seen)))
        };
        (0..self.wrong.len()).filter(suspected).collect()
    }

    /// Whether anything speaks against the observations: a station, or how they scatter.
    fn is_conspicuous(&self) -> bool {
        let scales = Scales::new(self.misfits.iter());
        !self.suspects().is_empty() || scales.image > CONSPICUOUS || scales.range > CONSPICUOUS
    }

    /// Whether most stations agree, with residuals of the size of the noise.
    fn is_consistent(&self) -> bool {
        let few = self.suspects().len() as f64 <= WIDESPREAD * self.wrong.len() as f64;
        few && is_noise(&self.misfits)
    }

    /// Whether the network came out about as large as it was given. Ranges give a free network its scale: in another
    /// unit they would fit any.
    fn keeps_scale(&self) -> bool {
        let start = &self.setup.start;
        let places = self.setup.network.stations.iter().zip(&start.stations);
        let places = places
            .filter_map(|(given, found)| Some((given.world_from_camera?.translation.vector, found.translation.vector)));
        let points = self.setup.network.targets.iter().zip(&start.targets);
        let points = points.filter_map(|(given, found)| Some((given.point?.coords, (*found)?.coords)));
        // Given poses may be wrong where coordinates are right, and the other way round.
        let ratios = [places.unzip(), points.unzip()].map(|(given, found): (Vec<Vector3<f64>>, Vec<Vector3<f64>>)| {
            (given.len() >= 3).then(|| size(&found) / size(&given))
        });
        let mut ratios = ratios.into_iter().flatten().peekable();
        ratios.peek().is_none() || ratios.any(|ratio| (1.0 / SAME_SIZE..=SAME_SIZE).contains(&ratio))
    }

    /// Implausibility of a station's sightings where the network is another at that station; `None` where more of them
    /// contradict than single errors explain.
    fn with_station(&self, network: &Network, station: usize, pose: Isometry3<f64>) -> Option<f64> {
        let mut setup = Setup { network, excluded: Excluded::default(), ..self.setup.clone() };
        setup.start.stations[station] = pose;
        setup.resettle().ok()?;
        let fit = Fit::new(setup);
        let (wrong, of) = fit.wrong[station];
        let own = fit.misfits.iter().zip(&network.sightings).filter(|(_, seen)| seen.station == station);
        let own: Vec<Misfit> = own.map(|(misfit, _)| *misfit).collect();
        (is_noise(&own) && !is_too_many(wrong, of, 0.0)).then(|| implausibility(own.iter()))
    }

    fn implausibility(&self) -> f64 {
        // A sighting that nothing predicts is as implausible as can be.
        let lost = Misfit { image: Some(f64::INFINITY), ..Misfit::default() };
        let pairs = self.misfits.iter().zip(&self.setup.network.sightings);
        let known = pairs.map(|(m, seen)| if m.image.is_none() && seen.pixel.is_some() { &lost } else { m });
        implausibility(known)
    }

    fn worst(&self) -> Option<WorstValue> {
        let size = |m: &Misfit| m.image.unwrap_or(0.0).max(m.range.unwrap_or(0.0));
        let (index, misfit) = self.misfits.iter().enumerate().max_by(|a, b| size(a.1).total_cmp(&size(b.1)))?;
        Some(worst_value(self.setup.network, index, misfit))
    }
}

/// Whether residuals scatter about as stated.
fn is_noise(misfits: &[Misfit]) -> bool {
    let scales = Scales::new(misfits.iter());
    // NaN: there are none.
    [scales.image, scales.range].into_iter().all(|scale| scale.is_nan() || scale <= EXPLAINED_SCALE)
}

fn worst_value(network: &Network, sighting: usize, misfit: &Misfit) -> WorstValue {
    let seen = &network.sightings[sighting];
    let of_image = misfit.image.unwrap_or(0.0) >= misfit.range.unwrap_or(0.0);
    let (component, observed, residual) = if of_image {
        let [col, row] = seen.pixel.unwrap_or([f64::NAN; 2]);
        let [v_col, v_row] = misfit.pixel.unwrap_or([f64::NAN; 2]);
        ("image point", format!("col {col:.2}, row {row:.2}"), format!("{v_col:.2} and {v_row:.2} pixel"))
    } else {
        let [range, residual] = [seen.range_m, misfit.range_m].map(|value| value.unwrap_or(f64::NAN));
        ("range", format!("{range:.3} m"), format!("{residual:.3} m"))
    };
    let station = network.stations[seen.station].name.clone();
    let target = network.targets[seen.target].name.clone();
    WorstValue { sighting, station, target, component, observed, residual, place: None }
}

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
            Some(Error::Adjust(adjust::Error::NotConverged { parameter, .. })) => Some(parameter.clone()),
            _ => None,
        };
        let base = self.fit(self.network);
        let mut causes = base.as_ref().map_or_else(|_| Vec::new(), sigma_units);
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
        let fitted: Vec<Option<f64>> = alternatives
            .par_iter()
            .map(|alternative| {
                let setup = self.alternative(&alternative.network).ok()?;
                let fit = Fit::settled(setup)?;
                (fit.is_consistent() && fit.keeps_scale()).then(|| fit.implausibility())
            })
            .collect();
        let Some(best) = fitted.iter().flatten().copied().min_by(f64::total_cmp) else { return Vec::new() };
        // Where not even a start was found, each value counts as hopelessly wrong.
        let before = base.map_or(1e9, |base| base.implausibility().min(1e9));
        if before - best < BELIEVED {
            return Vec::new();
        }
        let near = |(_, fitted): &(&Alternative, &Option<f64>)| fitted.is_some_and(|value| value - best < APART);
        let equal: Vec<&Alternative> = alternatives.iter().zip(&fitted).filter(near).map(|(found, _)| found).collect();
        let Some(first) = equal.first() else { return Vec::new() };
        let words = equal.iter().map(|found| found.words.as_str()).collect::<Vec<_>>().join(", or ");
        vec![Cause { kind: first.kind, station: None, words, remedy: first.remedy, log_odds: before - best }]
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

/// Median distance of points from their centre.
fn size(points: &[Vector3<f64>]) -> f64 {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    median(points.iter().map(|point| (point - centre).norm()).collect())
}

/// Standard deviations in another unit, from how residuals scatter where most observations agree.
fn sigma_units(fit: &Fit<'_>) -> Vec<Cause> {
    // Wrong deviations leave the residuals themselves small.
    let network = fit.setup.network;
    let pixels = median(fit.misfits.iter().filter_map(Misfit::pixels).collect());
    let ranges = median(fit.misfits.iter().filter_map(|misfit| misfit.range_m).map(f64::abs).collect());
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
        Some(Cause { kind: CauseKind::SigmaUnit, station: None, words, remedy, log_odds })
    };
    kinds.into_iter().filter_map(cause).collect()
}

/// What explains the sightings of one station: alternatives are compared beside the other stations as they are, and those
/// that fit best adjusted together with these, which may have followed the wrong ones.
fn of_station(base: &Fit<'_>, station: usize) -> Option<Cause> {
    let network = base.setup.network;
    let name = &network.stations[station].name;
    let judge = Judge { calibration: &base.setup.calibration, targets: &base.setup.start.targets, station };
    let given = base.setup.start.stations[station];
    let unmoved = judge.resected(network);
    let (before, pose) = judge.best(network, [Some(given), unmoved])?;
    let mut alternatives = of_sightings(network, Some(station));
    alternatives.extend(of_labels(network, station));
    alternatives.extend(judge.unwrapped(network, &pose));
    let judged = alternatives.into_iter().filter_map(|alternative| {
        let ranges = alternative.kind.is_of_ranges();
        let found = if ranges { unmoved } else { judge.resected(&alternative.network) };
        let (after, pose) = judge.best(&alternative.network, [Some(pose), found])?;
        Some((after, pose, alternative))
    });
    let mut judged: Vec<(f64, Isometry3<f64>, Alternative)> = judged.collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    judged.retain(|(_, pose, alternative)| judge.is_near(&alternative.network, pose));
    judged.truncate(FITTED);
    if judged.is_empty() {
        return None;
    }
    // As it is, it may fit as well once the others have been found from it.
    let before = base.with_station(network, station, pose).map_or(before, |unchanged| before.min(unchanged));
    let fitted = judged.into_iter().filter_map(|(_, pose, alternative)| {
        let after = base.with_station(&alternative.network, station, pose)?;
        (before - after > BELIEVED).then_some((after, alternative))
    });
    let (after, found) = fitted.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Cause {
        kind: found.kind,
        station: Some(name.clone()),
        words: format!("station `{name}`: {}", found.words),
        remedy: found.remedy,
        log_odds: before - after,
    })
}

/// Judges one station against targets and calibration found with the others.
struct Judge<'f> {
    calibration: &'f Calibration,
    targets: &'f [Option<Point3<f64>>],
    station: usize,
}

impl Judge<'_> {
    /// The pose that the image points of a network give the station.
    fn resected(&self, network: &Network) -> Option<Isometry3<f64>> {
        station_pose(network, self.calibration, self.targets, self.station)
    }

    /// Implausibility and pose, of the pose that fits best.
    fn best(&self, network: &Network, poses: [Option<Isometry3<f64>>; 2]) -> Option<(f64, Isometry3<f64>)> {
        let judged =
            poses.into_iter().flatten().map(|pose| (implausibility(self.misfits(network, &pose).iter()), pose));
        judged.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Whether the image points typically are as near as start values must be.
    fn is_near(&self, network: &Network, pose: &Isometry3<f64>) -> bool {
        let pixels = self.misfits(network, pose).iter().filter_map(Misfit::pixels).collect();
        median(pixels) <= start_limit(network)
    }

    fn misfits(&self, network: &Network, pose: &Isometry3<f64>) -> Vec<Misfit> {
        let own = network.sightings.iter().filter(|seen| seen.station == self.station);
        let misfit = |seen: &super::Sighting| match &self.targets[seen.target] {
            Some(point) => Misfit::new(network, self.calibration, pose, point, seen),
            None => Misfit::default(),
        };
        own.map(misfit).collect()
    }

    /// The network with those ranges of the station moved by whole intervals that fit then.
    fn unwrapped(&self, network: &Network, pose: &Isometry3<f64>) -> Option<Alternative> {
        let interval = network.range_model.ambiguity_interval_m;
        let mut other = network.clone();
        let mut moved = Vec::new();
        for seen in other.sightings.iter_mut().filter(|seen| seen.station == self.station) {
            let Some(point) = &self.targets[seen.target] else { continue };
            let off = Misfit::new(network, self.calibration, pose, point, seen).range_m.unwrap_or(0.0);
            let count = (off / interval).round();
            if count.is_finite() && count.abs() >= 1.0 {
                seen.range_m = seen.range_m.map(|range| range - count * interval);
                moved.push(network.targets[seen.target].name.clone());
            }
        }
        let named = moved.iter().take(3).cloned().collect::<Vec<_>>().join("`, `");
        let words = format!(
            "{} ranges (targets `{named}`{}) fit if they are whole ambiguity intervals ({interval:.3} m) off",
            moved.len(),
            if moved.len() > 3 { ", ..." } else { "" }
        );
        let remedy = "mend the column `range` of observations.csv, or unwrap that station anew";
        (!moved.is_empty()).then_some(Alternative { kind: CauseKind::WholeIntervals, words, remedy, network: other })
    }
}
