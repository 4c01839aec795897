//! Whether points lie where the cameras of their frames can see them.

use rayon::prelude::*;
use statistics::upper_median;

use crate::CommonErrorsFile;
use crate::result::ResultCloud;

/// Median distance of points from their perspective centres beyond which they are not in metre. Range cameras end far below;
/// a room in millimetres begins above. `inspect` takes the same limit. A smaller one refuses long ranges, a larger one lets
/// small objects in millimetres through to what cells and noise say of them.
const LONGEST_RANGE_M: f64 = 100.0;
/// Distance beside an image, pixel, at which a point is still in it: coordinates in single precision move it by less, with fields
/// of view of a degree and coordinates of kilometres as well.
const BESIDE_PX: f64 = 1.0;
/// Largest part of the points of a frame that may lie outside of its image. In a result none do, save where a lens has no inverse in
/// the corners of its image. A larger one lets clouds pass that are turned by so much of the field of view.
const MOST_OUTSIDE: f64 = 0.05;

/// What a point is to its frame.
struct Sight {
    frame: usize,
    range_m: f64,
    is_outside: bool,
}

/// Checks that coordinates have the unit and the system of the places of the frames.
///
/// # Errors
/// What is wrong, in words.
pub(crate) fn fits_its_frames(cloud: &ResultCloud) -> Result<(), String> {
    let errors = &cloud.errors;
    let sight = |point: &usize| {
        let (frame, place) = (errors.frame[*point] as usize, &cloud.points[*point]);
        let station = &errors.stations[frame];
        Sight {
            frame,
            range_m: (place.coords - station.world_from_camera().translation.vector).norm(),
            is_outside: cloud.has_camera && !station.sees(place, BESIDE_PX),
        }
    };
    let is_finite = |point: &&usize| cloud.points[**point].iter().all(|value| value.is_finite());
    let sights: Vec<Sight> = cloud.usable.par_iter().filter(is_finite).map(sight).collect();
    let median_m = upper_median(&mut sights.iter().map(|sight| sight.range_m).collect::<Vec<_>>());
    if median_m > LONGEST_RANGE_M {
        return Err(format!(
            "half of the points are further than {median_m:.0} m from the places of their frames in {}, expected at most \
             {LONGEST_RANGE_M} m: are the coordinates in millimetres? Give them in metre",
            CommonErrorsFile::FILE_NAME
        ));
    }
    seen_from_their_places(&sights, &cloud.views)
}

fn seen_from_their_places(sights: &[Sight], views: &[String]) -> Result<(), String> {
    // Of each frame: its points, and those outside of its image.
    let mut counts = vec![[0_usize; 2]; views.len()];
    for sight in sights {
        counts[sight.frame][0] += 1;
        counts[sight.frame][1] += usize::from(sight.is_outside);
    }
    let share = |frame: usize| counts[frame][1] as f64 / counts[frame][0].max(1) as f64;
    let Some(worst) = (0..views.len()).max_by(|a, b| share(*a).total_cmp(&share(*b))) else { return Ok(()) };
    if share(worst) <= MOST_OUTSIDE {
        return Ok(());
    }
    let [points, outside] = counts[worst];
    let alike = (0..views.len()).filter(|frame| share(*frame) > MOST_OUTSIDE).count();
    Err(format!(
        "{outside} of the {points} points of frame `{}` lie where its camera cannot see them from its place in {}, as in {alike} of {} \
         frames: are columns exchanged, or is the cloud in another coordinate system than the frames? Take both from one run",
        views[worst],
        CommonErrorsFile::FILE_NAME,
        views.len()
    ))
}
