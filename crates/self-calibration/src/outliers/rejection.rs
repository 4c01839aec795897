//! Gross errors: standardised residuals are tested, the worst rejected, and what was rejected is tested again.
//!
//! `adjust` chooses more at once (`Adjustment::solve_snooping`: up to 256 from one solution, each judged as if those before
//! it were gone). With that choice, measured in the robust scales below, `cargo xtask verify calibrations` names 261 of 269
//! broken networks instead of 262: of depths given for ranges it rejects so many values (34 in one network) that what is
//! left fits a wrong model, and the fault is not told. Sound networks keep their verdict either way (240 of 240).

use std::collections::{BTreeMap, BTreeSet};

use adjust::{Scale, Solution};
use calibration_network::functional_model::{Row, Setup, Solved, Source};
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
/// The scale, from the median of `|v| / σ_v`, stands for sigma0 of the group and is not drawn up by gross errors.
pub(crate) fn suspects(
    solution: &Solution,
    components: &[Component],
    level: f64,
) -> Result<Vec<Suspect>, NetworkError> {
    let standardised = solution.standardised_residuals(Scale::Prior)?;
    let redundancy = solution.redundancy_numbers();
    // Control is tested as a whole; terms were not observed.
    let single = |row: usize| !matches!(components[row], Component::Control | Component::Term);
    let testable = |row: usize| single(row) && standardised[row].is_finite() && redundancy[row] > TESTABLE;
    let rows: Vec<usize> = (0..components.len()).filter(|&row| testable(row)).collect();
    let overall = overall_scale(solution)?;
    let critical = Distribution::Normal.critical(level);
    let mut out = Vec::new();
    let kinds: BTreeSet<Component> = components.iter().copied().collect();
    for kind in kinds {
        let own: Vec<usize> = rows.iter().copied().filter(|&row| components[row] == kind).collect();
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
    let mut readmitted = BTreeSet::new();
    for round in 0..MOST_ROUNDS {
        let before = setup.excluded.clone();
        let most = 1_usize << round.saturating_sub(SINGLE_ROUNDS).min(MOST_DOUBLINGS);
        reject(setup, &solved, level, most, &readmitted)?;
        if setup.excluded == before {
            readmit(setup, &solved, level, &mut readmitted)?;
        }
        if setup.excluded == before {
            break;
        }
        restart(setup, &solved)?;
        // Large networks have no room for two solutions.
        drop(solved);
        solved = match setup.solve_nearby() {
            Err(NetworkError::Adjust(adjust::Error::RankDeficient { .. })) => {
                // What is left would not determine the network: the suspects are needed.
                setup.excluded = before;
                return setup.solve_nearby();
            }
            done => done?,
        };
    }
    Ok(solved)
}

/// Rejects the worst of each target, at most so many of each station, and what is sure to be wrong.
fn reject(
    setup: &mut Setup<'_>,
    solved: &Solved,
    level: f64,
    most: usize,
    readmitted: &BTreeSet<(Source, Component)>,
) -> Result<(), NetworkError> {
    let components: Vec<Component> = solved.rows.iter().map(|row| row.component).collect();
    let suspects = suspects(&solved.solution, &components, level)?;
    // Deviations of control do not depend on those of the sightings: it is not tested more strictly where these are
    // stated too large.
    let scale = overall_scale(&solved.solution)?.max(1.0);
    let control = control_suspects(setup, solved, level, scale)?.into_iter().find(|suspect| {
        let largest = suspects.first().is_none_or(|first| suspect.statistic > first.statistic);
        largest && !readmitted.contains(&key(&solved.rows[suspect.row]))
    });
    if let Some(control) = control {
        // Wrong control disturbs all that hangs on it.
        set_excluded(setup, &solved.rows[control.row], true);
        return Ok(());
    }
    let critical = Distribution::Normal.critical(level);
    let sure = sure(setup, &suspects, solved, critical);
    let (mut stations, mut targets) = (BTreeMap::new(), BTreeMap::new());
    for (suspect, sure) in suspects.iter().zip(sure) {
        let row = &solved.rows[suspect.row];
        let Some((station, target)) = ends(setup, row.source) else { continue };
        let of_station = stations.entry(station).or_insert(0);
        let of_target = targets.entry(target).or_insert(0);
        (*of_station, *of_target) = (*of_station + 1, *of_target + 1);
        let few = *of_station <= most && *of_target <= 1;
        if (few || sure) && !readmitted.contains(&key(row)) {
            set_excluded(setup, row, true);
        }
    }
    Ok(())
}

/// Which suspects are so, or nearly, even if all others of their station and of their target are gross errors.
fn sure(setup: &Setup<'_>, suspects: &[Suspect], solved: &Solved, critical: f64) -> Vec<bool> {
    let (mut stations, mut targets) = (BTreeMap::new(), BTreeMap::new());
    for seen in &setup.network.sightings {
        stations.entry(seen.station).or_insert((0.0, 0.0)).0 += 1.0;
        targets.entry(seen.target).or_insert((0.0, 0.0)).0 += 1.0;
    }
    let ends: Vec<_> = suspects.iter().map(|suspect| ends(setup, solved.rows[suspect.row].source)).collect();
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
fn readmit(
    setup: &mut Setup<'_>,
    solved: &Solved,
    level: f64,
    done: &mut BTreeSet<(Source, Component)>,
) -> Result<(), NetworkError> {
    let critical = Distribution::Normal.critical(level);
    let sigma0 = solved.solution.sigma0().unwrap_or(1.0);
    let mut conspicuous: BTreeSet<(Source, Component)> = BTreeSet::new();
    let rejected = rejected_rows(setup);
    for row in &rejected {
        let residual = setup.predicted(solved, row)?;
        // NaN: nothing is known of it.
        if residual.is_nan() || residual.abs() > critical * sigma0 * row.sigma {
            conspicuous.insert(key(row));
        }
    }
    for row in &rejected {
        if !conspicuous.contains(&key(row)) && done.insert(key(row)) {
            set_excluded(setup, row, false);
        }
    }
    Ok(())
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
fn key(row: &Row) -> (Source, Component) {
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
    (source, component)
}
