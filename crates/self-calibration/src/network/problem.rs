//! The adjustment of a network, put together.

use std::collections::BTreeSet;
use std::sync::Arc;

use adjust::{Adjustment, BlockId, Covariance, DatumDefect, ParameterBlock, RigidPose, Solution, SolveOptions};
use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{DMatrix, Isometry3, Point3};

use super::equations::{DistanceEquation, PartialPrior, PassiveEquation, RangeEquation, SightingEquation};
use super::terms::{camera_names, camera_values, family_widths, range_names, range_values};
use super::{Component, DistanceEnd, Network};
use crate::{Error, Result};

/// Calibration to start from, or found: the camera, and range terms by integration time.
#[derive(Debug, Clone)]
pub(crate) struct Calibration {
    pub(crate) camera: Camera,
    pub(crate) sets: Vec<RangeSet>,
}

/// The range terms of one integration time.
#[derive(Debug, Clone)]
pub(crate) struct RangeSet {
    pub(crate) time: Option<f64>,
    /// What is put behind the names of its terms.
    pub(crate) suffix: String,
    pub(crate) model: RangeErrorModel,
}

/// Poses and coordinates to start from. A target that nothing shows has none.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub(crate) stations: Vec<Isometry3<f64>>,
    pub(crate) targets: Vec<Option<Point3<f64>>>,
    pub(crate) relative: Option<Isometry3<f64>>,
}

/// What carries the datum of an adjustment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Datum {
    /// Inner constraints on the targets.
    Inner,
    /// Targets and stations with a covariance are weighted.
    Control,
    /// As control, and targets with coordinates but without a covariance are held.
    Known,
}

/// Observations left out, by their position in the network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Excluded {
    pub(crate) image_points: BTreeSet<usize>,
    pub(crate) ranges: BTreeSet<usize>,
    pub(crate) passive: BTreeSet<usize>,
    pub(crate) distances: BTreeSet<usize>,
}

/// Camera parameters known from another adjustment: components of the camera's block, values, covariance.
#[derive(Debug, Clone)]
pub(crate) struct CameraPrior {
    pub(crate) known: Vec<(usize, f64)>,
    pub(crate) covariance: DMatrix<f64>,
}

/// One adjustment of a network.
#[derive(Debug, Clone)]
pub(crate) struct Setup<'n> {
    pub(crate) network: &'n Network,
    pub(crate) start: Start,
    pub(crate) calibration: Calibration,
    /// Canonical names of the terms that are estimated.
    pub(crate) estimated: BTreeSet<String>,
    /// Stations whose ranges take part.
    pub(crate) ranged: Vec<bool>,
    /// Whether the passive camera takes part.
    pub(crate) passive: bool,
    pub(crate) datum: Datum,
    /// Poses and coordinates are held at their start values.
    pub(crate) geometry_held: bool,
    pub(crate) camera_prior: Option<CameraPrior>,
    pub(crate) excluded: Excluded,
}

/// Where the unknowns of a network are.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    pub(crate) stations: Vec<BlockId>,
    pub(crate) targets: Vec<Option<BlockId>>,
    pub(crate) camera: BlockId,
    pub(crate) sets: Vec<BlockId>,
    /// Relative orientation and calibration of the passive camera.
    pub(crate) passive: Option<[BlockId; 2]>,
}

impl Blocks {
    /// The block of an end of a distance.
    pub(crate) fn end(&self, end: DistanceEnd) -> Option<BlockId> {
        match end {
            DistanceEnd::Station(station) => Some(self.stations[station]),
            DistanceEnd::Target(target) => self.targets[target],
        }
    }
}

/// What a row of the adjustment observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Source {
    Sighting(usize),
    Passive(usize),
    Distance(usize),
    Target(usize),
    Station(usize),
    Camera,
    PassiveCamera,
}

/// One observed value, in the order of the adjustment's residuals.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) source: Source,
    pub(crate) component: Component,
    pub(crate) observed: f64,
    pub(crate) sigma: f64,
}

/// A network put together and solved.
#[derive(Debug)]
pub(crate) struct Solved {
    pub(crate) solution: Solution,
    pub(crate) blocks: Blocks,
    pub(crate) rows: Vec<Row>,
    pub(crate) datum_defect: usize,
}

impl Setup<'_> {
    /// Solves the network.
    pub(crate) fn solve(&self) -> Result<Solved> {
        let mut builder = Builder::new(self)?;
        builder.add_sightings()?;
        builder.add_passive()?;
        builder.add_distances()?;
        builder.add_control()?;
        builder.hold_geometry()?;
        let datum_defect = builder.add_datum()?;
        let solution = builder.adjustment.solve(&solve_options())?;
        Ok(Solved { solution, blocks: builder.blocks, rows: builder.rows, datum_defect })
    }

    /// Which set of range terms a station belongs to.
    pub(crate) fn set_of(&self, station: usize) -> usize {
        let time = self.network.stations[station].integration_time_s;
        self.calibration.sets.iter().position(|set| set.time == time).unwrap_or(0)
    }

    /// Whether an image point takes part.
    pub(crate) fn uses_pixel(&self, sighting: usize) -> bool {
        self.network.sightings[sighting].pixel.is_some() && !self.excluded.image_points.contains(&sighting)
    }

    /// Whether a range takes part.
    pub(crate) fn uses_range(&self, sighting: usize) -> bool {
        let seen = &self.network.sightings[sighting];
        seen.range_m.is_some() && self.ranged[seen.station] && !self.excluded.ranges.contains(&sighting)
    }

    /// Whether anything observed carries the scale.
    pub(crate) fn has_scale(&self) -> bool {
        (0..self.network.sightings.len()).any(|index| self.uses_range(index))
            || (0..self.network.distances.len()).any(|index| !self.excluded.distances.contains(&index))
    }

    /// Sentences about targets that nothing checks.
    pub(crate) fn seen_once(&self) -> Vec<String> {
        let passive = self.network.passive.iter().filter(|_| self.passive).flat_map(|passive| &passive.image_points);
        let mut counts = vec![0_usize; self.network.targets.len()];
        let own = self.network.sightings.iter().map(|seen| seen.target);
        own.chain(passive.map(|seen| seen.target)).for_each(|target| counts[target] += 1);
        let once = self.network.targets.iter().zip(counts).filter(|(target, n)| *n == 1 && target.covariance.is_none());
        once.map(|(target, _)| format!("target `{}` is seen once: nothing checks it, and it adds nothing", target.name))
            .collect()
    }

    /// The equation of a sighting with chosen components.
    pub(crate) fn equation(&self, index: usize, uses_pixel: bool, uses_range: bool) -> EquationParts {
        let seen = &self.network.sightings[index];
        let model = Arc::new(self.calibration.sets[self.set_of(seen.station)].model.clone());
        let range = seen.range_m.filter(|_| uses_range).map(|range_m| RangeEquation {
            range_m,
            amplitude: seen.amplitude.unwrap_or(f64::NAN),
            widths: family_widths(&model).into(),
            model,
        });
        EquationParts { pixel: seen.pixel.unwrap_or([f64::NAN; 2]), uses_pixel, range }
    }
}

/// A sighting's equation but for the blocks.
pub(crate) struct EquationParts {
    pixel: [f64; 2],
    uses_pixel: bool,
    range: Option<RangeEquation>,
}

impl EquationParts {
    /// The equation on these blocks.
    pub(crate) fn on(self, camera: &Camera, blocks: Vec<BlockId>) -> SightingEquation {
        SightingEquation { blocks, camera: *camera, pixel: self.pixel, uses_pixel: self.uses_pixel, range: self.range }
    }
}

/// A network that is determined takes 10 to 30 steps; one that is not creeps on for thousands.
fn solve_options() -> SolveOptions {
    SolveOptions { max_iterations: 50, ..SolveOptions::default() }
}

struct Builder<'s> {
    setup: &'s Setup<'s>,
    adjustment: Adjustment<'s>,
    blocks: Blocks,
    rows: Vec<Row>,
}

impl<'s> Builder<'s> {
    fn new(setup: &'s Setup<'s>) -> Result<Self> {
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
        let camera = ParameterBlock::euclidean(camera_values(&setup.calibration.camera)).named("camera");
        let camera = adjustment.add_block(camera.with_parameter_names(camera_names()));
        let blocks = Blocks { stations, targets, camera, sets: Vec::new(), passive: None };
        let mut builder = Self { setup, adjustment, blocks, rows: Vec::new() };
        builder.hold_terms(camera, &camera_names().iter().map(ToString::to_string).collect::<Vec<_>>())?;
        if (0..network.sightings.len()).any(|index| setup.uses_range(index)) {
            builder.add_sets()?;
        }
        Ok(builder)
    }

    fn add_sets(&mut self) -> Result<()> {
        for set in &self.setup.calibration.sets {
            let names = range_names(&set.model);
            let block = ParameterBlock::euclidean(range_values(&set.model)).named("range terms");
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
        let group = self.adjustment.add_group("sightings");
        for (index, seen) in self.setup.network.sightings.iter().enumerate() {
            let (uses_pixel, uses_range) = (self.setup.uses_pixel(index), self.setup.uses_range(index));
            if !uses_pixel && !uses_range {
                continue;
            }
            let target = self.target(seen.target)?;
            let mut blocks = vec![self.blocks.stations[seen.station], target, self.blocks.camera];
            let mut sigmas = Vec::with_capacity(3);
            if let Some([col, row]) = seen.pixel.filter(|_| uses_pixel) {
                let [sigma_col, sigma_row] = seen.sigma_pixel;
                sigmas.extend(seen.sigma_pixel);
                self.row(Source::Sighting(index), Component::Col, col, sigma_col);
                self.row(Source::Sighting(index), Component::Row, row, sigma_row);
            }
            if let Some(range_m) = seen.range_m.filter(|_| uses_range) {
                blocks.push(self.blocks.sets[self.setup.set_of(seen.station)]);
                sigmas.push(seen.sigma_range_m);
                self.row(Source::Sighting(index), Component::Range, range_m, seen.sigma_range_m);
            }
            let equation = self.setup.equation(index, uses_pixel, uses_range);
            let equation = equation.on(&self.setup.calibration.camera, blocks);
            self.adjustment.add_observation(group, equation, &Covariance::from_sigmas(&sigmas))?;
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
        let group = self.adjustment.add_group("passive image points");
        for (index, seen) in passive.image_points.iter().enumerate() {
            if self.setup.excluded.passive.contains(&index) {
                continue;
            }
            let blocks = [self.blocks.stations[seen.station], self.target(seen.target)?, relative, camera];
            let equation = PassiveEquation { blocks, camera: passive.camera, pixel: seen.pixel };
            self.adjustment.add_observation(group, equation, &Covariance::from_sigmas(&seen.sigma_pixel))?;
            self.row(Source::Passive(index), Component::PassiveCol, seen.pixel[0], seen.sigma_pixel[0]);
            self.row(Source::Passive(index), Component::PassiveRow, seen.pixel[1], seen.sigma_pixel[1]);
        }
        Ok(())
    }

    /// Weights what is uncertain of the passive camera, holds the rest.
    fn add_passive_prior(&mut self, camera: BlockId) -> Result<()> {
        let Some(passive) = &self.setup.network.passive else { return Ok(()) };
        let values = camera_values(&passive.camera);
        let variance = |component: usize| {
            let known = passive.covariance.filter(|_| component < 8);
            known.map_or(0.0, |matrix| matrix[(component, component)])
        };
        let uncertain: Vec<usize> = (0..values.len()).filter(|&component| variance(component) > 0.0).collect();
        for component in (0..values.len()).filter(|component| !uncertain.contains(component)) {
            self.adjustment.hold_parameter(camera, component)?;
        }
        let Some(matrix) = passive.covariance.filter(|_| !uncertain.is_empty()) else { return Ok(()) };
        let n = uncertain.len();
        let covariance = DMatrix::from_fn(n, n, |row, column| matrix[(uncertain[row], uncertain[column])]);
        let known = uncertain.iter().map(|&component| (component, values[component])).collect();
        self.add_camera_prior(camera, &CameraPrior { known, covariance }, Source::PassiveCamera)
    }

    fn add_camera_prior(&mut self, block: BlockId, prior: &CameraPrior, source: Source) -> Result<()> {
        let group = self.adjustment.prior_group();
        let equation = PartialPrior { block: [block], known: prior.known.clone() };
        self.adjustment.add_observation(group, equation, &Covariance::from_matrix(&prior.covariance))?;
        for (index, (_, value)) in prior.known.iter().enumerate() {
            self.row(source, Component::Control, *value, prior.covariance[(index, index)].sqrt());
        }
        Ok(())
    }

    fn add_distances(&mut self) -> Result<()> {
        let group = self.adjustment.add_group("distances");
        for (index, known) in self.setup.network.distances.iter().enumerate() {
            if self.setup.excluded.distances.contains(&index) {
                continue;
            }
            let end = |end: DistanceEnd| match end {
                DistanceEnd::Station(station) => Ok(self.blocks.stations[station]),
                DistanceEnd::Target(target) => self.target(target),
            };
            let equation =
                DistanceEquation { blocks: [end(known.from)?, end(known.to)?], distance_m: known.distance_m };
            self.adjustment.add_observation(group, equation, &Covariance::from_sigma(known.sigma_m))?;
            self.row(Source::Distance(index), Component::Distance, known.distance_m, known.sigma_m);
        }
        Ok(())
    }

    fn add_control(&mut self) -> Result<()> {
        if let Some(prior) = &self.setup.camera_prior {
            self.add_camera_prior(self.blocks.camera, prior, Source::Camera)?;
        }
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
            self.adjustment.add_prior(block, &coordinates, &Covariance::from_matrix(&covariance))?;
            for (axis, value) in coordinates.into_iter().enumerate() {
                self.row(Source::Target(index), Component::Control, value, covariance[(axis, axis)].sqrt());
            }
        }
        self.add_station_control()
    }

    fn add_station_control(&mut self) -> Result<()> {
        for (index, station) in self.setup.network.stations.iter().enumerate() {
            let (Some(pose), Some(covariance)) = (station.world_from_camera, station.covariance) else { continue };
            let block = self.blocks.stations[index];
            self.adjustment.add_prior(block, &RigidPose::values(&pose), &Covariance::from_matrix(&covariance))?;
            for component in 0..6 {
                let observed = if component < 3 { pose.translation.vector[component] } else { 0.0 };
                self.row(
                    Source::Station(index),
                    Component::Control,
                    observed,
                    covariance[(component, component)].sqrt(),
                );
            }
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

    fn add_datum(&mut self) -> Result<usize> {
        if self.setup.datum != Datum::Inner || self.setup.geometry_held {
            return Ok(0);
        }
        let points: Vec<BlockId> = self.blocks.targets.iter().copied().flatten().collect();
        let defect = if self.setup.has_scale() { DatumDefect::Six } else { DatumDefect::Seven };
        self.adjustment.add_inner_constraints(&points, defect)?;
        Ok(defect.count())
    }

    fn row(&mut self, source: Source, component: Component, observed: f64, sigma: f64) {
        self.rows.push(Row { source, component, observed, sigma });
    }
}
