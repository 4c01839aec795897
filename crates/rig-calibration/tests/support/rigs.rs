//! A rig of known truth: two range cameras and one grey camera before a field of targets.

use rig_calibration::calibration_network::weakness::planned_sightings;
use rig_calibration::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use rig_calibration::error_models::{RangeErrorModel, RangeTerms};
use rig_calibration::nalgebra::{Isometry3, Point3, Vector3};
use rig_calibration::self_calibration::{
    CalibrationOptions, Network, NetworkTarget, SightingOptions, SimulatedStart, Station, TermSelection,
    simulate_sightings,
};
use rig_calibration::{Rig, RigCamera};

/// Names of the cameras.
pub const NAMES: [&str; 3] = ["left", "right", "grey"];
/// Ambiguity interval of the range cameras, metre.
const INTERVAL_M: f64 = 7.5;

/// Terms that the rig has, all of which are estimated.
pub const TERMS: &str = "xp yp c k1 k2 d0 d4 d5 d6 d7 e1 e2";
/// Those of the lens alone.
pub const LENS: &str = "xp yp c k1 k2";

/// Where the cameras sit: `rig_from_camera`.
pub fn mountings() -> [Isometry3<f64>; 3] {
    let pose = |place: [f64; 3], degrees: [f64; 3]| pose_from_euler(Vector3::from(place), degrees.map(f64::to_radians));
    [Isometry3::identity(), pose([0.18, 0.01, -0.02], [1.5, 6.0, 90.0]), pose([0.09, 0.07, 0.03], [-3.0, 2.0, 1.0])]
}

/// Poses of the rig: a distance (m) from the middle of the field, off its normal by two angles, and rolled (degrees).
pub fn epochs() -> Vec<(String, Isometry3<f64>)> {
    let poses: [[f64; 4]; 12] = [
        [1.5, 0.0, 0.0, 0.0],
        [2.3, 0.0, 0.0, 90.0],
        [3.2, 3.0, 0.0, 0.0],
        [4.1, 0.0, 3.0, 180.0],
        [2.8, -3.0, 0.0, 270.0],
        [2.6, 35.0, 0.0, 125.0],
        [2.6, -35.0, 0.0, 55.0],
        [2.6, 0.0, 35.0, 90.0],
        [2.6, 0.0, -35.0, 90.0],
        [3.6, 30.0, 20.0, 0.0],
        [3.4, -20.0, -25.0, 200.0],
        [1.9, 15.0, 10.0, 300.0],
    ];
    let pose = |[distance, aside, above, roll]: [f64; 4]| {
        let turn = pose_from_euler(Vector3::zeros(), [above, aside, roll].map(f64::to_radians));
        Isometry3::from_parts((turn * Vector3::new(0.0, 0.0, distance)).into(), turn.rotation)
    };
    poses.into_iter().enumerate().map(|(index, values)| (format!("E{index:02}"), pose(values))).collect()
}

fn camera(index: usize) -> Camera {
    let (format, c) = if index == 2 {
        (ImageFormat::new(640, 512, [0.01, 0.01]), 6.0)
    } else {
        (ImageFormat::new(176, 144, [0.04, 0.04]), 8.0)
    };
    let lens = [
        LensDistortion { k1: -1.5e-3, k2: 2e-5, ..LensDistortion::default() },
        LensDistortion { k1: -1.1e-3, k2: 1e-5, ..LensDistortion::default() },
        LensDistortion { k1: 1e-3, k2: -1.5e-5, ..LensDistortion::default() },
    ];
    let principal_point_mm = [[0.06, -0.04], [-0.05, 0.02], [0.03, 0.05]][index];
    let interior = InteriorOrientation { principal_point_mm, principal_distance_mm: c + [0.02, -0.03, 0.04][index] };
    Camera::new(format.unwrap(), interior, lens[index]).unwrap()
}

fn nominal(index: usize) -> Camera {
    let principal_distance_mm = if index == 2 { 6.0 } else { 8.0 };
    let interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm };
    Camera::new(camera(index).format, interior, LensDistortion::default()).unwrap()
}

/// Range terms that differ in offset, waves and clock skew.
fn range_model(index: usize) -> RangeErrorModel {
    let terms = [
        RangeTerms { d0: 0.024, periodic: [0.0, 0.0, 0.003, 0.005, -0.009, 0.004], e1: 1.5e-3, e2: -1e-3 },
        RangeTerms { d0: -0.031, periodic: [0.0, 0.0, -0.006, 0.004, 0.005, 0.007], e1: -2e-3, e2: 2e-3 },
        RangeTerms::default(),
    ];
    RangeErrorModel { terms: terms[index], ..RangeErrorModel::error_free(INTERVAL_M) }
}

/// The network of a camera with its truth; sightings are all that is in its images, and the grey camera's have no ranges.
pub fn truth(index: usize) -> Network {
    let mounting = mountings()[index];
    // Each camera misses an epoch of its own.
    let exposed = epochs().into_iter().enumerate().filter(|(epoch, _)| *epoch != 9 + index % 3);
    let station = |(_, (name, pose)): (usize, (String, Isometry3<f64>))| Station {
        name,
        world_from_camera: Some(pose * mounting),
        covariance: None,
        integration_time_s: None,
        drift_m: 0.0,
    };
    let target = |index: usize| {
        let (row, col) = (index / 8, index % 8);
        let z = if (row + col) % 3 == 0 { 0.25 } else { 0.0 };
        let point = Some(Point3::new(0.3 * (col as f64 - 3.5), 0.3 * (row as f64 - 2.5), z));
        NetworkTarget { name: format!("T{index:02}"), point, covariance: None }
    };
    let mut network = Network {
        camera: camera(index),
        range_model: range_model(index),
        stations: exposed.map(station).collect(),
        targets: (0..48).map(target).collect(),
        sightings: Vec::new(),
        distances: Vec::new(),
        passive: None,
    };
    network.sightings = planned_sightings(&network).unwrap();
    if index == 2 {
        for seen in &mut network.sightings {
            seen.range_m = None;
        }
    }
    network
}

/// The rig as it is observed: nominal cameras, no range error known, and nothing known of poses and targets.
pub fn observed(seed: u64, gross_error_share: f64) -> Rig {
    let camera = |index: usize| {
        let options = SightingOptions { gross_error_share, ..sightings(seed, index) };
        let mut network = simulate_sightings(&truth(index), &options).unwrap();
        network.camera = nominal(index);
        network.range_model = RangeErrorModel::error_free(INTERVAL_M);
        RigCamera { name: NAMES[index].to_owned(), network, terms: None, approximate: None }
    };
    Rig { cameras: (0..3).map(camera).collect() }
}

/// The same rig whose right camera sat so far aside at epoch E07, metre.
#[allow(dead_code)] // each of the programs that share this file uses what it needs
pub fn knocked(seed: u64, aside_m: f64) -> Rig {
    let mut rig = observed(seed, 0.0);
    let mut moved = truth(1);
    for station in moved.stations.iter_mut().filter(|station| station.name == "E07") {
        let aside = Isometry3::translation(aside_m, 0.0, 0.0);
        station.world_from_camera = station.world_from_camera.map(|pose| pose * aside);
    }
    rig.cameras[1].network.sightings = simulate_sightings(&moved, &sightings(seed, 1)).unwrap().sightings;
    rig
}

/// How a camera sees targets, without gross errors.
pub fn sightings(seed: u64, index: usize) -> SightingOptions {
    SightingOptions {
        sigma_pixel: if index == 2 { 0.1 } else { 0.05 },
        sigma_range_m: 0.008,
        seed: 3 * seed + index as u64,
        gross_error_share: 0.0,
        start: SimulatedStart::Absent,
        ..SightingOptions::default()
    }
}

/// Options with these terms.
pub fn options(terms: &str) -> CalibrationOptions {
    let names = terms.split(' ').map(str::to_owned).collect();
    CalibrationOptions { terms: TermSelection::List(names), ..CalibrationOptions::default() }
}
