//! What a rig consists of.

use std::collections::BTreeSet;

use nalgebra::Isometry3;
use self_calibration::Network;

use crate::{Error, Result};

/// Cameras that sit on one rig. The first one is the frame of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// The cameras, two or more.
    pub cameras: Vec<RigCamera>,
}

/// A camera of a rig with what it observed.
#[derive(Debug, Clone, PartialEq)]
pub struct RigCamera {
    /// Name, unlike those of the others.
    pub name: String,
    /// Its stations, targets and sightings. Stations of one name in two cameras are exposures of one moment; targets of one
    /// name are one target. A camera of images alone has no ranges. Known distances and control poses are those of
    /// the first camera; control points may be in any.
    pub network: Network,
    /// Canonical names of the terms that are estimated for this camera; an empty list holds its calibration, `None` takes
    /// those of the options. Range terms of a camera without ranges are left out.
    pub terms: Option<Vec<String>>,
    /// About where it sits, `rig_from_camera`, to notice cameras that are taken for each other; `None` of the first one, and
    /// where nothing is known. It is no start value.
    pub approximate: Option<Isometry3<f64>>,
}

impl RigCamera {
    /// Whether it observed any range.
    pub fn has_ranges(&self) -> bool {
        self.network.sightings.iter().any(|seen| seen.range_m.is_some())
    }

    /// Names of the stations that have a sighting.
    pub(crate) fn epochs(&self) -> BTreeSet<&str> {
        self.network.sightings.iter().map(|seen| self.network.stations[seen.station].name.as_str()).collect()
    }
}

impl Rig {
    /// Checks names, numbers and references, and that epochs connect all cameras.
    ///
    /// # Errors
    /// [`Error::TooFewCameras`], [`Error::DuplicateCamera`], [`Error::Camera`], [`Error::Unfit`] and
    /// [`Error::NeverTogether`].
    pub fn validate(&self) -> Result<()> {
        if self.cameras.len() < 2 {
            return Err(Error::TooFewCameras { found: self.cameras.len() });
        }
        let mut names = BTreeSet::new();
        for camera in &self.cameras {
            if !names.insert(camera.name.as_str()) {
                return Err(Error::DuplicateCamera(camera.name.clone()));
            }
            camera.network.validate().map_err(|error| Error::of(&camera.name, error))?;
            let unfit = |reason: &str| Err(Error::Unfit { camera: camera.name.clone(), reason: reason.to_owned() });
            if camera.network.passive.is_some() {
                return unfit("it has a passive camera beside it, which is a camera of the rig of its own");
            }
            let is_first = camera.name == self.cameras[0].name;
            let control = camera.network.stations.iter().any(|station| station.covariance.is_some());
            if !is_first && (control || !camera.network.distances.is_empty()) {
                return unfit("control poses and known distances are those of the first camera, the frame of the rig");
            }
            if camera.network.sightings.is_empty() {
                return unfit("it has no sightings");
            }
        }
        if !self.cameras.iter().any(RigCamera::has_ranges) {
            let (camera, reason) = (self.cameras[0].name.clone(), "no camera of the rig observed ranges".to_owned());
            return Err(Error::Unfit { camera, reason });
        }
        self.check_epochs()
    }

    /// Refuses groups of cameras that no epoch connects.
    fn check_epochs(&self) -> Result<()> {
        let epochs: Vec<BTreeSet<&str>> = self.cameras.iter().map(RigCamera::epochs).collect();
        let mut connected = vec![false; epochs.len()];
        connected[0] = true;
        let mut known = epochs[0].clone();
        while let Some(next) = (0..epochs.len()).find(|&i| !connected[i] && !known.is_disjoint(&epochs[i])) {
            connected[next] = true;
            known.extend(&epochs[next]);
        }
        if connected.iter().all(|connected| *connected) {
            return Ok(());
        }
        let list = |state: bool| {
            let own = self.cameras.iter().zip(&connected).filter(|(_, connected)| **connected == state);
            own.map(|(camera, _)| format!("camera `{}`", camera.name)).collect::<Vec<_>>().join(", ")
        };
        let some = |names: &BTreeSet<&str>| names.iter().take(3).copied().collect::<Vec<_>>().join(", ");
        let apart: BTreeSet<&str> = epochs
            .iter()
            .zip(&connected)
            .filter(|(_, connected)| !**connected)
            .flat_map(|(own, _)| own.iter().copied())
            .collect();
        let names = format!("there are {}, ... and {}, ...", some(&known), some(&apart));
        Err(Error::NeverTogether { first: list(true), second: list(false), names })
    }
}
