//! What an adjustment of a network consists of; [`crate::functional_model::builder`] puts it together.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use adjust::{BlockId, Solution};
use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{DMatrix, Isometry3, Point3};

use crate::functional_model::equations::{RangeEquation, SightingEquation};
use crate::functional_model::hyperbola_steps::has_natural_steps;
use crate::functional_model::terms::family_widths;
use crate::{Component, DistanceEnd, Network};

/// Calibration to start from, or found: the camera, and range terms by integration time.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Interior orientation and lens.
    pub camera: Camera,
    /// Range terms, one set an integration time.
    pub sets: Vec<RangeSet>,
}

/// The range terms of one integration time.
#[derive(Debug, Clone)]
pub struct RangeSet {
    /// Integration time, second; `None` where the network names none.
    pub time: Option<f64>,
    /// What is put behind the names of its terms.
    pub suffix: String,
    /// The terms with their values.
    pub model: RangeErrorModel,
}

/// Poses and coordinates to start from. A target that nothing shows has none.
#[derive(Debug, Clone)]
pub struct Start {
    /// `world_from_camera` of each station.
    pub stations: Vec<Isometry3<f64>>,
    /// Place of each target, metre.
    pub targets: Vec<Option<Point3<f64>>>,
    /// `range_camera_from_passive`; `None` without a passive camera.
    pub relative: Option<Isometry3<f64>>,
    /// `rig_from_camera` of a camera that sits on a rig; `None`: the stations are those of the rig, or there is none.
    pub mounting: Option<Isometry3<f64>>,
}

/// What carries the datum of an adjustment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// Inner constraints on the targets.
    Inner,
    /// Targets and stations with a covariance are weighted.
    Control,
    /// As control, and targets with coordinates but without a covariance are held.
    Known,
}

/// Observations left out, by their position in the network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Excluded {
    /// Sightings whose image points are left out.
    pub image_points: BTreeSet<usize>,
    /// Sightings whose ranges are left out.
    pub ranges: BTreeSet<usize>,
    /// Image points of the passive camera.
    pub passive: BTreeSet<usize>,
    /// Known distances.
    pub distances: BTreeSet<usize>,
    /// Control points, by their target.
    pub control_points: BTreeSet<usize>,
    /// Control poses, by their station.
    pub control_poses: BTreeSet<usize>,
}

/// Parameters of a block known from elsewhere: components of the block, values, covariance.
#[derive(Debug, Clone)]
pub struct BlockPrior {
    /// Components of the block that are known, and their values.
    pub known: Vec<(usize, f64)>,
    /// Covariance of these values, in their order.
    pub covariance: DMatrix<f64>,
}

/// One adjustment of a network.
#[derive(Debug, Clone)]
pub struct Setup<'n> {
    /// What was observed.
    pub network: &'n Network,
    /// Poses and coordinates that the adjustment begins at.
    pub start: Start,
    /// Which of the given poses and coordinates were no start values, and why.
    pub unused: Option<String>,
    /// Calibration that the adjustment begins at.
    pub calibration: Calibration,
    /// Canonical names of the terms that are estimated.
    pub estimated: BTreeSet<String>,
    /// Stations whose ranges take part.
    pub ranged: Vec<bool>,
    /// Whether the passive camera takes part.
    pub passive: bool,
    /// What carries the datum.
    pub datum: Datum,
    /// Poses and coordinates are held at their start values.
    pub geometry_held: bool,
    /// The camera, known from another adjustment.
    pub camera_prior: Option<BlockPrior>,
    /// Standard deviations about zero of terms that are estimated with what cameras show, by name.
    pub term_sigmas: BTreeMap<&'static str, f64>,
    /// What takes no part.
    pub excluded: Excluded,
}

/// Where the unknowns of a network are.
#[derive(Debug, Clone)]
pub struct Blocks {
    /// Pose of each station; of the rig where there is a mounting.
    pub stations: Vec<BlockId>,
    /// Coordinates of each target; `None` where it has no start value.
    pub targets: Vec<Option<BlockId>>,
    /// Interior orientation and lens.
    pub camera: BlockId,
    /// Range terms of each integration time; empty where no range takes part.
    pub sets: Vec<BlockId>,
    /// Relative orientation and calibration of the passive camera.
    pub passive: Option<[BlockId; 2]>,
    /// Mounting of the camera on a rig, where the stations are those of the rig.
    pub mounting: Option<BlockId>,
}

impl Blocks {
    /// The blocks of the equation of a sighting, with the range set where there is a range.
    pub(crate) fn of_sighting(&self, station: usize, target: BlockId, set: Option<BlockId>) -> Vec<BlockId> {
        let own = [self.stations[station], target, self.camera];
        own.into_iter().chain(set).chain(self.mounting).collect()
    }

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
pub enum Source {
    /// A sighting by its position in the network; which of its values, says the component.
    Sighting(usize),
    /// An image point of the passive camera.
    Passive(usize),
    /// A known distance.
    Distance(usize),
    /// A control point and its axis.
    Target(usize, usize),
    /// A control pose and its component.
    Station(usize, usize),
    /// Interior orientation and lens, known from another adjustment.
    Camera,
    /// The calibration of the passive camera.
    PassiveCamera,
    /// A term that is estimated with what cameras show: its block - the camera, then the range sets - and component.
    Term(usize, usize),
}

/// One observed value, in the order of the adjustment's residuals.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// What was observed.
    pub source: Source,
    /// Which kind of value of it.
    pub component: Component,
    /// Observed value, in the unit of the component.
    pub observed: f64,
    /// A-priori standard deviation, same unit.
    pub sigma: f64,
}

/// A network put together and solved.
#[derive(Debug)]
pub struct Solved {
    /// The adjustment's solution, which the cameras of a rig share.
    pub solution: Arc<Solution>,
    /// Where the unknowns are.
    pub blocks: Blocks,
    /// What the residuals belong to, in their order from the first on.
    pub rows: Vec<Row>,
    /// Position of the residual of the first of these among those of the solution: 0 but for further cameras of a rig.
    pub first_row: usize,
    /// Inner constraints: 0, 6 or 7.
    pub datum_defect: usize,
}

impl Setup<'_> {
    /// Which set of range terms a station belongs to.
    pub fn set_of(&self, station: usize) -> usize {
        let time = self.network.stations[station].integration_time_s;
        self.calibration.sets.iter().position(|set| set.time == time).unwrap_or(0)
    }

    /// Whether an image point takes part.
    pub(crate) fn uses_pixel(&self, sighting: usize) -> bool {
        self.network.sightings[sighting].pixel.is_some() && !self.excluded.image_points.contains(&sighting)
    }

    /// Whether a range takes part.
    pub fn uses_range(&self, sighting: usize) -> bool {
        let seen = &self.network.sightings[sighting];
        seen.range_m.is_some() && self.ranged[seen.station] && !self.excluded.ranges.contains(&sighting)
    }

    /// Whether anything observed carries the scale.
    pub fn has_scale(&self) -> bool {
        (0..self.network.sightings.len()).any(|index| self.uses_range(index))
            || (0..self.network.distances.len()).any(|index| !self.excluded.distances.contains(&index))
    }

    /// Sentences about targets that nothing checks.
    pub fn seen_once(&self) -> Vec<String> {
        let passive = self.network.passive.iter().filter(|_| self.passive).flat_map(|passive| &passive.image_points);
        let mut counts = vec![0_usize; self.network.targets.len()];
        let own = self.network.sightings.iter().map(|seen| seen.target);
        own.chain(passive.map(|seen| seen.target)).for_each(|target| counts[target] += 1);
        let once = self.network.targets.iter().zip(counts).filter(|(target, n)| *n == 1 && target.covariance.is_none());
        once.map(|(target, _)| format!("target `{}` is seen once: nothing checks it, and it adds nothing", target.name))
            .collect()
    }

    /// What the equations of each set of range terms have in common.
    pub(crate) fn shared_models(&self) -> Vec<SharedModel> {
        let shared = |set: &RangeSet| SharedModel {
            widths: family_widths(&set.model).into(),
            natural_steps: has_natural_steps(&set.model, &self.estimated),
            model: Arc::new(set.model.clone()),
        };
        self.calibration.sets.iter().map(shared).collect()
    }

    /// The equation of a sighting with chosen components; `shared` from [`Self::shared_models`].
    pub(crate) fn equation(
        &self,
        shared: &[SharedModel],
        index: usize,
        uses_pixel: bool,
        uses_range: bool,
    ) -> EquationParts {
        let seen = &self.network.sightings[index];
        let shared = &shared[self.set_of(seen.station)];
        let range = seen.range_m.filter(|_| uses_range).map(|range_m| RangeEquation {
            range_m,
            amplitude: seen.amplitude.unwrap_or(f64::NAN),
            drift_m: self.network.stations[seen.station].drift_m,
            widths: Arc::clone(&shared.widths),
            natural_steps: shared.natural_steps,
            model: Arc::clone(&shared.model),
        });
        EquationParts { pixel: seen.pixel.unwrap_or([f64::NAN; 2]), uses_pixel, range }
    }
}

/// What the range equations of a set of terms have in common.
pub(crate) struct SharedModel {
    model: Arc<RangeErrorModel>,
    widths: Arc<[usize]>,
    natural_steps: bool,
}

/// A sighting's equation but for the blocks.
pub(crate) struct EquationParts {
    pixel: [f64; 2],
    uses_pixel: bool,
    range: Option<RangeEquation>,
}

impl EquationParts {
    /// The equation on the blocks of [`Blocks::of_sighting`].
    pub(crate) fn on(self, camera: &Camera, blocks: Vec<BlockId>, is_mounted: bool) -> SightingEquation {
        let Self { pixel, uses_pixel, range } = self;
        SightingEquation { blocks, camera: *camera, pixel, uses_pixel, range, is_mounted }
    }
}
