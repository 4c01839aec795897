//! What is wrong with a whole table, or with the camera.

use camera_model::{euler_from_pose, pose_from_euler};
use nalgebra::Vector3;
use self_calibration::CauseKind;

use super::super::networks::INTERVAL;
use super::pick::{coprime, depths, mirrored, of_coordinates, ranges};
use super::{Expected, Fault, On};

#[allow(clippy::too_many_lines)] // A table.
pub fn all() -> Vec<Fault> {
    vec![
        Fault::new("targets of all stations in another order", |network, pick| {
            for station in 0..network.stations.len() {
                let own: Vec<usize> =
                    (0..network.sightings.len()).filter(|&i| network.sightings[i].station == station).collect();
                let targets: Vec<usize> = own.iter().map(|&index| network.sightings[index].target).collect();
                let first = pick + 5 * own.len() / 13;
                let step = (first..=first + own.len()).find(|step| coprime(*step, own.len())).unwrap_or(1);
                for (position, &index) in own.iter().enumerate() {
                    network.sightings[index].target = targets[(position * step + station) % own.len()];
                }
            }
            Expected::Unexplained
        }),
        Fault::new("all ranges in millimetres", |network, _| {
            ranges(network, |range| range * 1e3);
            Expected::Refused(vec![CauseKind::RangeUnit], None)
        }),
        Fault::new("all ranges an interval too long", |network, _| {
            ranges(network, |range| range + INTERVAL);
            Expected::Refused(vec![CauseKind::WholeIntervals], None)
        }),
        Fault::new("depths for all ranges", |network, _| {
            depths(network, |_| true);
            Expected::Refused(vec![CauseKind::DepthForRange], None)
        }),
        Fault::new("columns and rows exchanged", |network, _| {
            for seen in &mut network.sightings {
                seen.pixel.as_mut().unwrap().swap(0, 1);
            }
            let outside = network.sightings.iter().any(|seen| seen.pixel.unwrap()[1] > 144.0);
            if outside { Expected::OutsideImage } else { mirrored() }
        }),
        Fault::new("rows flipped", |network, _| {
            network
                .sightings
                .iter_mut()
                .for_each(|seen| seen.pixel.as_mut().unwrap()[1] = 143.0 - seen.pixel.unwrap()[1]);
            mirrored()
        }),
        Fault::new("columns mirrored", |network, _| {
            network
                .sightings
                .iter_mut()
                .for_each(|seen| seen.pixel.as_mut().unwrap()[0] = 175.0 - seen.pixel.unwrap()[0]);
            mirrored()
        }),
        Fault::new("x and y of the targets exchanged", |network, _| {
            for target in &mut network.targets {
                let point = target.point.as_mut().unwrap();
                (point.x, point.y) = (point.y, point.x);
            }
            // Even approximate ones tell which of two mirror images is meant.
            mirrored()
        }),
        Fault::new("targets in millimetres", |network, _| {
            for target in &mut network.targets {
                target.point.as_mut().unwrap().coords *= 1e3;
            }
            of_coordinates(network, Expected::Refused(vec![CauseKind::CoordinateUnit], None))
        }),
        Fault::new("principal distance times 1000", |network, _| {
            network.camera.interior.principal_distance_mm *= 1e3;
            Expected::Refused(vec![CauseKind::PrincipalDistanceUnit], None)
        }),
        Fault::new("pixel pitch in micrometres", |network, _| {
            network.camera.format.pixel_pitch_mm = network.camera.format.pixel_pitch_mm.map(|pitch| 1e3 * pitch);
            Expected::Refused(vec![CauseKind::PrincipalDistanceUnit], None)
        }),
        Fault::new("sigmas of image points in another unit", |network, _| {
            network.sightings.iter_mut().for_each(|seen| seen.sigma_pixel = seen.sigma_pixel.map(|sigma| 1e-3 * sigma));
            Expected::Refused(vec![CauseKind::SigmaUnit], None)
        }),
        Fault::new("sigmas of ranges in another unit", |network, _| {
            network.sightings.iter_mut().for_each(|seen| seen.sigma_range_m *= 1e-3);
            Expected::Refused(vec![CauseKind::SigmaUnit], None)
        }),
        Fault::new("radians for degrees in stations.csv", |network, _| {
            for station in &mut network.stations {
                let pose = station.world_from_camera.unwrap();
                // The number of radians, read as degrees.
                let misread = euler_from_pose(&pose).map(f64::to_radians);
                station.world_from_camera = Some(pose_from_euler(pose.translation.vector, misread));
            }
            Expected::Unharmed
        }),
        Fault::new("stations with the wrong poses", |network, _| {
            let poses: Vec<_> = network.stations.iter().map(|station| station.world_from_camera).collect();
            for (index, station) in network.stations.iter_mut().enumerate() {
                station.world_from_camera = poses[(index + 5) % poses.len()];
                station.world_from_camera.as_mut().unwrap().translation.vector += Vector3::new(0.5, 0.0, 0.0);
            }
            Expected::Unharmed
        }),
        Fault::new("all ranges in centimetres", |network, _| {
            ranges(network, |range| range * 1e2);
            Expected::Refused(vec![CauseKind::RangeUnit], None)
        }),
        Fault::new("x of the targets with the other sign", |network, _| {
            network.targets.iter_mut().for_each(|target| target.point.as_mut().unwrap().x *= -1.0);
            mirrored()
        }),
        Fault::new("ranges by another frequency, 20 for 30 MHz", |network, _| {
            ranges(network, |range| range * 20.0 / 30.0);
            Expected::Told(vec![CauseKind::ModulationFrequency], Vec::new())
        }),
        Fault::new("ranges by another frequency, 20 for 15 MHz", |network, _| {
            ranges(network, |range| range * 20.0 / 15.0);
            Expected::Told(vec![CauseKind::ModulationFrequency], Vec::new())
        }),
        Fault::new("ranges by another frequency, 20 for 22 MHz, control", |network, _| {
            ranges(network, |range| range * 20.0 / 22.0);
            Expected::Told(vec![CauseKind::ModulationFrequency], Vec::new())
        })
        .on(On::Control),
        Fault::new("modulation of another camera, 20 for 30 MHz", |network, _| {
            // With waves of 2 cm, as cameras have them.
            let wave = |range: f64| (2.0 * std::f64::consts::TAU * range / INTERVAL).sin();
            ranges(network, |range| range + 0.02 * (wave(range) + wave(2.0 * range + 1.0)));
            network.range_model.ambiguity_interval_m *= 20.0 / 30.0;
            Expected::Told(vec![CauseKind::ModulationFrequency], Vec::new())
        }),
        Fault::new("pixel pitch of another camera", |network, _| {
            network.camera.format.pixel_pitch_mm = [0.045; 2];
            Expected::Told(vec![CauseKind::PixelPitch], Vec::new())
        }),
        Fault::new("pixel pitch of the columns wrong", |network, _| {
            network.camera.format.pixel_pitch_mm = [0.042, 0.04];
            Expected::Told(vec![CauseKind::PixelPitch], Vec::new())
        }),
    ]
}
