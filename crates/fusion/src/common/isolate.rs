//! Stations whose poses contradict what is said of them.
//!
//! What the surfaces make of a station's pose is tested against its covariance. Where it is improbable, the station is not pulled
//! to where the others are: it keeps its pose, shares no surface with others, and is reported.

use nalgebra::{DMatrix, DVector};
use point_uncertainty::{CommonErrors, PointErrors, Source};
use statistics::{Distribution, holm, upper_median};

use super::equations::{Equations, ties};
use super::posterior::{Posterior, posterior};
use super::shared_error::shared_error;
use super::trust::{AT_FIRST, trust};
use crate::fuse::Task;
use crate::input::{Observations, Registered, derivatives};
use crate::lattice::Lattice;
use crate::outcome::{Apart, SharedError};
use crate::patches::{Patches, seeds};
use crate::surfels::gather;
use crate::{Error, Result};

/// Times that places which do not fit are looked for.
const ROUNDS: usize = 2;
/// Part of a variance of which surfaces must tell something before it is tested: below it is rounding.
const RESOLVED: f64 = 1e-4;

/// Frames that share a pose, and its columns.
#[derive(Debug, Clone, PartialEq)]
struct Station {
    frames: Vec<u32>,
    columns: Vec<usize>,
}

/// Frames with the same columns of poses, by a point of each.
fn stations(input: &Registered<'_>, errors: &dyn PointErrors, common: &CommonErrors) -> Result<Vec<Station>> {
    let mut a_point = vec![None; input.centres.len()];
    for (point, frame) in input.frames.iter().enumerate() {
        a_point[*frame as usize].get_or_insert(point);
    }
    let mut found: Vec<Station> = Vec::new();
    let mut buffer = Vec::new();
    for (frame, point) in a_point.into_iter().enumerate() {
        let Some(point) = point else { continue };
        derivatives(point, errors, common, &mut buffer)?;
        let is_pose = |column: &usize| common.errors()[*column].source == Source::Pose;
        let mut columns: Vec<usize> = buffer.iter().map(|(column, _)| *column).filter(is_pose).collect();
        columns.sort_unstable();
        columns.dedup();
        match found.iter_mut().find(|station| station.columns == columns && !columns.is_empty()) {
            Some(station) => station.frames.push(frame as u32),
            None => found.push(Station { frames: vec![frame as u32], columns }),
        }
    }
    Ok(found)
}

/// Common errors from the surfaces of a cloud, with the stations that do not fit.
#[derive(Debug, Clone)]
pub(crate) struct Conditioned {
    pub posterior: Posterior,
    pub shared: Option<SharedError>,
    pub apart: Vec<Apart>,
    /// Frames of one layer share surfaces.
    pub layers: Vec<u32>,
}

impl Conditioned {
    /// Nothing known but what was before.
    pub fn nothing(frames: usize, common: &CommonErrors) -> Self {
        let covariance = common.covariance().clone();
        let values = DVector::zeros(covariance.nrows());
        Self { posterior: Posterior { values, covariance }, shared: None, apart: Vec::new(), layers: vec![0; frames] }
    }
}

/// Estimates the common errors; stations that contradict leave one by one. From the points of `observations`, which the
/// values that were found `before` have been taken off: so that what is not linear in them is small. Stations are tested where
/// it `judges`.
pub(crate) fn condition(
    task: &Task<'_>,
    before: &Conditioned,
    observations: &Observations,
    patches: &Patches,
    common: &CommonErrors,
    judges: bool,
) -> Result<Conditioned> {
    let Task { input, errors, options } = *task;
    let stations = stations(input, errors, common)?;
    let Conditioned { posterior: before, mut apart, mut layers, .. } = before.clone();
    let lattice: &Lattice = &observations.lattice;
    loop {
        let seeds = seeds(patches, lattice, &layers, options.gate());
        let gathered = gather(observations, patches, &seeds, &layers, options.gate());
        let ties = ties(&gathered, observations, errors, common)?;
        let solve = |values: Option<&DVector<f64>>, trust: f64| {
            let mut equations = Equations::new(&ties, common.errors().len(), values, trust);
            equations.right += &equations.normal * &before.values;
            let (prior, shared) = shared_error(options.shared_error, common, &equations)?;
            Ok::<_, Error>((posterior(&prior, &equations)?, shared))
        };
        let (mut posterior, mut shared) = solve(None, AT_FIRST)?;
        for round in 1..=ROUNDS {
            let values = &posterior.values - &before.values;
            let trust = if round < ROUNDS { AT_FIRST } else { trust(&ties, &values, lattice.size_m) };
            (posterior, shared) = solve(Some(&values), trust)?;
        }
        let expected = if shared.is_some() { usual(&stations, &posterior, common.covariance()) } else { 1.0 };
        let p_values: Vec<f64> =
            stations.iter().map(|station| p_value(station, &posterior, common.covariance(), expected)).collect();
        let adjusted = holm(&p_values);
        let is_left = |at: &usize| adjusted[*at] < options.level && layers[stations[*at].frames[0] as usize] == 0;
        let statistic = |at: &usize| squares(&stations[*at], &posterior, common.covariance()).0;
        let worst =
            (0..stations.len()).filter(|_| judges).filter(is_left).max_by(|a, b| statistic(a).total_cmp(&statistic(b)));
        let Some(worst) = worst else { return Ok(Conditioned { posterior, shared, apart, layers }) };
        let station = &stations[worst];
        let with = partners(station, &gathered);
        let shift = |column: &usize| (common.errors()[*column].name.clone(), posterior.values[*column]);
        apart.push(Apart {
            frames: station.frames.clone(),
            others: with,
            p_value: adjusted[worst],
            shifts: station.columns.iter().map(shift).collect(),
        });
        for frame in &station.frames {
            layers[*frame as usize] = apart.len() as u32;
        }
    }
}

/// Frames of other stations that see surfaces together with a station.
fn partners(station: &Station, gathered: &crate::surfels::Gathered) -> Vec<u32> {
    let mut others: Vec<u32> = Vec::new();
    for place in &gathered.estimates {
        if place.frames.iter().any(|frame| station.frames.contains(&frame.frame)) {
            others.extend(place.frames.iter().map(|f| f.frame).filter(|frame| !station.frames.contains(frame)));
            others.sort_unstable();
            others.dedup();
        }
    }
    others
}

/// Probability of a pose's shift where its covariance is true, squares being expected so many times as large; NaN where nothing tells.
fn p_value(station: &Station, posterior: &Posterior, prior: &DMatrix<f64>, expected: f64) -> f64 {
    let (squares, rank) = squares(station, posterior, prior);
    if rank == 0 { f64::NAN } else { Distribution::ChiSquared { dof: rank as f64 }.survival(squares / expected) }
}

/// By how many times the squares of the poses' shifts exceed what is expected of them, in the median: poses that were found with an error that
/// all frames share err with it, by more than is stated, and all of them.
fn usual(stations: &[Station], posterior: &Posterior, prior: &DMatrix<f64>) -> f64 {
    let ratio = |station: &Station| {
        let (squares, rank) = squares(station, posterior, prior);
        (rank > 0).then(|| squares / rank as f64)
    };
    let mut ratios: Vec<f64> = stations.iter().filter_map(ratio).collect();
    if ratios.is_empty() { 1.0 } else { upper_median(&mut ratios).max(1.0) }
}

/// Sum of squares of the estimated shift over its expected scatter, prior less posterior, and its rank.
fn squares(station: &Station, posterior: &Posterior, prior: &DMatrix<f64>) -> (f64, usize) {
    let size = station.columns.len();
    let deviation = |at: usize| prior[(station.columns[at], station.columns[at])].sqrt();
    let scaled = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
    let gained = DMatrix::from_fn(size, size, |row, column| {
        let (i, j) = (station.columns[row], station.columns[column]);
        scaled(prior[(i, j)] - posterior.covariance[(i, j)], deviation(row) * deviation(column))
    });
    let shift = DVector::from_fn(size, |at, _| scaled(posterior.values[station.columns[at]], deviation(at)));
    let Ok((values, vectors)) = dense_matrices::symmetric_eigen(gained.as_slice(), size) else { return (0.0, 0) };
    let mut sum = (0.0, 0);
    for (at, value) in values.iter().enumerate().filter(|(_, value)| **value > RESOLVED) {
        let along: f64 = shift.iter().zip(&vectors[at * size..]).map(|(a, b)| a * b).sum();
        sum = (sum.0 + along * along / value, sum.1 + 1);
    }
    sum
}
