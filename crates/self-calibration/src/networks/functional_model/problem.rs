//! What an adjustment of a network consists of; [`crate::networks::functional_model::builder`] puts it together.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use adjust::{BlockId, Solution};
use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{DMatrix, Isometry3, Point3};

use crate::networks::functional_model::equations::{RangeEquation, SightingEquation};
use crate::networks::functional_model::hyperbola_steps::has_natural_steps;
use crate::networks::functional_model::terms::family_widths;
use crate::networks::{Component, DistanceEnd, Network};

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
    /// Control points and control poses, by their target and station.
    pub(crate) control_points: BTreeSet<usize>,
    pub(crate) control_poses: BTreeSet<usize>,
}

/// Parameters of a block known from elsewhere: components of the block, values, covariance.
#[derive(Debug, Clone)]
pub(crate) struct BlockPrior {
    pub(crate) known: Vec<(usize, f64)>,
    pub(crate) covariance: DMatrix<f64>,
}

/// One adjustment of a network.
#[derive(Debug, Clone)]
pub(crate) struct Setup<'n> {
    pub(crate) network: &'n Network,
    pub(crate) start: Start,
    /// Which of the given poses and coordinates were no start values, and why.
    pub(crate) unused: Option<String>,
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
    /// The camera, known from another adjustment.
    pub(crate) camera_prior: Option<BlockPrior>,
    /// Standard deviations about zero of terms that are estimated with what cameras show, by name.
    pub(crate) term_sigmas: BTreeMap<&'static str, f64>,
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
    /// A control point and its axis, a control pose and its component.
    Target(usize, usize),
    Station(usize, usize),
    Camera,
    PassiveCamera,
    /// A term that is estimated with what cameras show: its block - the camera, then the range sets - and component.
    Term(usize, usize),
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
    /// The equation on these blocks.
    pub(crate) fn on(self, camera: &Camera, blocks: Vec<BlockId>) -> SightingEquation {
        SightingEquation { blocks, camera: *camera, pixel: self.pixel, uses_pixel: self.uses_pixel, range: self.range }
    }
}
