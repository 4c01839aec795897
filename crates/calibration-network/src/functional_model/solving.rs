//! Solves one camera, the cameras of a rig, or one station.

use std::sync::Arc;

use adjust::{Adjustment, Covariance, Method, ParameterBlock, Scale, SolveOptions};
use nalgebra::{Isometry3, Matrix6};

use crate::functional_model::builder::Builder;
use crate::functional_model::setup::{Blocks, Row, Setup, Solved};
use crate::{Error, Result};

/// Image points that orient a station alone with something left to check.
const FEWEST: usize = 4;

impl Setup<'_> {
    /// Solves the network.
    pub fn solve(&self) -> Result<Solved> {
        self.solve_by(Method::LevenbergMarquardt)
    }

    /// The same from values near the solution, where undamped steps take half as many factorisations.
    pub fn solve_nearby(&self) -> Result<Solved> {
        match self.solve_by(Method::GaussNewton) {
            Err(Error::Adjust(adjust::Error::NotConverged { .. })) => self.solve(),
            done => done,
        }
    }

    fn solve_by(&self, method: Method) -> Result<Solved> {
        let mut builder = Builder::new(self)?;
        builder.add_observations()?;
        let datum_defect = builder.add_datum(self.has_scale())?;
        let solution = Arc::new(builder.adjustment.solve(&options(method))?);
        Ok(Solved { solution, blocks: builder.blocks, rows: builder.rows, first_row: 0, datum_defect })
    }
}

/// Solves several cameras on one rig in one adjustment.
///
/// All setups have the stations of the rig and the targets in the same order. The first camera is the frame of the rig: its
/// stations are the rig's, and its datum, control and known distances are those of all. Each of the others has a mounting
/// `rig_from_camera` in its start values, one unknown for all stations. Answers with one view of the shared solution for
/// each camera; the unknowns, the rows and the residuals are the camera's own.
///
/// # Errors
/// [`Error::NotReachable`] without a mounting; whatever the adjustment says.
pub fn solve_rig(setups: &[Setup<'_>]) -> Result<Vec<Solved>> {
    rig_by(setups, Method::LevenbergMarquardt)
}

/// The same from values near the solution, where undamped steps take half as many factorisations.
///
/// # Errors
/// As [`solve_rig`].
pub fn solve_rig_nearby(setups: &[Setup<'_>]) -> Result<Vec<Solved>> {
    match rig_by(setups, Method::GaussNewton) {
        Err(Error::Adjust(adjust::Error::NotConverged { .. })) => solve_rig(setups),
        done => done,
    }
}

fn rig_by(setups: &[Setup<'_>], method: Method) -> Result<Vec<Solved>> {
    let Some((first, others)) = setups.split_first() else { return Ok(Vec::new()) };
    let mut builder = Builder::new(first)?;
    builder.add_observations()?;
    let datum_defect = builder.add_datum(setups.iter().any(Setup::has_scale))?;
    let mut parts = Vec::with_capacity(setups.len());
    for setup in others {
        parts.push(builder.next_camera(setup)?);
    }
    let solution = Arc::new(builder.adjustment.solve(&options(method))?);
    parts.push((builder.blocks, builder.rows));
    let mut first_row = 0;
    let view = |(blocks, rows): (Blocks, Vec<Row>)| {
        let solved = Solved { solution: Arc::clone(&solution), blocks, first_row, rows, datum_defect };
        first_row += solved.rows.len();
        solved
    };
    Ok(parts.into_iter().map(view).collect())
}

/// A network that is determined takes 10 to 30 steps; one that is not creeps on for thousands.
fn options(method: Method) -> SolveOptions {
    SolveOptions { method, max_iterations: 50, ..SolveOptions::default() }
}

impl Setup<'_> {
    /// Pose of the camera at a station, `world_from_camera`, from what it observed there alone, with targets and calibration
    /// held at the solution, and the prior-scaled covariance of the step `[dt world m, dθ camera rad]`.
    ///
    /// `None` where fewer than four image points take part. For a camera on a rig this is the pose without the mounting:
    /// whether it sat at that station as at the others.
    ///
    /// # Errors
    /// Observations that determine no pose, as of targets in one line.
    pub fn station_alone(&self, solved: &Solved, station: usize) -> Result<Option<(Isometry3<f64>, Matrix6<f64>)>> {
        let own = (0..self.network.sightings.len())
            .filter(|&index| self.network.sightings[index].station == station && self.uses_pixel(index));
        let own: Vec<usize> = own.collect();
        let geometry = solved.geometry()?;
        let Some(start) = geometry.stations.get(station).filter(|_| own.len() >= FEWEST) else { return Ok(None) };
        let mut adjustment = Adjustment::new();
        let pose = adjustment.add_block(ParameterBlock::pose(start));
        let mut held = |values: &[f64]| -> Result<_> {
            let block = adjustment.add_block(ParameterBlock::euclidean(values.to_vec()));
            adjustment.hold(block)?;
            Ok(block)
        };
        let camera = held(solved.solution.values(solved.blocks.camera)?)?;
        let set = solved.blocks.sets.get(self.set_of(station));
        let set = set.map(|&set| held(solved.solution.values(set)?)).transpose()?;
        let mut targets = Vec::with_capacity(own.len());
        for &index in &own {
            let block = solved.blocks.targets[self.network.sightings[index].target];
            targets.push(block.map(|block| held(solved.solution.values(block)?)).transpose()?);
        }
        let group = adjustment.add_group("sightings");
        let shared = self.shared_models();
        for (index, target) in own.into_iter().zip(targets) {
            let (Some(target), seen) = (target, &self.network.sightings[index]) else { continue };
            let set = set.filter(|_| self.uses_range(index));
            let sigmas: Vec<f64> = seen.sigma_pixel.into_iter().chain(set.map(|_| seen.sigma_range_m)).collect();
            let blocks = [pose, target, camera].into_iter().chain(set).collect();
            let equation = self.equation(&shared, index, true, set.is_some());
            let equation = equation.on(&self.calibration.camera, blocks, false);
            adjustment.add_observation(group, equation, &Covariance::from_sigmas(&sigmas))?;
        }
        let solution = adjustment.solve(&SolveOptions::default())?;
        let covariance = solution.covariance(pose, Scale::Prior)?;
        Ok(Some((solution.pose(pose)?, Matrix6::from_fn(|row, column| covariance[(row, column)]))))
    }
}
