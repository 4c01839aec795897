//! Small networks with known truth.

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use error_models::{RangeErrorModel, RangeTerms};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use self_calibration::{DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, Station};

use super::INTERVAL;

/// A camera of 176 x 144 pixels of 0.04 mm behind a lens of 8 mm.
pub fn camera() -> Camera {
    Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(),
        InteriorOrientation { principal_point_mm: [0.06, -0.04], principal_distance_mm: 8.02 },
        LensDistortion { k1: -1.5e-3, k2: 2e-5, k3: 0.0, p1: 1e-4, p2: -8e-5, ..LensDistortion::default() },
    )
    .unwrap()
}

/// Offset, short waves and delay; no wave of length U, which a network can hardly tell from the offset.
pub fn range_model() -> RangeErrorModel {
    let terms = RangeTerms { d0: 0.024, periodic: [0.0, 0.0, 0.003, 0.005, -0.009, 0.004], e1: 1.5e-3, e2: -1e-3 };
    RangeErrorModel { terms, ..RangeErrorModel::error_free(INTERVAL) }
}

/// A pose at a distance (m) from the middle of the field, off its normal by two angles, and rolled (degrees).
pub fn looking(distance: f64, aside: f64, above: f64, roll: f64) -> Isometry3<f64> {
    // The camera looks along -z of its own, the field lies in the plane z = 0 and is seen from z > 0.
    let turn = pose_from_euler(Vector3::zeros(), [above, aside, roll].map(f64::to_radians));
    Isometry3::from_parts((turn * Vector3::new(0.0, 0.0, distance)).into(), turn.rotation)
}

/// Targets on a wall, every third of them standing off it.
pub fn field(columns: usize, rows: usize, spacing: f64) -> Vec<NetworkTarget> {
    let mut targets = Vec::new();
    for row in 0..rows {
        for col in 0..columns {
            let x = (col as f64 - 0.5 * (columns as f64 - 1.0)) * spacing;
            let y = (row as f64 - 0.5 * (rows as f64 - 1.0)) * spacing;
            let z = if (row + col) % 3 == 0 { 0.25 } else { 0.0 };
            let name = format!("T{:02}", targets.len());
            targets.push(NetworkTarget { name, point: Some(Point3::new(x, y, z)), covariance: None });
        }
    }
    targets
}

fn network(poses: Vec<Isometry3<f64>>, targets: Vec<NetworkTarget>) -> Network {
    let station = |(index, pose)| Station {
        name: format!("S{index:02}"),
        world_from_camera: Some(pose),
        covariance: None,
        integration_time_s: None,
        drift_m: 0.0,
    };
    Network {
        camera: camera(),
        range_model: range_model(),
        stations: poses.into_iter().enumerate().map(station).collect(),
        targets,
        sightings: Vec::new(),
        distances: Vec::new(),
        passive: None,
    }
}

/// Ten stations over 48 targets: quick to solve.
pub fn small() -> Network {
    let mut poses = vec![looking(1.5, 0.0, 0.0, 0.0), looking(2.3, 0.0, 0.0, 90.0), looking(3.2, 3.0, 0.0, 0.0)];
    poses.extend([looking(4.1, 0.0, 3.0, 180.0), looking(2.8, -3.0, 0.0, 270.0)]);
    poses.extend([(35.0, 0.0), (-35.0, 0.0), (0.0, 35.0), (0.0, -35.0)].map(|(a, b)| looking(2.6, a, b, a + 90.0)));
    poses.push(looking(3.6, 30.0, 20.0, 0.0));
    network(poses, field(8, 6, 0.3))
}

/// The normal network: 24 stations, frontal at 1.5 m to 4 m and convergent, half of them rolled, 103 targets.
pub fn normal() -> Network {
    let mut poses: Vec<_> =
        (0..12).map(|i| looking(1.5 + 2.5 * f64::from(i) / 11.0, 0.0, 0.0, 90.0 * f64::from(i % 4))).collect();
    for index in 0..12 {
        let around = f64::from(index) * 30.0_f64.to_radians();
        let (aside, above) = (35.0 * around.cos(), 35.0 * around.sin());
        poses.push(looking(2.2 + 0.1 * f64::from(index), aside, above, 90.0 * f64::from(index % 4)));
    }
    let mut targets = field(13, 8, 0.25);
    targets.pop();
    network(poses, targets)
}

/// Twelve frontal stations at one distance over a plane.
pub fn weak() -> Network {
    let mut poses = Vec::new();
    for row in 0..3 {
        for col in 0..4 {
            let mut pose = looking(2.5, 0.0, 0.0, 0.0);
            pose.translation.vector += Vector3::new(0.2 * f64::from(col) - 0.3, 0.2 * f64::from(row) - 0.2, 0.0);
            poses.push(pose);
        }
    }
    let mut targets = field(13, 8, 0.25);
    for target in &mut targets {
        target.point.as_mut().unwrap().z = 0.0;
    }
    network(poses, targets)
}

/// All terms but those of the wave of length U.
pub fn all_but_long_wave() -> Vec<String> {
    "xp yp c k1 k2 k3 p1 p2 d0 d4 d5 d6 d7 e1 e2".split(' ').map(str::to_owned).collect()
}

/// The nominal calibration, as one starts from it.
pub fn nominal(observed: &mut Network) {
    observed.camera.interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    observed.camera.lens = LensDistortion::default();
    observed.range_model.terms = RangeTerms::default();
}

/// The network with a passive camera of 1600 x 1200 pixels beside the range camera; 40 degrees of field.
pub fn with_passive(mut network: Network) -> Network {
    let format = ImageFormat::new(1600, 1200, [0.005, 0.005]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.02, 0.01], principal_distance_mm: 9.0 };
    let camera = Camera::new(format, interior, LensDistortion { k1: 2e-4, ..LensDistortion::default() }).unwrap();
    let sigmas = [2e-3, 2e-3, 2e-3, 2e-6, 2e-7, 2e-9, 1e-6, 1e-6, 3e-4, 3e-4_f64];
    let covariance = nalgebra::SMatrix::<f64, 10, 10>::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into());
    let relative = Isometry3::new(Vector3::new(0.08, 0.01, -0.02), Vector3::new(0.01, -0.03, 0.02));
    network.passive = Some(PassiveCamera {
        camera,
        covariance: Some(covariance),
        range_camera_from_passive: Some(relative),
        image_points: Vec::new(),
    });
    network
}

/// The network with its targets known to half a millimetre.
pub fn with_control(mut network: Network) -> Network {
    for target in &mut network.targets {
        target.covariance = Some(Matrix3::identity() * 0.0005_f64.powi(2));
    }
    network
}

/// The network with two scale bars of 0.5 mm.
pub fn with_scale_bars(mut network: Network) -> Network {
    let last = network.targets.len() - 1;
    for (from, to) in [(0, last), (7, last - 7)] {
        let (from, to) = (DistanceEnd::Target(from), DistanceEnd::Target(to));
        network.distances.push(KnownDistance { from, to, distance_m: 1.0, sigma_m: 0.0005 });
    }
    network
}

/// A track: one target seen at 40 distances over an ambiguity interval, each known to a millimetre, over the whole image.
pub fn track_network() -> Network {
    let mut poses = Vec::new();
    let mut distances = Vec::new();
    for station in 0..60 {
        let distance = 0.6 + 0.085 * f64::from(station);
        let aside = [0.0, 0.3, -0.3][station as usize % 3] * distance;
        let above = [0.0, 0.25, -0.25, 0.1][station as usize % 4] * distance;
        poses.push(Isometry3::translation(aside, above, distance));
        let ends = [DistanceEnd::Station(station as usize), DistanceEnd::Target(0)];
        distances.push(KnownDistance { from: ends[0], to: ends[1], distance_m: 1.0, sigma_m: 0.001 });
    }
    let target = NetworkTarget { name: "T00".to_owned(), point: Some(Point3::origin()), covariance: None };
    Network { distances, ..network(poses, vec![target]) }
}

/// Frontal stations from 1 m to 8 m, beyond the ambiguity interval, so that offset, periodic terms and scale are told
/// apart; eight convergent ones for the lens.
pub fn deep() -> Network {
    let distances = [1.0, 1.3, 1.7, 2.1, 2.6, 3.1, 3.7, 4.3, 5.0, 5.7, 6.4, 7.1, 7.8];
    let mut poses: Vec<_> =
        distances.iter().zip(0..).map(|(d, i)| looking(*d, 0.0, 0.0, f64::from(i % 4) * 90.0)).collect();
    for index in 0..8 {
        let around = f64::from(index) * 45.0_f64.to_radians();
        let (aside, above) = (35.0 * around.cos(), 35.0 * around.sin());
        poses.push(looking(2.4 + 0.2 * f64::from(index), aside, above, 90.0 * f64::from(index % 4)));
    }
    network(poses, field(6, 5, 0.35))
}
