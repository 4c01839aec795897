//! Networks with known truth.

use std::collections::BTreeSet;

use calibration_network::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use calibration_network::error_models::{RangeErrorModel, RangeTerms};
use calibration_network::nalgebra::{Isometry3, Point3, Vector3};
use calibration_network::{Network, NetworkTarget, Station};

/// A pose at a distance (m) from the middle of the field, off its normal by two angles, and rolled (degrees).
fn looking([distance, aside, above, roll]: [f64; 4]) -> Isometry3<f64> {
    let turn = pose_from_euler(Vector3::zeros(), [above, aside, roll].map(f64::to_radians));
    Isometry3::from_parts((turn * Vector3::new(0.0, 0.0, distance)).into(), turn.rotation)
}

/// Stations over 48 targets, of which every third stands off the wall.
fn network(poses: &[[f64; 4]]) -> Network {
    let interior = InteriorOrientation { principal_point_mm: [0.06, -0.04], principal_distance_mm: 8.02 };
    let lens = LensDistortion { k1: -1.5e-3, k2: 2e-5, ..LensDistortion::default() };
    let terms = RangeTerms { d0: 0.024, periodic: [0.0, 0.0, 0.003, 0.005, -0.009, 0.004], e1: 1.5e-3, e2: -1e-3 };
    let station = |(index, pose): (usize, &[f64; 4])| Station {
        name: format!("S{index}"),
        world_from_camera: Some(looking(*pose)),
        covariance: None,
        integration_time_s: None,
        drift_m: 0.0,
    };
    let target = |index: usize| {
        let (row, col) = (index / 8, index % 8);
        let z = if (row + col) % 3 == 0 { 0.25 } else { 0.0 };
        let point = Some(Point3::new(0.3 * (col as f64 - 3.5), 0.3 * (row as f64 - 2.5), z));
        NetworkTarget { name: format!("T{index}"), point, covariance: None }
    };
    Network {
        camera: Camera::new(ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(), interior, lens).unwrap(),
        range_model: RangeErrorModel { terms, ..RangeErrorModel::error_free(7.5) },
        stations: poses.iter().enumerate().map(station).collect(),
        targets: (0..48).map(target).collect(),
        sightings: Vec::new(),
        distances: Vec::new(),
        passive: None,
    }
}

/// Near and far, convergent and rolled.
pub fn strong() -> Network {
    network(&[
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
    ])
}

/// Frontal at one distance, never rolled.
pub fn weak() -> Network {
    network(&[
        [2.6, 0.0, 0.0, 0.0],
        [2.6, 2.0, 0.0, 0.0],
        [2.6, 0.0, 2.0, 0.0],
        [2.6, -2.0, 0.0, 0.0],
        [2.6, 0.0, -2.0, 0.0],
    ])
}

/// The nominal camera for a network that was observed.
pub fn nominal(network: &mut Network) {
    network.camera.lens = LensDistortion::default();
    network.camera.interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    network.range_model = RangeErrorModel::error_free(7.5);
}

/// Terms by their names.
pub fn terms(names: &str) -> BTreeSet<String> {
    names.split(' ').map(str::to_owned).collect()
}
