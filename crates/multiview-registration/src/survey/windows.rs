//! Many stations of which the order is known: registered in windows of some that follow each other, and these put one behind the other.
//!
//! One arrangement of all would bend along its way, until rooms at its end stand in those at its beginning; and each station would be
//! held against all before it. Poses of a window are known to millimetres, and so is the way from one to the next.

use nalgebra::{Isometry3, Vector6};
use rayon::prelude::*;

use crate::adjustment::turns::MeasuredTurn;
use crate::error::{Error, Result};
use crate::survey::datum::Datum;
use crate::survey::registration::{Start, StationRegistrationOptions};
use crate::survey::stations::register_stations;
use point_cloud::Cloud;
use rigid_pose::{pose_difference, step_pose};

/// Stations of a window, and those that it shares with the one before: rooms and the ways between them take some ten. Of wider
/// windows the arrangement takes longer for each station, and narrower ones share too little.
const WINDOW: usize = 24;
const SHARED: usize = 8;
/// Most stations that are arranged at once.
pub(crate) const MOST_AT_ONCE: usize = 40;

/// Poses of all stations in the frame of one of them, right to some millimetres from each to the next.
pub(crate) fn arranged(
    stations: &[Cloud],
    held: usize,
    options: &StationRegistrationOptions<'_>,
) -> Result<Vec<Isometry3<f64>>> {
    let windows = windows(stations.len());
    let found: Vec<Result<Vec<Isometry3<f64>>>> =
        windows.par_iter().map(|window| registered(stations, window, options)).collect();
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(stations.len());
    for (window, found) in windows.iter().zip(found) {
        let found = found?;
        let shared = poses.len().saturating_sub(window.start);
        let world = world_from_window(&poses[window.start.min(poses.len())..], &found[..shared]);
        poses.extend(found[shared..].iter().map(|pose| world * pose));
    }
    let to_held = poses[held].inverse();
    Ok(poses.iter().map(|pose| to_held * pose).collect())
}

/// All windows, of about the same size.
fn windows(count: usize) -> Vec<std::ops::Range<usize>> {
    let number = count.saturating_sub(SHARED).div_ceil(WINDOW - SHARED).max(1);
    let step = count.saturating_sub(SHARED).div_ceil(number);
    (0..number).map(|k| k * step..((k + 1) * step + SHARED).min(count)).collect()
}

fn registered(
    stations: &[Cloud],
    window: &std::ops::Range<usize>,
    options: &StationRegistrationOptions<'_>,
) -> Result<Vec<Isometry3<f64>>> {
    let inside = |turn: &&MeasuredTurn| window.contains(&turn.first) && window.contains(&turn.second);
    let renamed = |turn: &MeasuredTurn| MeasuredTurn {
        first: turn.first - window.start,
        second: turn.second - window.start,
        ..*turn
    };
    let turns: Vec<MeasuredTurn> = options.turns.iter().filter(inside).map(renamed).collect();
    let options = StationRegistrationOptions { turns: &turns, model: None, ..options.clone() };
    let found = register_stations(&stations[window.clone()], Start::Order, Datum::Station(0), &options, &|_, _| {});
    match found {
        Ok(found) => Ok(found.world_from_station),
        Err(Error::UnconnectedStations { stations, to, reasons }) => {
            let stations = stations.into_iter().map(|station| station + window.start).collect();
            Err(Error::UnconnectedStations { stations, to: to + window.start, reasons })
        }
        Err(error) => Err(error),
    }
}

/// The pose that brings the stations of a window onto the same ones in the world, in the mean.
fn world_from_window(world: &[Isometry3<f64>], window: &[Isometry3<f64>]) -> Isometry3<f64> {
    let each: Vec<Isometry3<f64>> = world.iter().zip(window).map(|(world, window)| world * window.inverse()).collect();
    let Some(first) = each.get(each.len() / 2) else { return Isometry3::identity() };
    let off: Vector6<f64> = each.iter().map(|pose| pose_difference(first, pose)).sum();
    step_pose(first, &(off / each.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_share_stations_and_leave_none_out() {
        for count in [41, 50, 64, 100, 999, 1000] {
            let windows = windows(count);
            assert_eq!((windows[0].start, windows[windows.len() - 1].end), (0, count));
            for pair in windows.windows(2) {
                assert_eq!(pair[0].end - pair[1].start, SHARED, "{count}");
            }
            assert!(windows.iter().all(|window| window.len() <= WINDOW && window.len() > SHARED + 2), "{windows:?}");
        }
    }

    #[test]
    fn a_window_lies_where_its_stations_do() {
        let pose = |k: f64| Isometry3::new([k, 0.3 * k, -0.1].into(), [0.1, 0.2 * k, 0.4].into());
        let world = pose(3.0);
        let window: Vec<Isometry3<f64>> = (0..5).map(|k| pose(0.2 * f64::from(k))).collect();
        let placed: Vec<Isometry3<f64>> = window.iter().map(|pose| world * pose).collect();
        assert!(pose_difference(&world_from_window(&placed, &window), &world).norm() < 1e-12);
        assert_eq!(world_from_window(&[], &[]), Isometry3::identity());
    }
}
