//! Stations that are not known where they stand, or stand elsewhere than they were said to.

use nalgebra::{Isometry3, Matrix6};

use crate::survey::plausibility::some_of;
use crate::survey::records::StationPose;
use commands::{Doubt, DoubtKind};

/// Standard deviation of a position as a part of the scene's distance, and of an attitude in radian (3 degrees), from which
/// on a station is not placed: a point at that distance is uncertain by as much. Sound stations stay below a hundredth.
const UNCERTAIN: f64 = 0.05;
/// Distance from the stated position as a part of the scene's distance, where `stations.csv` states no standard deviation:
/// half of what the station sees lies elsewhere in its image.
const DISPLACED: f64 = 0.5;
/// The same for the attitude: the field of view of most cameras, half of it.
const TURNED_DEG: f64 = 30.0;
/// Stated standard deviations that a station may be off by.
const SIGMAS: f64 = 5.0;

/// A station whose pose was found.
pub struct PlacedStation<'a> {
    /// The station.
    pub name: &'a str,
    /// The pose that was found.
    pub pose: &'a StationPose,
    /// Where it was said to stand.
    pub stated: Option<Isometry3<f64>>,
    /// Standard deviations of the stated position, metre, and attitude, radian.
    pub stated_sigma: [Option<f64>; 2],
    /// Median range of what it sees, metre.
    pub distance_m: f64,
}

/// Stations of which the result itself says that it does not know where they stand.
pub fn uncertain(stations: &[PlacedStation<'_>]) -> Vec<Doubt> {
    let doubt = |station: &PlacedStation<'_>| {
        let (position_m, attitude_rad) = sigmas(station.pose.covariance.as_ref()?);
        let open = !(position_m <= UNCERTAIN * station.distance_m && attitude_rad <= UNCERTAIN);
        open.then(|| {
            let words = format!(
                "its position is known to {} and its attitude to {:.1} degrees only, of a scene {:.1} m away: the surfaces do \
                 not hold it. More overlap, or surfaces that face other ways, are needed",
                length(position_m),
                attitude_rad.to_degrees(),
                station.distance_m
            );
            Doubt::about(DoubtKind::UncertainPose, station.name, words)
        })
    };
    stations.iter().filter(|station| station.distance_m.is_finite()).filter_map(doubt).collect()
}

/// Standard deviations in space of position, metre, and attitude, radian.
fn sigmas(covariance: &Matrix6<f64>) -> (f64, f64) {
    let of = |first: usize| (0..3).map(|axis| covariance[(first + axis, first + axis)]).sum::<f64>().max(0.0).sqrt();
    (of(0), of(3))
}

/// The same for the frames of a path in one line; standard deviations in metre and degree.
pub fn uncertain_frames(frames: &[(&str, f64, f64)], distance_m: f64) -> Option<Doubt> {
    let open = |&&(_, position_m, attitude_deg): &&(&str, f64, f64)| {
        !(position_m <= UNCERTAIN * distance_m && attitude_deg.to_radians() <= UNCERTAIN)
    };
    let names: Vec<&str> = frames.iter().filter(open).map(|frame| frame.0).collect();
    let worst = frames.iter().filter(open).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let words = format!(
        "{} of {} frames ({}) are known to no better than a twentieth of the scene's distance: {} to {} and {:.1} degrees, of a \
         scene {distance_m:.1} m away. Close loops, move slower past plain walls, or have the sensor's own error calibrated",
        names.len(),
        frames.len(),
        some_of(&names),
        worst.0,
        length(worst.1),
        worst.2
    );
    Some(Doubt::new(DoubtKind::UncertainPose, words))
}

/// Stations found elsewhere than `stations.csv` says; the first is the datum and held where it was said to stand.
pub fn displaced(stations: &[PlacedStation<'_>]) -> Vec<Doubt> {
    let Some((datum, others)) = stations.split_first() else { return Vec::new() };
    let Some(datum_pose) = datum.stated else { return Vec::new() };
    let mut judged = 0_usize;
    let mut doubts = Vec::new();
    for station in others {
        let Some(stated) = station.stated.filter(|_| station.distance_m.is_finite()) else { continue };
        judged += 1;
        let found = station.pose.world_from_camera;
        // In the frame in which the datum is where it was said to stand.
        let found = datum_pose * datum.pose.world_from_camera.inverse() * found;
        let away = found.translation.vector - stated.translation.vector;
        let turned_rad = found.rotation.angle_to(&stated.rotation);
        let lever_m = (found.translation.vector - datum_pose.translation.vector).norm();
        let both = |index: usize| station.stated_sigma[index].zip(datum.stated_sigma[index]).map(|(a, b)| a.hypot(b));
        let (own_m, own_rad) = station.pose.covariance.as_ref().map_or((0.0, 0.0), sigmas);
        let datum_turn_m = datum.stated_sigma[1].map_or(0.0, |sigma| sigma * lever_m);
        let most_m = both(0).map_or(DISPLACED * station.distance_m, |s| SIGMAS * s.hypot(datum_turn_m).hypot(own_m));
        let most_rad = both(1).map_or(TURNED_DEG.to_radians(), |s| SIGMAS * s.hypot(own_rad));
        if away.norm() > most_m || turned_rad > most_rad {
            let words = format!(
                "it was found {} and {:.1} degrees from where stations.csv says, beyond {} and {:.1} degrees ({}): its frames, its \
                 row in stations.csv or its alignment are wrong",
                length(away.norm()),
                turned_rad.to_degrees(),
                length(most_m),
                most_rad.to_degrees(),
                if both(0).is_some() { "5 stated standard deviations" } else { "half of the scene's distance" }
            );
            doubts.push(Doubt::about(DoubtKind::DisplacedStation, station.name, words));
        }
    }
    // One station against all others is the one in the wrong; the datum cannot speak for itself.
    if judged > 1 && doubts.len() == judged {
        let words = format!(
            "all {judged} other stations were found away from where stations.csv says, as seen from it: its own frames or its \
             row in stations.csv are probably wrong, or positions there are not in metres"
        );
        doubts.insert(0, Doubt::about(DoubtKind::DisplacedStation, datum.name, words));
    }
    doubts
}

fn length(metres: f64) -> String {
    if metres < 0.1 { format!("{:.1} mm", 1e3 * metres) } else { format!("{metres:.2} m") }
}
