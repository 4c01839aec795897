//! What a result shows that no sound survey does.

use range_image::Flags;

use commands::{Doubt, DoubtKind};

use crate::survey::open::StatedPoses;
use crate::survey::plausibility::{PlacedStation, displaced, uncertain};
use crate::survey::records::{StationPose, ViewRecord};
use crate::survey::view::{View, ViewData};

/// Part of a station's pixels with a flag from which on it shows too little to be trusted as a whole.
const MOST_FLAGGED: f64 = 0.8;

/// Doubts about views, points and poses, once all stages ran; `poses`: those that were found.
pub fn of_views(views: &[ViewRecord], poses: &[StationPose]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let mut points = views.iter().filter_map(|view| view.points).peekable();
    if points.peek().is_some() && points.all(|points| points == 0) {
        doubts.push(Doubt::new(
            DoubtKind::NoPoints,
            "the result has 0 points: every pixel is flagged or without a range",
        ));
    } else {
        doubts.extend(views.iter().filter_map(|view| view.doubt.clone()));
    }
    if poses.len() == views.len() {
        let placed: Vec<PlacedStation<'_>> = views.iter().zip(poses).map(|(view, pose)| placed(view, pose)).collect();
        doubts.extend(uncertain(&placed));
        doubts.extend(displaced(&placed));
    }
    doubts
}

fn placed<'a>(view: &'a ViewRecord, pose: &'a StationPose) -> PlacedStation<'a> {
    PlacedStation {
        name: &view.station,
        pose,
        stated: view.stated,
        stated_sigma: view.stated_sigma,
        distance_m: view.distance_m,
    }
}

/// Standard deviations in space of the position, metre, and the attitude, radian, that `stations.csv` states.
pub fn stated_sigma(stated: &StatedPoses, name: &str) -> [Option<f64>; 2] {
    let row = stated.of(name);
    let in_space = |sigmas: [f64; 3]| sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>().sqrt();
    [row.and_then(|row| row.sigma_position_m), row.and_then(|row| row.sigma_attitude_rad)].map(|s| s.map(in_space))
}

/// A view that shows too little.
pub fn mostly_flagged(view: &View) -> Option<Doubt> {
    let flags = view.flags()?.as_slice();
    let share = |count: usize| count as f64 / flags.len().max(1) as f64;
    // Pixels without data are no pixels of the scene: a part of many an image is never lit.
    let empty = flags.iter().filter(|flags| flags.contains(Flags::NO_DATA)).count();
    let any = share(flags.iter().filter(|flags| !flags.is_empty()).count());
    if any <= MOST_FLAGGED {
        return None;
    }
    let most =
        Flags::NAMED.iter().map(|(flag, name)| (flags.iter().filter(|f| f.contains(*flag)).count(), name)).max()?;
    let words = format!(
        "{:.0} % of its pixels are flagged, most of them {} ({:.0} %){}: look at its pictures in the report, or leave it out",
        100.0 * any,
        most.1,
        100.0 * share(most.0),
        if empty > 0 { format!(", {:.0} % without data", 100.0 * share(empty)) } else { String::new() }
    );
    Some(Doubt::about(DoubtKind::MostlyFlagged, &view.station, words))
}

/// A view most of whose ranges lie beyond the longest that the stage was told of.
pub fn beyond_maximum(view: &View, stage: &str, maximum_range_m: f64) -> Option<Doubt> {
    let ViewData::Range(frame) = &view.data else { return None };
    let pixels = frame.range.as_slice().iter().zip(frame.flags.as_slice());
    let measured = pixels.filter(|(range, flags)| range.is_finite() && !flags.contains(Flags::NO_DATA));
    let (mut all, mut beyond) = (0_usize, 0_usize);
    for (range, _) in measured {
        all += 1;
        beyond += usize::from(f64::from(*range) > maximum_range_m);
    }
    (2 * beyond > all).then(|| {
        let words = format!(
            "{:.0} % of its ranges are longer than maximum_range_m: {maximum_range_m} of {stage}: the unit or the value is \
             wrong, or the camera sees past it",
            100.0 * beyond as f64 / all as f64
        );
        Doubt::about(DoubtKind::BeyondMaximum, &view.station, words)
    })
}
