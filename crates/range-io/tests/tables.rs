//! Tables: round trips, `EuRoC` data, and faults with their place.
#![cfg(feature = "tables")]
// What goes through a file comes back to the last bit.

use crate::common;
use std::path::PathBuf;

use camera_model::pose_from_euler;
use nalgebra::Vector3;
use proptest::prelude::*;
use range_io::tables::{
    Distance, ImuSample, ObservedPlane, Residual, Station, Target, TargetObservation, read_distances, read_imu,
    read_imu_sensor, read_observations, read_placed_targets, read_planes, read_residuals, read_stations, read_targets,
    write_distances, write_imu, write_observations, write_planes, write_residuals, write_stations, write_targets,
};

struct Scratch(tempfile::TempDir);

impl Scratch {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn with(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.file(name), text).unwrap();
        self.file(name)
    }
}

/// The message without the folder.
fn message<T: std::fmt::Debug>(result: Result<T, range_io::Error>) -> String {
    let text = result.unwrap_err().to_string();
    text.rsplit_once('/').map(|(_, text)| text.to_owned()).unwrap_or(text)
}

fn name() -> impl Strategy<Value = String> {
    // Commas, quotes and letters beyond ASCII are a CSV writer's business; blanks at the ends are not kept.
    "[A-Za-z0-9,\"'é]([ -~]{0,8}[A-Za-z0-9,\"é])?"
}

fn sigmas() -> impl Strategy<Value = Option<[f64; 3]>> {
    prop::option::of(prop::array::uniform3(1e-9..1e3_f64))
}

proptest! {
    #![proptest_config(common::cases(48))]

    #[test]
    fn observations_come_back(
        station in name(), target in name(), pixel in prop::option::of(prop::array::uniform2(-1e4..1e4_f64)),
        range_m in 1e-6..1e3_f64, sigma_pixel in prop::option::of(prop::array::uniform2(1e-9..1e3_f64)),
        sigma_range_m in prop::option::of(1e-9..1.0_f64), amplitude in prop::option::of(-1e4..1e4_f64),
        integration_time_s in prop::option::of(1e-6..1.0_f64),
    ) {
        let scratch = Scratch::new();
        let first = TargetObservation {
            station, target, pixel, range_m: Some(range_m), sigma_pixel, sigma_range_m, amplitude, integration_time_s,
        };
        let second = TargetObservation { pixel: Some([1.0, 2.0]), range_m: None, ..first.clone() };
        let observations = [first, second];
        write_observations(scratch.file("o.csv"), &observations).unwrap();
        prop_assert_eq!(read_observations(scratch.file("o.csv")).unwrap(), observations);
    }

    #[test]
    fn targets_come_back(names in prop::collection::btree_set(name(), 0..6), position_m in prop::array::uniform3(-1e3..1e3_f64), sigma_m in sigmas()) {
        let scratch = Scratch::new();
        let targets: Vec<_> = names.into_iter().map(|target| Target { target, position_m, sigma_m }).collect();
        write_targets(scratch.file("t.csv"), &targets).unwrap();
        prop_assert_eq!(read_targets(scratch.file("t.csv")).unwrap(), targets);
    }

    #[test]
    fn stations_come_back(
        position in prop::array::uniform3(-1e3..1e3_f64), angles in prop::array::uniform3(-3.2..3.2_f64),
        sigma_position_m in sigmas(), sigma_attitude_rad in sigmas(), doubt in prop::option::of("[ -~]{0,20}[a-z]"),
    ) {
        let scratch = Scratch::new();
        let world_from_camera = pose_from_euler(Vector3::from(position), angles);
        let doubt = doubt.map(|words| words.trim().to_owned());
        let station = Station { station: "S, 1".into(), world_from_camera, sigma_position_m, sigma_attitude_rad, doubt };
        let plain = Station {
            station: "S2".into(), world_from_camera, ..Station::default()
        };
        write_stations(scratch.file("s.csv"), &[station.clone(), plain]).unwrap();
        let back = read_stations(scratch.file("s.csv")).unwrap();
        prop_assert_eq!(back[0].world_from_camera.translation, station.world_from_camera.translation);
        // Near phi = 90 degrees Euler angles carry the attitude to the root of the rounding only.
        let turn = back[0].world_from_camera.rotation.angle_to(&station.world_from_camera.rotation);
        prop_assert!(turn < 1e-7, "{}", turn);
        prop_assert_eq!(back[0].sigma_position_m, station.sigma_position_m);
        for (found, expected) in back[0].sigma_attitude_rad.iter().flatten().zip(station.sigma_attitude_rad.iter().flatten()) {
            // Degrees and back: two roundings.
            prop_assert!((found / expected - 1.0).abs() < 4.0 * f64::EPSILON);
        }
        prop_assert_eq!(back[0].sigma_attitude_rad.is_some(), station.sigma_attitude_rad.is_some());
        prop_assert_eq!(back[1].sigma_position_m, None);
        prop_assert_eq!(&back[0].doubt, &station.doubt);
        prop_assert_eq!(&back[1].doubt, &None);
    }

    #[test]
    fn inertial_samples_come_back(steps in prop::collection::vec(1e-6..1.0_f64, 0..10), rate in prop::array::uniform3(-10.0..10.0_f64)) {
        let scratch = Scratch::new();
        let mut timestamp_s = 1e9;
        let samples: Vec<_> = steps.iter().map(|step| {
            timestamp_s += step;
            ImuSample { timestamp_s, angular_rate: rate, acceleration: [0.1, 9.8, rate[0]] }
        }).collect();
        // Steps below the resolution of a double at 1e9 s do not ascend and are refused; the next test has that.
        if write_imu(scratch.file("i.csv"), &samples).is_ok() {
            prop_assert_eq!(read_imu(scratch.file("i.csv")).unwrap(), samples);
        }
    }
}

#[test]
fn angles_are_degrees_of_the_object_to_camera_rotation() {
    let scratch = Scratch::new();
    let file = scratch.with("stations.csv", "kappa,phi,omega,station,x,y,z\n0,0,90, S1 ,1,2,3\n");
    let station = read_stations(file).unwrap().remove(0);
    assert_eq!((station.station.as_str(), station.sigma_position_m), ("S1", None));
    // R1(90 deg) of conventions.md maps the object's y axis to the camera's -z, so the camera looks along +y.
    let looks = station.world_from_camera.rotation * Vector3::new(0.0, 0.0, -1.0);
    assert!((looks - Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-15, "{looks}");
}

#[test]
fn faults_name_file_line_column_and_name() {
    let scratch = Scratch::new();
    let observations = |text: &str| message(read_observations(scratch.with("observations.csv", text)));
    let header = "station,target,col,row,range,sigma_col,sigma_row,sigma_range\n";
    let with = |row: &str| observations(&format!("{header}{row}\n"));
    assert_eq!(with("S,T,a,1,,,,"), "observations.csv:2:3: `col`: is `a`, expected a finite number");
    assert_eq!(with("S,T,1,inf,,,,"), "observations.csv:2:4: `row`: is `inf`, expected a finite number");
    assert_eq!(with("S,T,1,,,,,"), "observations.csv:2:4: `row`: is empty, expected all or none of col, row");
    assert_eq!(with("S,T,,,-1,,,"), "observations.csv:2:5: `range`: is -1, expected a positive number");
    assert_eq!(with("S,T,1,2,3,0,1,1"), "observations.csv:2:6: `sigma_col`: is 0, expected a positive number");
    assert_eq!(with("S,,1,2,3,1,1,1"), "observations.csv:2:2: `target`: is empty, expected a name");
    assert!(with("S,T,,,,,,").contains("observes nothing"));
    assert_eq!(with("S,T,1,2,3,1,1"), "observations.csv:2:8: the row has 7 fields, expected 8");
    assert_eq!(with("\nS,T,1,2,3,1,1,1,1"), "observations.csv:3:9: the row has 9 fields, expected 8");
    assert!(observations("").contains("is empty, expected a header row with station,target,col"));
    assert!(observations("station,target\n").contains("observations.csv:1:3: `col`: is missing in the header row"));
    assert!(observations("station,station\n").contains(":1:2: `station`: is given twice"));
    assert!(observations("station;target\n").contains(":1:1: `station;target`: is no column of this table, expected"));
    let twice = "target,x,y,z,sigma_x,sigma_y,sigma_z\nA,1,2,3,,,\nB,1,2,3,,,\nA,1,2,3,,,\n";
    assert_eq!(
        message(read_targets(scratch.with("targets.csv", twice))),
        "targets.csv:4:1: `target`: is given twice, first in line 2"
    );
    let part = "target,x,y,z,sigma_x,sigma_y,sigma_z\nA,1,2,3,1,,1\n";
    assert!(message(read_targets(scratch.with("targets.csv", part))).contains("expected all or none of sigma_x"));
    assert!(read_targets(scratch.file("absent.csv")).unwrap_err().to_string().contains("cannot open"));
    assert!(write_observations(scratch.file("o.csv"), &[TargetObservation::default()]).is_err());
}

#[test]
fn files_of_spreadsheets_are_read() {
    let scratch = Scratch::new();
    let text = "\u{feff}target,x,y,z,sigma_x,sigma_y,sigma_z\r\n\"A, left\", 1 ,2e-1,-3,,,\r\n";
    let targets = read_targets(scratch.with("t.csv", text)).unwrap();
    assert_eq!(targets, [Target { target: "A, left".into(), position_m: [1.0, 0.2, -3.0], sigma_m: None }]);
}

#[test]
fn euroc_folders_are_read_as_they_are() {
    let scratch = Scratch::new();
    std::fs::create_dir_all(scratch.file("mav0/imu0")).unwrap();
    let text = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],\
                a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n\
                1403636579758555392,-0.1,0.15,0.08,8.1,-0.4,-2.4\n1403636579763555584,-0.1,0.14,0.09,8.2,-0.3,-2.5\n";
    scratch.with("mav0/imu0/data.csv", text);
    for folder in ["", "mav0", "mav0/imu0"] {
        let samples = read_imu(scratch.file(folder)).unwrap();
        assert_eq!(samples.len(), 2);
        // A double carries seconds since 1970 to about 0.2 microseconds.
        assert!((samples[0].timestamp_s - 1_403_636_579.758_555_4).abs() < 3e-7);
        assert_eq!((samples[1].angular_rate, samples[1].acceleration), ([-0.1, 0.14, 0.09], [8.2, -0.3, -2.5]));
    }
    let yaml = "# Default imu sensor yaml file\nsensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.1,\n         \
                1.0, 0.0, 0.0, 0.2,\n 0.0, 0.0, 1.0, 0.3,\n 0.0, 0.0, 0.0, 1.0]\nrate_hz: 200\n\
                gyroscope_noise_density: 1.6968e-04 # [ rad / s / sqrt(Hz) ]\ngyroscope_random_walk: 1.9393e-05\n\
                accelerometer_noise_density: 2.0000e-3\naccelerometer_random_walk: 3.0000e-3\n";
    scratch.with("mav0/imu0/sensor.yaml", yaml);
    let sensor = read_imu_sensor(scratch.file("mav0")).unwrap();
    assert_eq!((sensor.gyro_density, sensor.gyro_walk), (1.6968e-4, 1.9393e-5));
    assert_eq!((sensor.accel_density, sensor.accel_walk), (2e-3, 3e-3));
    assert_eq!(sensor.body_from_sensor[1], [1.0, 0.0, 0.0, 0.2]);
    for (from, to, fault) in [
        ("1.9393e-05", "fast", "sensor.yaml:12:1: `gyroscope_random_walk`: is `fast`, expected a positive number"),
        ("gyroscope_random_walk", "walk", "sensor.yaml:1:1: `gyroscope_random_walk`: is missing"),
        ("0.0, -1.0, 0.0", "0.0, 1.0, 0.0", "sensor.yaml:3:1: `T_BS`: expected a rotation that is not mirrored"),
        (", 0.1,", ",", "sensor.yaml:3:1: `T_BS`: expected the sixteen numbers of a 4 x 4 matrix"),
    ] {
        let said = message(read_imu_sensor(scratch.with("sensor.yaml", &yaml.replace(from, to))));
        assert!(said.starts_with(fault), "{said}");
    }
    let reversed = "timestamp_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n2,0,0,0,0,0,0\n1,0,0,0,0,0,0\n";
    let fault = message(read_imu(scratch.with("imu.csv", reversed)));
    assert_eq!(fault, "imu.csv:3:1: `timestamp_s`: is 1 s, expected more than the 2 s before it");
    let twice = [ImuSample::default(); 2];
    assert!(write_imu(scratch.file("imu.csv"), &twice).is_err());
}

#[test]
fn distances_planes_and_residuals_come_back() {
    let scratch = Scratch::new();
    let distances = [Distance { from: "T1".into(), to: "S1".into(), distance_m: 1.234_567_89, sigma_m: 5e-4 }];
    write_distances(scratch.file("distances.csv"), &distances).unwrap();
    assert_eq!(read_distances(scratch.file("distances.csv")).unwrap(), distances);
    let plane = |known| ObservedPlane { plane: "wall".into(), station: "S1".into(), known };
    let planes = [plane(Some(([0.1, -0.2, 0.3], -1.5))), plane(None)];
    write_planes(scratch.file("planes.csv"), &planes).unwrap();
    assert_eq!(read_planes(scratch.file("planes.csv")).unwrap(), planes);
    let residual = Residual {
        station: "S1".into(),
        target: "T1".into(),
        component: "range".into(),
        observed: Some(2.5),
        sigma: Some(0.01),
        residual: Some(-0.003),
        redundancy_number: Some(f64::NAN),
        standardised_residual: None,
        smallest_detectable: Some(f64::INFINITY),
        verdict: "uncontrolled".into(),
    };
    let control = Residual { station: String::new(), component: "control".into(), ..residual.clone() };
    write_residuals(scratch.file("residuals.csv"), &[residual, control]).unwrap();
    // What is no number is an empty field, and control has no station.
    let [residual, control] = read_residuals(scratch.file("residuals.csv")).unwrap().try_into().unwrap();
    assert_eq!(residual, Residual { redundancy_number: None, smallest_detectable: None, ..residual.clone() });
    assert_eq!((residual.station.as_str(), residual.residual), ("S1", Some(-0.003)));
    assert_eq!((control.station.as_str(), control.target.as_str()), ("", "T1"));
}

#[test]
fn faults_of_distances_and_planes_are_named() {
    let scratch = Scratch::new();
    let distance = |row: &str| {
        let text = format!("from,to,distance,sigma_distance\n{row}\n");
        message(read_distances(scratch.with("distances.csv", &text)))
    };
    assert_eq!(distance("A,A,1,0.001"), "distances.csv:2:2: `to`: is `A` like `from`, expected another end");
    assert_eq!(distance("A,B,1,"), "distances.csv:2:4: `sigma_distance`: is empty, expected a positive number");
    assert_eq!(distance("A,B,-1,1"), "distances.csv:2:3: `distance`: is -1, expected a positive number");
    let plane = scratch.with("planes.csv", "plane,station,nx,ny,nz,d\nP,S,0,0,0,1\n");
    assert_eq!(message(read_planes(plane)), "planes.csv:2:3: `nx`: is 0 like `ny` and `nz`, expected a direction");
}

#[test]
fn rows_keep_their_places() {
    let scratch = Scratch::new();
    let file = scratch.with("targets.csv", "target,z,y,x,sigma_x,sigma_y,sigma_z\n\nA,1,2,3,,,\nB,1,2,3,,,\n");
    let rows = read_placed_targets(&file).unwrap();
    assert_eq!((rows.rows.len(), rows.line(0), rows.line(1), rows.line(2)), (2, 3, 4, 0));
    let error: Result<(), range_io::Error> = Err(rows.error(1, "x", "is far away"));
    assert_eq!(message(error), "targets.csv:4:4: `x`: is far away", "the column is that of the file");
}
