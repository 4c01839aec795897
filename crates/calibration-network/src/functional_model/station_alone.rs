//! Where one station stands by its own observations, all else being as a solution has it.

use adjust::{Adjustment, Covariance, ParameterBlock, Scale, SolveOptions};
use nalgebra::{Isometry3, Matrix6};

use crate::Result;
use crate::functional_model::setup::{Setup, Solved};

/// Image points that orient a station alone with something left to check.
const FEWEST: usize = 4;

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
