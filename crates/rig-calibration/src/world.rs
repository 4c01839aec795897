//! One frame for all cameras, by the targets that they share.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};
use orientation::robust_absolute_orientation;
use statistics::upper_median;

use crate::alone::Alone;
use crate::rig::Rig;
use crate::{Error, Result};

/// Targets that orient one frame to another.
const NEEDED: usize = 3;

/// Share of the size of a target field that the places of its targets by two cameras may typically differ by. Range cameras
/// are off by centimetres in metres before they are calibrated; names that are exchanged, or another unit, by as much as
/// the field itself.
const MOST_APART: f64 = 0.1;

/// Where targets are, in the frame of the first camera that was calibrated by itself.
#[derive(Debug, Clone, Default)]
pub(crate) struct World {
    pub(crate) targets: BTreeMap<String, Point3<f64>>,
}

impl World {
    /// Begins with a camera, and with the given coordinates of what it does not see.
    pub(crate) fn new(first: &Alone, rig: &Rig) -> Self {
        let mut world = Self { targets: first.targets.clone() };
        let given = rig.cameras.iter().flat_map(|camera| &camera.network.targets);
        let given: BTreeMap<String, Point3<f64>> =
            given.filter_map(|target| Some((target.name.clone(), target.point?))).collect();
        if let Ok(world_from_given) = world.orient("", &given) {
            for (name, point) in given {
                world.targets.entry(name).or_insert(world_from_given * point);
            }
        }
        world
    }

    /// `world_from_own` of a camera's points that have names.
    fn orient(&self, camera: &str, own: &BTreeMap<String, Point3<f64>>) -> Result<Isometry3<f64>> {
        let common = own.iter().filter_map(|(name, point)| Some((*point, *self.targets.get(name)?)));
        let common: Vec<(Point3<f64>, Point3<f64>)> = common.collect();
        let found = Some(&common).filter(|common| common.len() >= NEEDED).and_then(|c| robust_absolute_orientation(c));
        let Some(pose) = found else {
            return Err(Error::NotConnected { camera: camera.to_owned(), found: common.len() });
        };
        let centre = common.iter().map(|(_, to)| to.coords).sum::<Vector3<f64>>() / common.len() as f64;
        let size = upper_median(&mut common.iter().map(|(_, to)| (to.coords - centre).norm()).collect::<Vec<f64>>());
        let off = upper_median(&mut common.iter().map(|(from, to)| (pose * from - to).norm()).collect::<Vec<f64>>());
        if off <= MOST_APART * size {
            return Ok(pose);
        }
        let reason = format!(
            "the {} targets that it shares with the other cameras are not in the same places: typically {off:.3} m off, by \
             their own observations, in a field of {size:.2} m; are targets named otherwise?",
            common.len()
        );
        Err(Error::NotPlaced { camera: camera.to_owned(), reason })
    }

    /// Brings a camera that was calibrated by itself into the world.
    pub(crate) fn take(&mut self, name: &str, alone: &mut Alone) -> Result<()> {
        let world_from_own = self.orient(name, &alone.targets)?;
        alone.stations.values_mut().for_each(|pose| *pose = world_from_own * *pose);
        alone.targets.values_mut().for_each(|point| *point = world_from_own * *point);
        self.add(alone);
        Ok(())
    }

    /// Adds the targets of a camera that is in the world already.
    pub(crate) fn add(&mut self, alone: &Alone) {
        for (name, point) in &alone.targets {
            self.targets.entry(name.clone()).or_insert(*point);
        }
    }
}
