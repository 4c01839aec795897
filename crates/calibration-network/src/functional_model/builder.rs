//! The adjustment of a network, put together.

use adjust::{Adjustment, BlockId, Covariance, DatumDefect, Differentiated, Kernel, ParameterBlock, RigidPose};
use nalgebra::{DMatrix, Point3};

use crate::functional_model::equations::{KnownLength, PartialPrior, PassivePoint};
use crate::functional_model::hyperbola_steps::range_block;
use crate::functional_model::misfit::Scales;
use crate::functional_model::setup::{BlockPrior, Blocks, Datum, Row, Setup, Source};
use crate::functional_model::terms::{camera_names, camera_values, range_names};
use crate::{Component, DistanceEnd, Error, Result};

/// How an adjustment is made robust that gross errors take part in: standard deviations of image points and of ranges are
/// as many times those stated as they scatter, and all pull by one kernel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kernels {
    pub(crate) kernel: Kernel,
    pub(crate) scales: Scales,
}

pub(crate) struct Builder<'s> {
    setup: &'s Setup<'s>,
    pub(crate) adjustment: Adjustment<'s>,
    pub(crate) blocks: Blocks,
    pub(crate) rows: Vec<Row>,
    /// Image points and ranges are observations of their own where there are kernels.
    pub(crate) kernels: Option<Kernels>,
}

impl<'s> Builder<'s> {
    /// All that was observed; without a datum.
    pub(crate) fn add_observations(&mut self) -> Result<()> {
        self.add_sightings()?;
        self.add_passive()?;
        self.add_distances()?;
        self.add_control()?;
        self.add_term_priors()?;
        self.hold_geometry()?;
        let Some(kernels) = self.kernels else { return Ok(()) };
        let prior = self.adjustment.prior_group();
        Ok(self.adjustment.set_kernel(prior, kernels.kernel)?)
    }

    pub(crate) fn new(setup: &'s Setup<'s>) -> Result<Self> {
        let mut adjustment = Adjustment::new();
        let network = setup.network;
        let stations = network.stations.iter().zip(&setup.start.stations);
        let stations =
            stations.map(|(station, pose)| adjustment.add_block(ParameterBlock::pose(pose).named(&station.name)));
        let stations: Vec<BlockId> = stations.collect();
        let mut targets = Vec::with_capacity(network.targets.len());
        for (target, start) in network.targets.iter().zip(&setup.start.targets) {
            let names = ["x", "y", "z"].map(|axis| format!("{}.{axis}", target.name));
            let block = |point: &Point3<f64>| {
                let coordinates: [f64; 3] = (*point).into();
                adjustment.add_block(ParameterBlock::euclidean(coordinates).with_parameter_names(names))
            };
            targets.push(start.as_ref().map(block));
        }
        let camera = camera_block(&mut adjustment, setup);
        let blocks = Blocks { stations, targets, camera, sets: Vec::new(), passive: None, mounting: None };
        let mut builder = Self { setup, adjustment, blocks, rows: Vec::new(), kernels: None };
        builder.hold_calibration()?;
        Ok(builder)
    }

    /// Goes on with a further camera of a rig, on the same poses and targets. Answers with what belongs to the camera so
    /// far: its blocks and rows.
    pub(crate) fn next_camera(&mut self, setup: &'s Setup<'s>) -> Result<(Blocks, Vec<Row>)> {
        let mounting = setup.start.mounting.ok_or_else(|| Error::NotReachable {
            kind: "camera",
            name: "of the rig".to_owned(),
            reason: "its mounting was not found".to_owned(),
        })?;
        let mounting = self.adjustment.add_block(ParameterBlock::pose(&mounting).named("rig_from_camera"));
        let camera = camera_block(&mut self.adjustment, setup);
        let (stations, targets) = (self.blocks.stations.clone(), self.blocks.targets.clone());
        let blocks = Blocks { stations, targets, camera, sets: Vec::new(), passive: None, mounting: Some(mounting) };
        let before = std::mem::replace(&mut self.blocks, blocks);
        let rows = std::mem::take(&mut self.rows);
        self.setup = setup;
        self.hold_calibration()?;
        self.add_sightings()?;
        self.add_camera_prior()?;
        self.add_term_priors()?;
        Ok((before, rows))
    }

    /// Holds what is not estimated of camera and range terms.
    fn hold_calibration(&mut self) -> Result<()> {
        self.hold_terms(self.blocks.camera, &camera_names().iter().map(ToString::to_string).collect::<Vec<_>>())?;
        if (0..self.setup.network.sightings.len()).any(|index| self.setup.uses_range(index)) {
            self.add_sets()?;
        }
        Ok(())
    }

    fn add_sets(&mut self) -> Result<()> {
        for set in &self.setup.calibration.sets {
            let names = range_names(&set.model);
            let block = range_block(&set.model, &self.setup.estimated).named("range terms");
            let suffixed = names.iter().map(|name| format!("{name}{}", set.suffix));
            let block = self.adjustment.add_block(block.with_parameter_names(suffixed));
            self.hold_terms(block, &names)?;
            self.blocks.sets.push(block);
        }
        Ok(())
    }

    fn hold_terms(&mut self, block: BlockId, names: &[String]) -> Result<()> {
        for (component, name) in names.iter().enumerate() {
            if !self.setup.estimated.contains(name) {
                self.adjustment.hold_parameter(block, component)?;
            }
        }
        Ok(())
    }

    fn target(&self, index: usize) -> Result<BlockId> {
        let name = || self.setup.network.targets[index].name.clone();
        self.blocks.targets[index].ok_or_else(|| Error::NotReachable {
            kind: "target",
            name: name(),
            reason: "no station sees it, or nothing places it".to_owned(),
        })
    }

    fn add_sightings(&mut self) -> Result<()> {
        if let Some(kernels) = self.kernels {
            return self.add_robust_sightings(kernels);
        }
        let group = self.adjustment.add_group("sightings");
        let shared = self.setup.shared_models();
        for (index, seen) in self.setup.network.sightings.iter().enumerate() {
            let (uses_pixel, uses_range) = (self.setup.uses_pixel(index), self.setup.uses_range(index));
            if !uses_pixel && !uses_range {
                continue;
            }
            let target = self.target(seen.target)?;
            let mut set = None;
            let mut sigmas = Vec::with_capacity(3);
            if let Some([col, row]) = seen.pixel.filter(|_| uses_pixel) {
                let [sigma_col, sigma_row] = seen.sigma_pixel;
                sigmas.extend(seen.sigma_pixel);
                self.row(Source::Sighting(index), Component::Col, col, sigma_col);
                self.row(Source::Sighting(index), Component::Row, row, sigma_row);
            }
            if let Some(range_m) = seen.range_m.filter(|_| uses_range) {
                set = Some(self.blocks.sets[self.setup.set_of(seen.station)]);
                sigmas.push(seen.sigma_range_m);
                self.row(Source::Sighting(index), Component::Range, range_m, seen.sigma_range_m);
            }
            let equation = self.setup.equation(&shared, index, uses_pixel, uses_range);
            let blocks = self.blocks.of_sighting(seen.station, target, set);
            let equation = equation.on(&self.setup.calibration.camera, blocks, self.blocks.mounting.is_some());
            self.adjustment.add_observation(group, equation, &Covariance::from_sigmas(&sigmas))?;
        }
        Ok(())
    }

    /// Image points and ranges, each with the kernel of its kind.
    fn add_robust_sightings(&mut self, kernels: Kernels) -> Result<()> {
        let shared = self.setup.shared_models();
        let [images, ranges] = ["image points", "ranges"].map(|name| self.adjustment.add_group(name));
        self.adjustment.set_kernel(images, kernels.kernel)?;
        self.adjustment.set_kernel(ranges, kernels.kernel)?;
        for (index, seen) in self.setup.network.sightings.iter().enumerate() {
            let (uses_pixel, uses_range) = (self.setup.uses_pixel(index), self.setup.uses_range(index));
            for (group, is_range) in [(images, false), (ranges, true)] {
                if !(if is_range { uses_range } else { uses_pixel }) {
                    continue;
                }
                let set = is_range.then(|| self.blocks.sets[self.setup.set_of(seen.station)]);
                let blocks = self.blocks.of_sighting(seen.station, self.target(seen.target)?, set);
                let equation = self.setup.equation(&shared, index, !is_range, is_range);
                let equation = equation.on(&self.setup.calibration.camera, blocks, self.blocks.mounting.is_some());
                let sigmas = if is_range {
                    vec![kernels.scales.range * seen.sigma_range_m]
                } else {
                    seen.sigma_pixel.map(|sigma| kernels.scales.image * sigma).to_vec()
                };
                self.adjustment.add_observation(group, equation, &Covariance::from_sigmas(&sigmas))?;
            }
        }
        Ok(())
    }

    fn add_passive(&mut self) -> Result<()> {
        let Some(passive) = self.setup.network.passive.as_ref().filter(|_| self.setup.passive) else { return Ok(()) };
        let relative = self.setup.start.relative.ok_or_else(|| Error::NotReachable {
            kind: "camera",
            name: "passive".to_owned(),
            reason: "its relative orientation was not found".to_owned(),
        })?;
        let relative = self.adjustment.add_block(ParameterBlock::pose(&relative).named("range_camera_from_passive"));
        let names = camera_names().into_iter().map(|name| format!("passive.{name}"));
        let block = ParameterBlock::euclidean(camera_values(&passive.camera)).named("passive camera");
        let camera = self.adjustment.add_block(block.with_parameter_names(names));
        self.blocks.passive = Some([relative, camera]);
        self.add_passive_prior(camera)?;
        let group = self.group("passive image points")?;
        for (index, seen) in passive.image_points.iter().enumerate() {
            if self.setup.excluded.passive.contains(&index) {
                continue;
            }
            let blocks = [self.blocks.stations[seen.station], self.target(seen.target)?, relative, camera];
            let function = PassivePoint { camera: passive.camera, pixel: seen.pixel };
            let equation = Differentiated::new(&self.adjustment, blocks, function).map_err(adjust::Error::from)?;
            self.adjustment.add_observation(group, equation, &Covariance::from_sigmas(&seen.sigma_pixel))?;
            self.row(Source::Passive(index), Component::PassiveCol, seen.pixel[0], seen.sigma_pixel[0]);
            self.row(Source::Passive(index), Component::PassiveRow, seen.pixel[1], seen.sigma_pixel[1]);
        }
        Ok(())
    }

    /// A group of observations other than the sightings.
    fn group(&mut self, name: &str) -> Result<adjust::GroupId> {
        let group = self.adjustment.add_group(name);
        if let Some(kernels) = self.kernels {
            self.adjustment.set_kernel(group, kernels.kernel)?;
        }
        Ok(group)
    }

    /// Weights what is uncertain of the passive camera, holds the rest.
    fn add_passive_prior(&mut self, camera: BlockId) -> Result<()> {
        let Some(passive) = &self.setup.network.passive else { return Ok(()) };
        let values = camera_values(&passive.camera);
        let variance = |component: usize| passive.covariance.map_or(0.0, |matrix| matrix[(component, component)]);
        let uncertain: Vec<usize> = (0..values.len()).filter(|&component| variance(component) > 0.0).collect();
        for component in (0..values.len()).filter(|component| !uncertain.contains(component)) {
            self.adjustment.hold_parameter(camera, component)?;
        }
        let Some(matrix) = passive.covariance.filter(|_| !uncertain.is_empty()) else { return Ok(()) };
        let n = uncertain.len();
        let covariance = DMatrix::from_fn(n, n, |row, column| matrix[(uncertain[row], uncertain[column])]);
        let known = uncertain.iter().map(|&component| (component, values[component])).collect();
        self.add_block_prior(camera, &BlockPrior { known, covariance }, Component::Control, |_| Source::PassiveCamera)
    }

    /// Weights parameters of a block; `source` by component.
    fn add_block_prior(
        &mut self,
        block: BlockId,
        prior: &BlockPrior,
        kind: Component,
        source: impl Fn(usize) -> Source,
    ) -> Result<()> {
        let group = self.adjustment.prior_group();
        let equation = PartialPrior { block: [block], known: prior.known.clone() };
        self.adjustment.add_observation(group, equation, &Covariance::from_matrix(&prior.covariance))?;
        for (index, (component, value)) in prior.known.iter().enumerate() {
            self.row(source(*component), kind, *value, prior.covariance[(index, index)].sqrt());
        }
        Ok(())
    }

    /// Terms of camera and ranges with what cameras show; a camera known from another adjustment has that in it.
    fn add_term_priors(&mut self) -> Result<()> {
        if self.setup.camera_prior.is_none() {
            let names: Vec<String> = camera_names().into_iter().map(str::to_owned).collect();
            self.add_term_prior(0, self.blocks.camera, &names)?;
        }
        for (index, block) in self.blocks.sets.clone().into_iter().enumerate() {
            self.add_term_prior(index + 1, block, &range_names(&self.setup.calibration.sets[index].model))?;
        }
        Ok(())
    }

    /// `place` as in [`Source::Term`].
    fn add_term_prior(&mut self, place: usize, block: BlockId, names: &[String]) -> Result<()> {
        let Some(prior) = self.setup.term_prior(names) else { return Ok(()) };
        self.add_block_prior(block, &prior, Component::Term, |component| Source::Term(place, component))
    }

    fn add_distances(&mut self) -> Result<()> {
        let group = self.group("distances")?;
        for (index, known) in self.setup.network.distances.iter().enumerate() {
            if self.setup.excluded.distances.contains(&index) {
                continue;
            }
            let end = |end: DistanceEnd| match end {
                DistanceEnd::Station(station) => Ok(self.blocks.stations[station]),
                DistanceEnd::Target(target) => self.target(target),
            };
            let blocks = [end(known.from)?, end(known.to)?];
            let equation = Differentiated::new(&self.adjustment, blocks, KnownLength(known.distance_m))
                .map_err(adjust::Error::from)?;
            self.adjustment.add_observation(group, equation, &Covariance::from_sigma(known.sigma_m))?;
            self.row(Source::Distance(index), Component::Distance, known.distance_m, known.sigma_m);
        }
        Ok(())
    }

    fn add_camera_prior(&mut self) -> Result<()> {
        let Some(prior) = &self.setup.camera_prior else { return Ok(()) };
        self.add_block_prior(self.blocks.camera, prior, Component::Control, |_| Source::Camera)
    }

    fn add_control(&mut self) -> Result<()> {
        self.add_camera_prior()?;
        if self.setup.datum == Datum::Inner {
            return Ok(());
        }
        for (index, target) in self.setup.network.targets.iter().enumerate() {
            let (Some(point), Some(block)) = (target.point, self.blocks.targets[index]) else { continue };
            let Some(covariance) = target.covariance else {
                if self.setup.datum == Datum::Known {
                    self.adjustment.hold(block)?;
                }
                continue;
            };
            let coordinates: [f64; 3] = point.into();
            if self.setup.excluded.control_points.contains(&index) {
                continue;
            }
            self.adjustment.add_prior(block, &coordinates, &Covariance::from_matrix(&covariance))?;
            self.rows.extend(self.setup.target_control(index).into_iter().flatten());
        }
        self.add_station_control()
    }

    fn add_station_control(&mut self) -> Result<()> {
        for (index, station) in self.setup.network.stations.iter().enumerate() {
            let (Some(pose), Some(covariance)) = (station.world_from_camera, station.covariance) else { continue };
            if self.setup.excluded.control_poses.contains(&index) {
                continue;
            }
            let block = self.blocks.stations[index];
            self.adjustment.add_prior(block, &RigidPose::values(&pose), &Covariance::from_matrix(&covariance))?;
            self.rows.extend(self.setup.station_control(index).into_iter().flatten());
        }
        Ok(())
    }

    fn hold_geometry(&mut self) -> Result<()> {
        if !self.setup.geometry_held {
            return Ok(());
        }
        let relative = self.blocks.passive.map(|[relative, _]| relative);
        let geometry = self.blocks.stations.iter().chain(self.blocks.targets.iter().flatten()).copied();
        geometry.chain(relative).try_for_each(|block| Ok(self.adjustment.hold(block)?))
    }

    pub(crate) fn add_datum(&mut self, has_scale: bool) -> Result<usize> {
        if self.setup.datum != Datum::Inner || self.setup.geometry_held {
            return Ok(0);
        }
        let points: Vec<BlockId> = self.blocks.targets.iter().copied().flatten().collect();
        let defect = if has_scale { DatumDefect::Six } else { DatumDefect::Seven };
        self.adjustment.add_inner_constraints(&points, defect)?;
        Ok(defect.count())
    }

    fn row(&mut self, source: Source, component: Component, observed: f64, sigma: f64) {
        self.rows.push(Row { source, component, observed, sigma });
    }
}

fn camera_block(adjustment: &mut Adjustment<'_>, setup: &Setup<'_>) -> BlockId {
    let camera = ParameterBlock::euclidean(camera_values(&setup.calibration.camera)).named("camera");
    adjustment.add_block(camera.with_parameter_names(camera_names()))
}
