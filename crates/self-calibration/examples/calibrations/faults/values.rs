//! Single values that are wrong.

use super::super::networks::INTERVAL;
use super::pick::{chosen, pair, rejected};
use super::{Expected, Fault};

pub fn all() -> Vec<Fault> {
    vec![
        Fault::new("image point off by 100 pixels", |network, pick| {
            let index = chosen(network, pick, |_| true);
            let width = network.camera.format.width as f64;
            let pixel = network.sightings[index].pixel.as_mut().unwrap();
            pixel[0] += if pixel[0] + 100.0 < width - 1.0 { 100.0 } else { -100.0 };
            if pixel[0] < 0.0 {
                pixel[0] += 200.0 - 60.0;
            }
            rejected(network, &[index])
        }),
        Fault::new("image point outside the image", |network, pick| {
            let index = chosen(network, pick, |_| true);
            network.sightings[index].pixel.as_mut().unwrap()[pick % 2] = 180.0 + pick as f64;
            Expected::OutsideImage
        }),
        Fault::new("range one interval too long", |network, pick| {
            let index = chosen(network, pick, |range| range.is_some());
            *network.sightings[index].range_m.as_mut().unwrap() += INTERVAL;
            rejected(network, &[index])
        }),
        Fault::new("range in millimetres", |network, pick| {
            let index = chosen(network, pick, |range| range.is_some());
            *network.sightings[index].range_m.as_mut().unwrap() *= 1e3;
            rejected(network, &[index])
        }),
        Fault::new("two names exchanged", |network, pick| {
            let (one, other) = pair(network, pick);
            let target = network.sightings[one].target;
            network.sightings[one].target = network.sightings[other].target;
            network.sightings[other].target = target;
            rejected(network, &[one, other])
        }),
        Fault::new("image point off by 6 pixels", |network, pick| {
            let index = chosen(network, pick + 3, |_| true);
            let pixel = network.sightings[index].pixel.as_mut().unwrap();
            pixel[pick % 2] += if pixel[pick % 2] > 70.0 { -6.0 } else { 6.0 };
            rejected(network, &[index])
        }),
        Fault::new("range off by 40 cm", |network, pick| {
            let index = chosen(network, pick + 5, |range| range.is_some());
            *network.sightings[index].range_m.as_mut().unwrap() += 0.4;
            rejected(network, &[index])
        }),
        Fault::new("a target seen under the name of another", |network, pick| {
            let index = chosen(network, pick + 7, |_| true);
            let seen = network.sightings[index];
            let of_station = |target: &usize| {
                network.sightings.iter().any(|other| other.station == seen.station && other.target == *target)
            };
            let of_others =
                |target: &usize| network.sightings.iter().filter(|other| other.target == *target).count() > 2;
            let free = (0..network.targets.len()).find(|target| !of_station(target) && of_others(target));
            // A station that sees all targets has another image point of one of them.
            match free {
                Some(target) => network.sightings[index].target = target,
                None => network.sightings[index].pixel = seen.pixel.map(|[col, row]| [(col + 60.0) % 170.0, row]),
            }
            rejected(network, &[index])
        }),
    ]
}
