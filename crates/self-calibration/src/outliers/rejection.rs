//! Gross errors: standardised residuals are tested, the worst rejected, and what was rejected is tested again.
//!
//! `adjust` chooses more at once (`Adjustment::solve_snooping`: up to 256 from one solution, each judged as if those before
//! it were gone). With that choice, measured in the robust scales below, `cargo xtask verify calibrations` names 261 of 269
//! broken networks instead of 262: of depths given for ranges it rejects so many values (34 in one network) that what is
//! left fits a wrong model, and the fault is not told. Sound networks keep their verdict either way (240 of 240).

use std::collections::{BTreeMap, BTreeSet};
use std::slice;

use adjust::{Scale, Solution};
use calibration_network::functional_model::{Excluded, Row, Setup, Solved, Source, solve_rig, solve_rig_nearby};
use statistics::{Distribution, mad_scale};

use crate::outliers::control_test::control_suspects;
use crate::{Component, NetworkError, Result};

/// Values with a smaller redundancy number are not tested: their residual shows too little of an error.
pub(crate) const TESTABLE: f64 = 0.01;
/// Groups of fewer values take their scale from all values together.
const SMALLEST_GROUP: usize = 30;
/// Rounds in which a station loses one value each. Then twice as many in each further round: so many bad values are no
/// single gross errors, and one by one they take as many solutions.
const SINGLE_ROUNDS: usize = 10;
/// A thousand at once.
const MOST_DOUBLINGS: usize = 10;
/// A gross error moves the residuals of the other values of its station or target by less than itself times this over the
/// number of their sightings: the six unknowns of a station take up 3 % of an error among a hundred sightings in the mean,
/// and a tenth where few see so far aside.
const LEVERAGE: f64 = 10.0;
/// Standard deviations that others may have moved a suspect by and it is rejected beside them: at the usual level of 1e-4
/// a value that stays below the limit without them is beyond it with 1 in 1,500.
const HARDLY_MOVED: f64 = 0.5;
/// Rounds of rejection, a bound that only contradictory observations reach.
const MOST_ROUNDS: usize = 100;

/// A value, or all values of a control point or pose, that the test suspects.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Suspect {
    /// Position among the rows; of control that of its first.
    pub(crate) row: usize,
    /// `|v| / σ_v` over the scale of its group.
    pub(crate) statistic: f64,
}

/// Standardised residuals over the robust scale of their group, where they exceed the critical value; largest first.
///
/// The scale, from the median of `|v| / σ_v`, stands for sigma0 of the group and is not drawn up by gross errors. A group
/// is a camera's, by its number, and has one component.
pub(crate) fn suspects(
    solution: &Solution,
    groups: &[(usize, Component)],
    level: f64,
) -> Result<Vec<Suspect>, NetworkError> {
    let standardised = solution.standardised_residuals(Scale::Prior)?;
    let redundancy = solution.redundancy_numbers();
    // Control is tested as a whole; terms were not observed.
    let single = |row: usize| !matches!(groups[row].1, Component::Control | Component::Term);
    let testable = |row: usize| single(row) && standardised[row].is_finite() && redundancy[row] > TESTABLE;
    let rows: Vec<usize> = (0..groups.len()).filter(|&row| testable(row)).collect();
    let overall = overall_scale(solution)?;
    let critical = Distribution::Normal.critical(level);
    let mut out = Vec::new();
    let kinds: BTreeSet<(usize, Component)> = groups.iter().copied().collect();
    for kind in kinds {
        let own: Vec<usize> = rows.iter().copied().filter(|&row| groups[row] == kind).collect();
        let sizes: Vec<f64> = own.iter().map(|&row| standardised[row].abs()).collect();
        let scale = if own.len() < SMALLEST_GROUP { overall } else { scale(sizes) };
        let statistic = |row: usize| Suspect { row, statistic: standardised[row].abs() / scale };
        out.extend(own.into_iter().map(statistic).filter(|suspect| suspect.statistic > critical));
    }
    out.sort_by(|a, b| b.statistic.total_cmp(&a.statistic).then(a.row.cmp(&b.row)));
    Ok(out)
}

/// The robust scale of all residuals together.
fn overall_scale(solution: &Solution) -> Result<f64, NetworkError> {
    let standardised = solution.standardised_residuals(Scale::Prior)?;
    let pairs = standardised.iter().zip(solution.redundancy_numbers());
    let tested = pairs.filter(|(size, redundancy)| size.is_finite() && *redundancy > TESTABLE);
    Ok(scale(tested.map(|(size, _)| size.abs()).collect()))
}

fn scale(mut sizes: Vec<f64>) -> f64 {
    if sizes.is_empty() {
        return f64::INFINITY;
    }
    // Residuals that rounding alone makes are no reason to reject anything.
    mad_scale(&mut sizes).max(1e-6)
}

/// Rejects gross errors from a first solution on, where a level is given.
///
/// Of the suspects of a round the worst of each station and of each target is rejected, and those that the others of
/// these cannot have made conspicuous: the residuals of a gross error spread over its own station and target. A station
/// that still has suspects after [`SINGLE_ROUNDS`] loses more of them at once. In the end what was rejected is looked
/// at again, and taken back once if it fits.
pub(crate) fn solve_rejecting(
    setup: &mut Setup<'_>,
    first: Solved,
    level: Option<f64>,
) -> Result<Solved, NetworkError> {
    let mut solved = first;
    let Some(level) = level else { return Ok(solved) };
    let again = |setups: &[Setup<'_>]| setups.iter().map(Setup::solve_nearby).collect();
    let mut rounds = Rounds::new(slice::from_mut(setup), level);
    while rounds.choose(slice::from_ref(&solved))? {
        // Large networks have no room for two solutions.
        drop(solved);
        let (mut next, is_last) = rounds.solve(again)?;
        solved = next.swap_remove(0);
        if is_last {
            break;
        }
    }
    Ok(solved)
}

/// Solves several cameras on one rig as [`solve_rig`](calibration_network::functional_model::solve_rig) does, and rejects
/// gross errors where a level of significance is given: those of all cameras together, each held against the scatter of
/// its own camera.
///
/// # Errors
/// As of the adjustment; where what was rejected left it without determination, that of all observations is the answer.
pub fn solve_rig_rejecting(setups: &mut [Setup<'_>], level: Option<f64>) -> Result<Vec<Solved>, NetworkError> {
    let mut solved = solve_rig(setups)?;
    let Some(level) = level else { return Ok(solved) };
    let mut rounds = Rounds::new(setups, level);
    while rounds.choose(&solved)? {
        drop(solved);
        let is_last;
        (solved, is_last) = rounds.solve(solve_rig_nearby)?;
        if is_last {
            break;
        }
    }
    Ok(solved)
}

/// A camera by its number, and which of its observations; see [`key`].
type Key = (usize, Source, Component);

/// Rounds of rejection: of one camera, or of those of a rig, which share stations and targets.
struct Rounds<'s, 'n> {
    setups: &'s mut [Setup<'n>],
    level: f64,
    round: usize,
    before: Vec<Excluded>,
    readmitted: BTreeSet<Key>,
}

impl<'s, 'n> Rounds<'s, 'n> {
    fn new(setups: &'s mut [Setup<'n>], level: f64) -> Self {
        Self { setups, level, round: 0, before: Vec::new(), readmitted: BTreeSet::new() }
    }

    fn excluded(&self) -> Vec<Excluded> {
        self.setups.iter().map(|setup| setup.excluded.clone()).collect()
    }

    /// Chooses what takes no part from now on, and starts from the solution; whether that is another choice.
    fn choose(&mut self, solved: &[Solved]) -> Result<bool, NetworkError> {
        if self.round == MOST_ROUNDS {
            return Ok(false);
        }
        self.before = self.excluded();
        let most = 1_usize << self.round.saturating_sub(SINGLE_ROUNDS).min(MOST_DOUBLINGS);
        self.reject(solved, most)?;
        if self.excluded() == self.before {
            self.readmit(solved)?;
        }
        self.round += 1;
        if self.excluded() == self.before {
            return Ok(false);
        }
        self.setups.iter_mut().zip(solved).try_for_each(|(setup, solved)| restart(setup, solved))?;
        Ok(true)
    }

    /// Solves what was chosen; whether this is the last solution.
    fn solve(
        &mut self,
        again: impl Fn(&[Setup<'n>]) -> Result<Vec<Solved>, NetworkError>,
    ) -> Result<(Vec<Solved>, bool), NetworkError> {
        match again(self.setups) {
            Err(NetworkError::Adjust(adjust::Error::RankDeficient { .. })) => {
                // What is left would not determine the network: the suspects are needed.
                let before = std::mem::take(&mut self.before);
                self.setups.iter_mut().zip(before).for_each(|(setup, before)| setup.excluded = before);
                Ok((again(self.setups)?, true))
            }
            done => Ok((done?, false)),
        }
    }

    /// Rejects the worst of each target, at most so many of each station, and what is sure to be wrong.
    fn reject(&mut self, solved: &[Solved], most: usize) -> Result<(), NetworkError> {
        let Some(first) = solved.first() else { return Ok(()) };
        let rows: Vec<(usize, Row)> = rows(solved).collect();
        let groups: Vec<(usize, Component)> = rows.iter().map(|(camera, row)| (*camera, row.component)).collect();
        let suspects = suspects(&first.solution, &groups, self.level)?;
        // Deviations of control do not depend on those of the sightings: it is not tested more strictly where these are
        // stated too large.
        let scale = overall_scale(&first.solution)?.max(1.0);
        // The first camera has the control of all.
        let control = control_suspects(&self.setups[0], first, self.level, scale)?.into_iter().find(|suspect| {
            let largest = suspects.first().is_none_or(|first| suspect.statistic > first.statistic);
            largest && !self.readmitted.contains(&key(&rows[suspect.row]))
        });
        if let Some(control) = control {
            // Wrong control disturbs all that hangs on it.
            self.set_excluded(&rows[control.row], true);
            return Ok(());
        }
        let critical = Distribution::Normal.critical(self.level);
        let sure = self.sure(&suspects, &rows, critical);
        let (mut stations, mut targets) = (BTreeMap::new(), BTreeMap::new());
        for (suspect, sure) in suspects.iter().zip(sure) {
            let row = &rows[suspect.row];
            let Some((station, target)) = self.ends(row) else { continue };
            let of_station = stations.entry(station).or_insert(0);
            let of_target = targets.entry(target).or_insert(0);
            (*of_station, *of_target) = (*of_station + 1, *of_target + 1);
            let few = *of_station <= most && *of_target <= 1;
            if (few || sure) && !self.readmitted.contains(&key(row)) {
                self.set_excluded(row, true);
            }
        }
        Ok(())
    }

    /// Which suspects are so, or nearly, even if all others of their station and of their target are gross errors.
    fn sure(&self, suspects: &[Suspect], rows: &[(usize, Row)], critical: f64) -> Vec<bool> {
        let (mut stations, mut targets) = (BTreeMap::new(), BTreeMap::new());
        for seen in self.setups.iter().flat_map(|setup| &setup.network.sightings) {
            stations.entry(seen.station).or_insert((0.0, 0.0)).0 += 1.0;
            targets.entry(seen.target).or_insert((0.0, 0.0)).0 += 1.0;
        }
        let ends: Vec<_> = suspects.iter().map(|suspect| self.ends(&rows[suspect.row])).collect();
        for (suspect, (station, target)) in suspects.iter().zip(&ends).filter_map(|(s, ends)| Some((s, (*ends)?))) {
            stations.entry(station).or_insert((0.0, 0.0)).1 += suspect.statistic;
            targets.entry(target).or_insert((0.0, 0.0)).1 += suspect.statistic;
        }
        let moved = |of: &BTreeMap<usize, (f64, f64)>, end: &usize, own: f64| {
            of.get(end).map_or(0.0, |(seen, all)| (LEVERAGE / seen).min(1.0) * (all - own))
        };
        let is_sure = |(suspect, ends): (&Suspect, &Option<(usize, usize)>)| {
            ends.is_some_and(|(station, target)| {
                let own = suspect.statistic;
                let moved = moved(&stations, &station, own) + moved(&targets, &target, own);
                moved < HARDLY_MOVED || own > critical + moved
            })
        };
        suspects.iter().zip(&ends).map(is_sure).collect()
    }

    /// Takes back what fits the solution that it did not take part in. Its residual has at least its own deviation, so the
    /// test against that alone is on the safe side.
    fn readmit(&mut self, solved: &[Solved]) -> Result<(), NetworkError> {
        let critical = Distribution::Normal.critical(self.level);
        let mut conspicuous: BTreeSet<Key> = BTreeSet::new();
        let mut rejected = Vec::new();
        for (camera, (setup, solved)) in self.setups.iter().zip(solved).enumerate() {
            let sigma0 = solved.solution.sigma0().unwrap_or(1.0);
            for row in rejected_rows(setup) {
                let residual = setup.predicted(solved, &row)?;
                // NaN: nothing is known of it.
                if residual.is_nan() || residual.abs() > critical * sigma0 * row.sigma {
                    conspicuous.insert(key(&(camera, row)));
                }
                rejected.push((camera, row));
            }
        }
        for row in &rejected {
            if !conspicuous.contains(&key(row)) && self.readmitted.insert(key(row)) {
                self.set_excluded(row, false);
            }
        }
        Ok(())
    }

    fn ends(&self, (camera, row): &(usize, Row)) -> Option<(usize, usize)> {
        ends(&self.setups[*camera], row.source)
    }

    fn set_excluded(&mut self, (camera, row): &(usize, Row), excluded: bool) {
        set_excluded(&mut self.setups[*camera], row, excluded);
    }
}

/// The rows of all cameras, in the order of the residuals.
fn rows(solved: &[Solved]) -> impl Iterator<Item = (usize, Row)> {
    solved.iter().enumerate().flat_map(|(camera, solved)| solved.rows.iter().map(move |row| (camera, *row)))
}

/// Values that were rejected.
fn rejected_rows(setup: &Setup<'_>) -> Vec<Row> {
    let rejected = setup.unused_rows().into_iter().filter(|(_, verdict)| *verdict == crate::Verdict::Rejected);
    rejected.map(|(row, _)| row).collect()
}

/// Starts the next solution from this one.
pub(crate) fn restart(setup: &mut Setup<'_>, solved: &Solved) -> Result<(), NetworkError> {
    let geometry = solved.geometry()?;
    setup.start.stations = geometry.stations;
    setup.start.targets = geometry.targets;
    if let Some([relative, _]) = solved.blocks.passive {
        setup.start.relative = Some(solved.solution.pose(relative)?);
    }
    if let Some(mounting) = solved.blocks.mounting {
        setup.start.mounting = Some(solved.solution.pose(mounting)?);
    }
    setup.calibration = setup.calibration_found(solved)?;
    Ok(())
}

/// Station and target of an observation, or the two ends of a distance; control is rejected alone.
fn ends(setup: &Setup<'_>, source: Source) -> Option<(usize, usize)> {
    match source {
        Source::Sighting(index) => {
            let seen = &setup.network.sightings[index];
            Some((seen.station, seen.target))
        }
        Source::Passive(index) => {
            let seen = setup.network.passive.as_ref()?.image_points[index];
            Some((seen.station, seen.target))
        }
        // Distances have no rivals but themselves.
        Source::Distance(index) => Some((usize::MAX - index, usize::MAX - index)),
        _ => None,
    }
}

fn set_excluded(setup: &mut Setup<'_>, row: &Row, excluded: bool) {
    let (list, index) = match row.source {
        Source::Sighting(index) if row.component == Component::Range => (&mut setup.excluded.ranges, index),
        Source::Sighting(index) => (&mut setup.excluded.image_points, index),
        Source::Passive(index) => (&mut setup.excluded.passive, index),
        Source::Distance(index) => (&mut setup.excluded.distances, index),
        Source::Target(index, _) => (&mut setup.excluded.control_points, index),
        Source::Station(index, _) => (&mut setup.excluded.control_poses, index),
        Source::Camera | Source::PassiveCamera | Source::Term(..) => return,
    };
    if excluded {
        list.insert(index);
    } else {
        list.remove(&index);
    }
}

/// Both coordinates of an image point stand and fall together, as do all of control.
fn key((camera, row): &(usize, Row)) -> Key {
    let component = match row.component {
        Component::Row => Component::Col,
        Component::PassiveRow => Component::PassiveCol,
        other => other,
    };
    let source = match row.source {
        Source::Target(index, _) => Source::Target(index, 0),
        Source::Station(index, _) => Source::Station(index, 0),
        other => other,
    };
    (*camera, source, component)
}
