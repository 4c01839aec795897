//! The robust first phase: where most observations agree, and which contradict that.
//!
//! Least squares from afar has no end where one value is grossly wrong. Here every image point, range, distance and prior
//! pulls by Cauchy's kernel, as wide as the residuals scatter: first poses and coordinates alone are found, then the few
//! parameters that a nominal camera misses most, then the lens, the waves of the range error last.

use std::collections::BTreeSet;

use adjust::{Descent, Kernel, SolveOptions};
use nalgebra::Point3;

use crate::functional_model::builder::{Builder, Kernels};
use crate::functional_model::misfit::{CAUCHY, Misfit, Scales, median};
use crate::functional_model::setup::{Blocks, Excluded, Setup};
use crate::functional_model::terms::{camera_from, range_model_from};
use crate::start_values::start::{missed, ranges_missed};
use crate::{DistanceEnd, Network, Result};

/// Robust standard deviations beyond which a value contradicts. One in two million normal values lies there: what is left
/// out wrongly is taken back when it fits, what is left in wrongly meets the test for gross errors.
const CONTRADICTS: f64 = 5.0;
/// Share of the image's diagonal that start values may be off by: 11 pixels of 176 x 144. Poses off by 2 cm and half a
/// degree and a nominal lens make two to six; least squares converges from twice as far.
const START_SHARE: f64 = 0.05;
/// Share of the ambiguity interval that ranges may be off by at start values.
const START_INTERVAL: f64 = 0.25;
/// Image points that a station keeps, or its pose is open.
const FEWEST: usize = 4;
/// Steps of one stage, and the share of the objective below which it ends.
const STEPS: usize = 40;
const SMALL_DECREASE: f64 = 1e-3;

/// Terms of the stages after that of the geometry alone; the last has all.
const STAGES: [&[&str]; 2] = [&["c", "xp", "yp", "d0", "k1"], &["c", "xp", "yp", "d0", "k1", "k2", "k3", "p1", "p2"]];

impl Setup<'_> {
    /// Image diagonal times the share that start values may be off by, pixel.
    fn start_limit(&self) -> f64 {
        start_limit(self.network)
    }

    /// Leaves out what start values cannot explain: a hundred pixels, a whole ambiguity interval, millimetres.
    pub fn screen(&mut self) {
        let misfits = self.misfits();
        let pixels = || misfits.iter().filter_map(Misfit::pixels);
        let typical = median(pixels().collect());
        let limit = self.start_limit().max(2.0 * CONTRADICTS * typical);
        // The offset of a nominal camera is not known yet.
        let offset = median(misfits.iter().filter_map(|misfit| misfit.range_m).collect());
        let off = |misfit: &Misfit| misfit.range_m.map(|residual| (residual - offset).abs());
        let spread = median(misfits.iter().filter_map(off).collect());
        let range_limit = start_range_limit(self.network, spread);
        let mut excluded = Excluded::default();
        for (index, misfit) in misfits.iter().enumerate() {
            if misfit.pixels().is_some_and(|pixels| pixels > limit) {
                excluded.image_points.insert(index);
            }
            if off(misfit).is_some_and(|off| off > range_limit) {
                excluded.ranges.insert(index);
            }
        }
        if !(excluded.image_points.is_empty() && excluded.ranges.is_empty()) {
            self.leave_out(&excluded);
        }
    }

    /// Brings poses, coordinates and calibration to where most observations agree, and leaves out those that do not.
    ///
    /// # Errors
    /// Where an observation that is not left out has no value at the start.
    pub fn settle(&mut self) -> Result<()> {
        self.excluded = Excluded::default();
        self.screen();
        let all = self.estimated.clone();
        self.approach(BTreeSet::new())?;
        for stage in STAGES {
            let known = all.iter().filter(|name| stage.contains(&name.as_str()));
            self.approach(known.cloned().collect())?;
        }
        // Twice: what was a gross error no longer widens the kernel.
        self.approach(all.clone())?;
        self.approach(all)?;
        let contradicting = self.contradicting();
        self.excluded = Excluded::default();
        self.leave_out(&contradicting);
        Ok(())
    }

    /// The same from values that only one station may have disturbed.
    pub fn resettle(&mut self) -> Result<()> {
        let all = self.estimated.clone();
        self.approach(all.clone())?;
        self.approach(all)
    }

    /// Shares of the image points and of the ranges that start values cannot explain.
    pub fn misses(&self) -> [f64; 2] {
        let (network, calibration, start) = (self.network, &self.calibration, &self.start);
        [missed(network, calibration, start), ranges_missed(network, calibration, start)]
    }

    /// What contradicts the present values.
    pub fn contradicting(&self) -> Excluded {
        let misfits = self.misfits();
        let scales = Scales::new(misfits.iter()).at_least_one();
        let mut excluded = Excluded::default();
        for (index, misfit) in misfits.iter().enumerate() {
            if misfit.image.is_some_and(|size| size > CONTRADICTS * scales.image) {
                excluded.image_points.insert(index);
            }
            if misfit.range.is_some_and(|size| size > CONTRADICTS * scales.range) {
                excluded.ranges.insert(index);
            }
        }
        excluded
    }

    /// One robust descent with these terms free.
    fn approach(&mut self, estimated: BTreeSet<String>) -> Result<()> {
        let misfits = self.misfits();
        let used = misfits.iter().enumerate().map(|(index, misfit)| Misfit {
            image: misfit.image.filter(|_| self.uses_pixel(index)),
            range: misfit.range.filter(|_| self.uses_range(index)),
            ..*misfit
        });
        let used: Vec<Misfit> = used.collect();
        let scales = Scales::new(used.iter()).at_least_one();
        let stage = Setup { estimated, ..self.clone() };
        let mut builder = Builder::new(&stage)?;
        builder.kernels = Some(Kernels { kernel: Kernel::Cauchy(CAUCHY), scales });
        builder.add_observations()?;
        let options = SolveOptions { max_iterations: STEPS, ..SolveOptions::default() };
        match builder.adjustment.descend(&options, SMALL_DECREASE) {
            Ok(descent) => {
                let blocks = builder.blocks;
                self.take(&descent, &blocks)
            }
            // What is not better stays as it is.
            Err(adjust::Error::NotConverged { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Takes the values of a descent as start values.
    fn take(&mut self, descent: &Descent, blocks: &Blocks) -> Result<()> {
        for (pose, &block) in self.start.stations.iter_mut().zip(&blocks.stations) {
            *pose = descent.pose(block)?;
        }
        for (target, block) in self.start.targets.iter_mut().zip(&blocks.targets) {
            if let Some(block) = block {
                *target = Some(Point3::from_slice(descent.values(*block)?));
            }
        }
        if let Some([relative, _]) = blocks.passive {
            self.start.relative = Some(descent.pose(relative)?);
        }
        let camera = camera_from(&self.calibration.camera, descent.values(blocks.camera)?);
        self.calibration.camera = camera.unwrap_or(self.calibration.camera);
        for (set, &block) in self.calibration.sets.iter_mut().zip(&blocks.sets) {
            set.model = range_model_from(&set.model, descent.values(block)?);
        }
        Ok(())
    }

    /// Leaves these out, but wrong control instead of what contradicts it, and targets that nothing determines without them; a station keeps what determines its pose.
    fn leave_out(&mut self, excluded: &Excluded) {
        let excluded = self.without_wrong_control(excluded);
        self.excluded.ranges.extend(&excluded.ranges);
        for (station, own) in self.network.sightings_by_station().into_iter().enumerate() {
            let sightings = own.into_iter().filter(|&index| self.network.sightings[index].pixel.is_some());
            let (bad, good): (Vec<usize>, Vec<usize>) =
                sightings.partition(|index| excluded.image_points.contains(index));
            if good.len() >= FEWEST || self.network.stations[station].covariance.is_some() {
                self.excluded.image_points.extend(bad);
            }
        }
        for (target, own) in self.network.sightings_by_target().into_iter().enumerate() {
            if self.is_left_open(target, &own) {
                self.drop_target(target, &own);
            }
        }
    }

    /// Whether a target that could be placed no longer can by its own sightings.
    fn is_left_open(&self, target: usize, own: &[usize]) -> bool {
        let passive = self.network.passive.iter().filter(|_| self.passive).flat_map(|passive| &passive.image_points);
        if self.network.targets[target].covariance.is_some() || passive.clone().any(|seen| seen.target == target) {
            return false;
        }
        let known = |&index: &usize| 2 * usize::from(self.uses_pixel(index)) + usize::from(self.uses_range(index));
        own.iter().map(known).sum::<usize>() < 3
    }

    fn drop_target(&mut self, target: usize, own: &[usize]) {
        for &index in own {
            let seen = &self.network.sightings[index];
            if seen.pixel.is_some() {
                self.excluded.image_points.insert(index);
            }
            if seen.range_m.is_some() {
                self.excluded.ranges.insert(index);
            }
        }
        let end = DistanceEnd::Target(target);
        let distances = self.network.distances.iter().enumerate();
        let touched = distances.filter(|(_, known)| known.from == end || known.to == end).map(|(index, _)| index);
        self.excluded.distances.extend(touched);
        self.start.targets[target] = None;
    }
}

/// Image diagonal times the share that start values may be off by, pixel.
pub fn start_limit(network: &Network) -> f64 {
    let format = &network.camera.format;
    START_SHARE * (format.width as f64).hypot(format.height as f64)
}

/// How far ranges may be off at start values that typically are off by so much, metre.
pub fn start_range_limit(network: &Network, typical_m: f64) -> f64 {
    (START_INTERVAL * network.range_model.ambiguity_interval_m).max(2.0 * CONTRADICTS * typical_m)
}
