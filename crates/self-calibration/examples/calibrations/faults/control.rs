//! Known targets and stations that are not where they are said to be.

use camera_model::{euler_from_pose, pose_from_euler, step_pose};
use nalgebra::Vector3;
use self_calibration::{CauseKind, Network};

use super::{Expected, Fault, On};

pub fn all() -> Vec<Fault> {
    vec![
        Fault::new("control point 30 mm off", |network, pick| moved(network, pick, 0.03)).on(On::Control),
        Fault::new("control point 1 m off", |network, pick| moved(network, pick + 1, 1.0)).on(On::Control),
        Fault::new("control point 12 sigma off", |network, pick| {
            let sigma = network.targets.iter().find_map(|target| Some(target.covariance?[(0, 0)].sqrt())).unwrap();
            moved(network, pick + 2, 12.0 * sigma)
        })
        .on(On::Control),
        Fault::new("two control points exchanged", |network, pick| {
            let all = control(network);
            let (one, other) = (all[pick % all.len()], all[(pick + all.len() / 2) % all.len()]);
            let point = network.targets[one].point;
            network.targets[one].point = network.targets[other].point;
            network.targets[other].point = point;
            Expected::Control(vec![network.targets[one].name.clone(), network.targets[other].name.clone()])
        })
        .on(On::Control),
        Fault::new("deviations of the control in another unit", |network, _| {
            for target in &mut network.targets {
                target.covariance = target.covariance.map(|covariance| covariance * 1e6);
            }
            Expected::Told(vec![CauseKind::SigmaUnit], Vec::new())
        })
        .on(On::Control),
        Fault::new("station 10 cm off", |network, pick| {
            let station = pick % network.stations.len();
            let pose = network.stations[station].world_from_camera.as_mut().unwrap();
            pose.translation.vector += Vector3::new(0.06, -0.06, 0.05);
            Expected::Control(vec![network.stations[station].name.clone()])
        })
        .on(On::Stations),
        Fault::new("station turned by 3 degrees", |network, pick| {
            let station = (pick + 1) % network.stations.len();
            let pose = network.stations[station].world_from_camera.as_mut().unwrap();
            *pose = step_pose(pose, &[0.0, 0.0, 0.0, 0.0, 0.05, 0.0]);
            Expected::Control(vec![network.stations[station].name.clone()])
        })
        .on(On::Stations),
        Fault::new("two stations exchanged", |network, pick| {
            let count = network.stations.len();
            let (one, other) = (pick % count, (pick + 3) % count);
            let pose = network.stations[one].world_from_camera;
            network.stations[one].world_from_camera = network.stations[other].world_from_camera;
            network.stations[other].world_from_camera = pose;
            Expected::Control(vec![network.stations[one].name.clone(), network.stations[other].name.clone()])
        })
        .on(On::Stations),
        Fault::new("radians for degrees of known stations", |network, _| {
            for station in &mut network.stations {
                let pose = station.world_from_camera.unwrap();
                let misread = euler_from_pose(&pose).map(f64::to_radians);
                station.world_from_camera = Some(pose_from_euler(pose.translation.vector, misread));
            }
            Expected::Told(vec![CauseKind::AngleUnit], Vec::new())
        })
        .on(On::Stations),
    ]
}

fn control(network: &Network) -> Vec<usize> {
    // One that few stations see shows little.
    let seen = |target: usize| network.sightings.iter().filter(|seen| seen.target == target).count() >= 5;
    let all = network.targets.iter().enumerate().filter(|(_, target)| target.covariance.is_some());
    all.map(|(index, _)| index).filter(|&index| seen(index)).collect()
}

fn moved(network: &mut Network, pick: usize, by_m: f64) -> Expected {
    let all = control(network);
    let target = &mut network.targets[all[(pick * 31 + 7) % all.len()]];
    let [x, y, z] = [[0.6, 0.8, 0.0], [0.0, 0.6, -0.8], [-0.8, 0.0, 0.6]][pick % 3];
    *target.point.as_mut().unwrap() += by_m * Vector3::new(x, y, z);
    Expected::Control(vec![target.name.clone()])
}
