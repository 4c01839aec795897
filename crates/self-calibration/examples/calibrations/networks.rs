//! Sound networks with known truth.

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use error_models::{RangeErrorModel, RangeTerms};
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, SMatrix, Vector3};
use self_calibration::{
    Method, Network, NetworkDatum, NetworkTarget, PassiveCamera, SightingOptions, Station, simulate_sightings,
};

/// Half an interval of 20 MHz is c / (4 f); this is c / (2 f), metre.
pub const INTERVAL: f64 = 7.494_811_45;

/// A network that is sound, and how it is observed and calibrated.
pub struct Sound {
    pub name: &'static str,
    pub truth: Network,
    pub datum: NetworkDatum,
    pub method: Method,
    /// Whether terms are chosen automatically.
    pub auto: bool,
    options: SightingOptions,
}

impl Sound {
    /// Observed with these random numbers, starting from the nominal camera.
    pub fn observed(&self, seed: u64) -> Network {
        let options = SightingOptions { seed, ..self.options.clone() };
        let mut observed = simulate_sightings(&self.truth, &options).unwrap();
        observed.camera.interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: 8.0 };
        observed.camera.lens = LensDistortion::default();
        observed.range_model.terms = RangeTerms::default();
        // A twelfth of the convergent stations' ranges is left out: scattering would bias them.
        observed
    }
}

/// The networks: a target field, a nearly flat wall seen from twenty stations, and a small one with control.
pub fn sound() -> [Sound; 3] {
    [target_field(), wall(), controlled()]
}

/// Networks with control targets: all, a fifth of them, and all of the wall.
pub fn with_control() -> [Sound; 3] {
    let known = |sound: Sound, name, every: usize, sigma: f64| {
        let mut truth = sound.truth;
        let chosen = truth.targets.iter_mut().step_by(every);
        chosen.for_each(|target| target.covariance = Some(Matrix3::identity() * sigma.powi(2)));
        Sound { name, truth, datum: NetworkDatum::Control, ..sound }
    };
    [controlled(), known(target_field(), "some control", 5, 0.001), known(wall(), "wall, control", 1, 0.0005)]
}

/// Networks with stations whose poses are known.
pub fn with_stations() -> [Sound; 3] {
    let known = |sound: Sound, name, position: f64, attitude: f64| {
        let mut truth = sound.truth;
        let variances = [position, position, position, attitude, attitude, attitude].map(|sigma| sigma * sigma);
        let covariance = Matrix6::from_diagonal(&variances.into());
        truth.stations.iter_mut().for_each(|station| station.covariance = Some(covariance));
        truth.targets.iter_mut().for_each(|target| target.covariance = None);
        Sound { name, truth, datum: NetworkDatum::Control, ..sound }
    };
    [
        known(controlled(), "stations", 0.003, 1e-3),
        known(target_field(), "stations, field", 0.005, 2e-3),
        known(wall(), "stations, wall", 0.003, 2e-3),
    ]
}

/// The other methods, and automatic terms.
pub fn by_method() -> [Sound; 6] {
    let by = |sound: Sound, name, method| Sound { name, method, ..sound };
    let auto = |sound: Sound, name| Sound { name, auto: true, ..sound };
    [
        by(target_field(), "dependent", Method::TwoStepDependent),
        by(controlled(), "dep., control", Method::TwoStepDependent),
        by(with_passive(target_field()), "joint", Method::JointIntegrated),
        by(with_passive(controlled()), "joint 2 steps", Method::JointTwoStep),
        auto(target_field(), "field, auto"),
        auto(controlled(), "control, auto"),
    ]
}

/// With a passive camera of 1600 x 1200 pixels beside the range camera; 40 degrees of field.
fn with_passive(mut sound: Sound) -> Sound {
    let format = ImageFormat::new(1600, 1200, [0.005, 0.005]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.02, 0.01], principal_distance_mm: 9.0 };
    let camera = Camera::new(format, interior, LensDistortion { k1: 2e-4, ..LensDistortion::default() }).unwrap();
    let sigmas = [2e-3, 2e-3, 2e-3, 2e-6, 2e-7, 2e-9, 1e-6, 1e-6, 3e-4, 3e-4_f64];
    let covariance = SMatrix::<f64, 10, 10>::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into());
    let relative = Isometry3::new(Vector3::new(0.08, 0.01, -0.02), Vector3::new(0.01, -0.03, 0.02));
    sound.truth.passive = Some(PassiveCamera {
        camera,
        covariance: Some(covariance),
        range_camera_from_passive: Some(relative),
        image_points: Vec::new(),
    });
    sound
}

fn camera() -> Camera {
    Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(),
        InteriorOrientation { principal_point_mm: [0.06, -0.04], principal_distance_mm: 8.02 },
        LensDistortion { k1: -1.5e-3, k2: 2e-5, k3: 0.0, p1: 1e-4, p2: -8e-5, ..LensDistortion::default() },
    )
    .unwrap()
}

/// A pose at a distance (metre) from the middle of the field, off its normal by two angles, and rolled (degrees).
fn looking(distance: f64, aside: f64, above: f64, roll: f64) -> Isometry3<f64> {
    let turn = pose_from_euler(Vector3::zeros(), [above, aside, roll].map(f64::to_radians));
    Isometry3::from_parts((turn * Vector3::new(0.0, 0.0, distance)).into(), turn.rotation)
}

fn field(columns: usize, rows: usize, spacing: f64, relief: f64) -> Vec<NetworkTarget> {
    let place = |index: usize| {
        let (row, col) = (index / columns, index % columns);
        let x = (col as f64 - 0.5 * (columns as f64 - 1.0)) * spacing;
        let y = (row as f64 - 0.5 * (rows as f64 - 1.0)) * spacing;
        Point3::new(x, y, if (row + col) % 3 == 0 { relief } else { 0.0 })
    };
    let target = |index| NetworkTarget { name: format!("T{index:03}"), point: Some(place(index)), covariance: None };
    (0..columns * rows).map(target).collect()
}

fn network(poses: Vec<Isometry3<f64>>, targets: Vec<NetworkTarget>) -> Network {
    let terms = RangeTerms { d0: 0.024, periodic: [0.0, 0.0, 0.003, 0.005, -0.009, 0.004], e1: 1.5e-3, e2: -1e-3 };
    let station = |(index, pose)| Station {
        name: format!("S{index:02}"),
        world_from_camera: Some(pose),
        covariance: None,
        integration_time_s: None,
        drift_m: 0.0,
    };
    Network {
        camera: camera(),
        range_model: RangeErrorModel { terms, ..RangeErrorModel::error_free(INTERVAL) },
        stations: poses.into_iter().enumerate().map(station).collect(),
        targets,
        sightings: Vec::new(),
        distances: Vec::new(),
        passive: None,
    }
}

fn one_step(name: &'static str, truth: Network, datum: NetworkDatum, options: SightingOptions) -> Sound {
    Sound { name, truth, datum, method: Method::OneStep, auto: false, options }
}

/// Fourteen stations before 63 targets, every third on a post of 25 cm.
fn target_field() -> Sound {
    let rolls = [0.0, 90.0, 180.0, 270.0];
    let frontal = [1.2, 1.6, 2.1, 2.6, 3.1, 3.6, 4.2, 4.0].into_iter().enumerate();
    let mut poses: Vec<_> = frontal.map(|(i, distance)| looking(distance, 0.0, 0.0, rolls[i % 4])).collect();
    let around = [(35.0, 0.0), (-35.0, 0.0), (0.0, 35.0), (0.0, -35.0), (28.0, 24.0), (-28.0, -24.0)];
    poses.extend(
        around
            .into_iter()
            .enumerate()
            .map(|(i, (aside, above))| looking(2.4 + 0.16 * i as f64, aside, above, rolls[i % 4])),
    );
    let truth = network(poses, field(9, 7, 0.3, 0.25));
    one_step("target field", truth, NetworkDatum::Free, SightingOptions::default())
}

/// Twenty stations before 163 targets on a wall with a relief of 4 cm: six frontal ones with ranges, two of them rolled
/// more, twelve convergent ones without.
fn wall() -> Sound {
    let mut poses: Vec<_> =
        (0..6).map(|i| looking(1.0 + 0.52 * f64::from(i), 0.0, 0.0, 90.0 * f64::from(i % 4))).collect();
    poses.extend([looking(2.0, 0.0, 0.0, 45.0), looking(2.8, 5.0, 0.0, 135.0)]);
    for index in 0..12 {
        let around = f64::from(index) * 30.0_f64.to_radians();
        poses.push(looking(
            1.9 + 0.1 * f64::from(index),
            35.0 * around.cos(),
            35.0 * around.sin(),
            90.0 * f64::from(index % 4),
        ));
    }
    let mut targets = field(15, 11, 0.2, 0.04);
    targets.truncate(163);
    let mut truth = network(poses, targets);
    // The plan of sightings: ranges of the first six only.
    let mut planned = simulate_sightings(&truth, &SightingOptions::default()).unwrap().sightings;
    planned.iter_mut().filter(|seen| seen.station >= 6).for_each(|seen| seen.range_m = None);
    let seen: Vec<usize> = planned.iter().map(|sighting| sighting.target).collect();
    planned.retain(|sighting| seen.iter().filter(|target| **target == sighting.target).count() > 2);
    truth.sightings = planned;
    let options = SightingOptions { sigma_pixel: 0.07, sigma_range_m: 0.006, ..SightingOptions::default() };
    one_step("wall", truth, NetworkDatum::Free, options)
}

/// Ten stations before 48 targets known to half a millimetre.
fn controlled() -> Sound {
    let mut poses = vec![looking(1.5, 0.0, 0.0, 0.0), looking(2.3, 0.0, 0.0, 90.0), looking(3.2, 3.0, 0.0, 0.0)];
    poses.extend([looking(4.1, 0.0, 3.0, 180.0), looking(2.8, -3.0, 0.0, 270.0)]);
    poses.extend([(35.0, 0.0), (-35.0, 0.0), (0.0, 35.0), (0.0, -35.0)].map(|(a, b)| looking(2.6, a, b, a + 90.0)));
    poses.push(looking(3.6, 30.0, 20.0, 0.0));
    let mut truth = network(poses, field(8, 6, 0.3, 0.25));
    for target in &mut truth.targets {
        target.covariance = Some(Matrix3::identity() * 0.0005_f64.powi(2));
    }
    one_step("control", truth, NetworkDatum::Control, SightingOptions::default())
}
