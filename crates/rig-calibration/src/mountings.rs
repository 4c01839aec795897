//! How the cameras sit on the rig, from the poses that each has by itself: closed form, over all epochs that they share,
//! by what most of them agree on.

use std::collections::BTreeMap;

use calibration_network::functional_model::modelled_pixel;
use calibration_network::start_values::start_limit;
use nalgebra::Isometry3;
use statistics::upper_median;

use crate::alone::Alone;
use crate::rig::{Rig, RigCamera};
use crate::world::World;
use crate::{Error, Result};

/// Image residuals of an epoch, in those that epochs typically have, beyond which it does not fit the mounting.
const CONSPICUOUS: f64 = 6.0;
/// Share of what start values may be off by below which no epoch is conspicuous: one pixel of 176 x 144, which poses that
/// a range camera has by itself are off by.
const ORDINARY: f64 = 0.1;
/// Share of the epochs that a mounting fits, or none was found.
const MOST: f64 = 0.5;
/// Pairs of epochs that are tried for stations that are named otherwise in another camera.
const MOST_PAIRS: usize = 4096;
/// How far a mounting may be from where it is said to be, metre and radian (10 degrees): what a ruler shows.
const APPROXIMATE: [f64; 2] = [0.1, 0.175];

/// Poses of the rig and of its cameras.
#[derive(Debug, Clone)]
pub(crate) struct Mountings {
    /// `world_from_rig` by epoch.
    pub(crate) epochs: BTreeMap<String, Isometry3<f64>>,
    /// `rig_from_camera` of each camera.
    pub(crate) cameras: Vec<Isometry3<f64>>,
}

/// Finds all mountings: that of the camera which shares most epochs with those known first.
pub(crate) fn find(rig: &Rig, alone: &[Alone], world: &World) -> Result<Mountings> {
    let mut cameras = vec![None; rig.cameras.len()];
    cameras[0] = Some(Isometry3::identity());
    let mut epochs = alone[0].stations.clone();
    loop {
        let shared = |camera: usize| alone[camera].stations.keys().filter(|name| epochs.contains_key(*name)).count();
        let open = (0..cameras.len()).filter(|&camera| cameras[camera].is_none());
        let Some(next) = open.max_by_key(|&camera| (shared(camera), usize::MAX - camera)) else { break };
        if shared(next) == 0 {
            return Err(never_together(rig, alone, &cameras, next));
        }
        let judge = Judge { camera: &rig.cameras[next], alone: &alone[next], epochs: &epochs, world };
        let mounting = judge.mounting()?;
        cameras[next] = Some(mounting);
        for (name, pose) in &alone[next].stations {
            epochs.entry(name.clone()).or_insert_with(|| pose * mounting.inverse());
        }
    }
    let cameras: Vec<Isometry3<f64>> = cameras.into_iter().flatten().collect();
    check_approximate(rig, &cameras)?;
    Ok(Mountings { epochs, cameras })
}

/// Epochs that two cameras share, but where too little is seen to orient both.
fn never_together(rig: &Rig, alone: &[Alone], known: &[Option<Isometry3<f64>>], camera: usize) -> Error {
    let names = known.iter().zip(&rig.cameras).filter(|(known, _)| known.is_some());
    let some = alone[camera].stations.keys().take(3).cloned().collect::<Vec<_>>().join(", ");
    Error::NeverTogether {
        first: names.map(|(_, camera)| format!("camera `{}`", camera.name)).collect::<Vec<_>>().join(", "),
        second: format!("camera `{}`", rig.cameras[camera].name),
        names: format!("where both see four targets and more; the latter does at {some}, ..."),
    }
}

/// One camera against the poses of the rig.
struct Judge<'r> {
    camera: &'r RigCamera,
    alone: &'r Alone,
    epochs: &'r BTreeMap<String, Isometry3<f64>>,
    world: &'r World,
}

impl Judge<'_> {
    fn mounting(&self) -> Result<Isometry3<f64>> {
        let shared = self.alone.stations.iter().filter_map(|(name, pose)| Some((name, self.epochs.get(name)?, pose)));
        let shared: Vec<(&String, &Isometry3<f64>, &Isometry3<f64>)> = shared.collect();
        let found: Vec<Isometry3<f64>> = shared.iter().map(|(_, rig, pose)| rig.inverse() * **pose).collect();
        let Some(mounting) = self.central(&found) else {
            return Err(Error::NotConnected { camera: self.camera.name.clone(), found: 0 });
        };
        let misses: Vec<f64> = shared.iter().map(|(name, rig, _)| self.miss(name, &(**rig * mounting))).collect();
        let limit = self.limit(&misses);
        let wrong: Vec<&str> = shared
            .iter()
            .zip(&misses)
            .filter(|(_, miss)| miss.is_nan() || **miss > limit)
            .map(|((name, ..), _)| name.as_str())
            .collect();
        if wrong.is_empty() {
            return Ok(mounting);
        }
        let fitting = (shared.len() - wrong.len()) as f64;
        let explained = if fitting > MOST * shared.len() as f64 {
            self.epochs_of(&mounting, &wrong, limit)
        } else {
            self.renamed(limit).unwrap_or_default()
        };
        Err(Error::Contradiction(self.words(&wrong, shared.len(), &explained)))
    }

    /// The mounting that the others are typically nearest to: one radian stands for the distance of the targets.
    fn central(&self, found: &[Isometry3<f64>]) -> Option<Isometry3<f64>> {
        let distance = self.typical_distance();
        let apart = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            (a.translation.vector - b.translation.vector).norm() / distance + a.rotation.angle_to(&b.rotation)
        };
        let spread = |pose: &Isometry3<f64>| {
            upper_median(&mut found.iter().map(|other| apart(pose, other)).collect::<Vec<f64>>())
        };
        found.iter().map(|pose| (spread(pose), pose)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pose)| *pose)
    }

    fn typical_distance(&self) -> f64 {
        let network = &self.camera.network;
        let distances = network.sightings.iter().filter_map(|seen| {
            let pose = self.alone.stations.get(&network.stations[seen.station].name)?;
            let point = self.world.targets.get(&network.targets[seen.target].name)?;
            Some((point.coords - pose.translation.vector).norm())
        });
        let typical = upper_median(&mut distances.collect::<Vec<f64>>());
        if typical > 0.0 { typical } else { 1.0 }
    }

    /// Median distance of a station's image points from where a pose of the camera puts them, pixel.
    fn miss(&self, station: &str, pose: &Isometry3<f64>) -> f64 {
        let network = &self.camera.network;
        let own = network.sightings.iter().filter(|seen| network.stations[seen.station].name == station);
        let sizes = own.filter_map(|seen| {
            let point = self.world.targets.get(&network.targets[seen.target].name)?;
            let pixel = seen.pixel?;
            let modelled = modelled_pixel(&self.alone.camera, pose, point);
            Some(modelled.map_or(f64::INFINITY, |modelled| (pixel[0] - modelled[0]).hypot(pixel[1] - modelled[1])))
        });
        upper_median(&mut sizes.collect::<Vec<f64>>())
    }

    fn limit(&self, misses: &[f64]) -> f64 {
        let most = start_limit(&self.camera.network);
        (CONSPICUOUS * upper_median(&mut misses.to_vec())).clamp(ORDINARY * most, most)
    }

    /// The epochs of the rig that stations fit instead of those of their name.
    fn epochs_of(&self, mounting: &Isometry3<f64>, stations: &[&str], limit: f64) -> Vec<(String, String)> {
        let best = |station: &str| {
            let misses = self.epochs.iter().map(|(name, rig)| (self.miss(station, &(rig * mounting)), name));
            misses.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(miss, _)| *miss <= limit).map(|(_, name)| name.clone())
        };
        let fitting = stations.iter().filter_map(|station| Some(((*station).to_owned(), best(station)?)));
        fitting.filter(|(station, epoch)| station != epoch).collect()
    }

    /// The epochs that most stations fit under one mounting, where names tell of none: every station with every epoch is
    /// tried for it.
    fn renamed(&self, limit: f64) -> Option<Vec<(String, String)>> {
        let pairs =
            self.alone.stations.values().flat_map(|pose| self.epochs.values().map(move |rig| rig.inverse() * pose));
        let stations: Vec<&str> = self.alone.stations.keys().map(String::as_str).collect();
        let tried = pairs.take(MOST_PAIRS).map(|mounting| {
            let fitting = self.stations_near(&mounting);
            (fitting, mounting)
        });
        let (_, mounting) = tried.max_by_key(|(fitting, _)| *fitting)?;
        let fitting = self.epochs_of(&mounting, &stations, limit);
        (fitting.len() as f64 > MOST * stations.len() as f64).then_some(fitting)
    }

    /// How many stations stand, under a mounting, where the rig stood at any epoch.
    fn stations_near(&self, mounting: &Isometry3<f64>) -> usize {
        let format = &self.camera.network.camera.format;
        let [pitch, _] = format.pixel_pitch_mm;
        // The angle that start values may be off by.
        let angle = start_limit(&self.camera.network) * pitch / self.alone.camera.interior.principal_distance_mm;
        let distance = angle * self.typical_distance();
        let near = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            (a.translation.vector - b.translation.vector).norm() < distance && a.rotation.angle_to(&b.rotation) < angle
        };
        let stations = self.alone.stations.values().map(|pose| pose * mounting.inverse());
        stations.filter(|rig| self.epochs.values().any(|epoch| near(rig, epoch))).count()
    }

    fn words(&self, wrong: &[&str], shared: usize, explained: &[(String, String)]) -> String {
        let name = &self.camera.name;
        let some = |names: &[String]| {
            let more = if names.len() > 6 { ", ..." } else { "" };
            format!("{}{more}", names.iter().take(6).cloned().collect::<Vec<_>>().join(", "))
        };
        let list = some(&wrong.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>());
        let seen = format!("no one mounting of camera `{name}` fits its stations {list} ({} of {shared})", wrong.len());
        if explained.is_empty() {
            return format!(
                "{seen}; was it exposed at another moment than the others there, or moved on the rig? Look at the rows of \
                 these stations, or leave them out"
            );
        }
        let pairs: Vec<String> =
            explained.iter().map(|(from, to)| format!("`{from}` was taken at epoch `{to}`")).collect();
        format!("{seen}; they fit if {}: mend the column `station` of its observations.csv", some(&pairs))
    }
}

/// Refuses mountings that are not where they are said to be, and names cameras that seem to be exchanged.
fn check_approximate(rig: &Rig, found: &[Isometry3<f64>]) -> Result<()> {
    let fits = |found: &Isometry3<f64>, said: &Isometry3<f64>| {
        (found.translation.vector - said.translation.vector).norm() < APPROXIMATE[0]
            && found.rotation.angle_to(&said.rotation) < APPROXIMATE[1]
    };
    let said: Vec<Option<Isometry3<f64>>> = rig.cameras.iter().map(|camera| camera.approximate).collect();
    let fitting = |cameras: &[Isometry3<f64>]| {
        cameras.iter().zip(&said).all(|(found, said)| said.is_none_or(|said| fits(found, &said)))
    };
    if fitting(found) {
        return Ok(());
    }
    for first in 0..found.len() {
        for second in first + 1..found.len() {
            let mut exchanged = found.to_vec();
            exchanged.swap(first, second);
            // The first camera is the frame.
            let frame = exchanged[0].inverse();
            for pose in &mut exchanged {
                *pose = frame * *pose;
            }
            if fitting(&exchanged) {
                let [first, second] = [first, second].map(|index| &rig.cameras[index].name);
                return Err(Error::Contradiction(format!(
                    "the mountings are where rig.ron has them if cameras `{first}` and `{second}` are exchanged: exchange \
                     their folders, or their files"
                )));
            }
        }
    }
    let wrong = rig
        .cameras
        .iter()
        .zip(found)
        .find(|(camera, found)| camera.approximate.is_some_and(|said| !fits(found, &said)));
    let Some((camera, pose)) = wrong else { return Ok(()) };
    let said = camera.approximate.unwrap_or_default();
    let [x, y, z] = pose.translation.vector.into();
    let turned = pose.rotation.angle_to(&said.rotation).to_degrees();
    Err(Error::Contradiction(format!(
        "camera `{}` sits {:.3} m and {turned:.1} degrees from where rig.ron has it, at {x:.3}, {y:.3}, {z:.3} m; mend its \
         place there, or look whether cameras, axes or units are exchanged",
        camera.name,
        (pose.translation.vector - said.translation.vector).norm()
    )))
}
