//! The points of the frames alone, as the clouds of a survey.

use multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;
use point_cloud::Cloud;

use crate::sets::Set;
use crate::tally::Tally;
use crate::worst;

/// Every fourth point of the pixels, as surveys have some ten thousand a station.
const STRIDE: usize = 2;

/// Registers the clouds of a set from guesses, prints a line and counts it.
pub fn measure(set: &Set, guesses: &[Isometry3<f64>], tally: &mut Tally) {
    let Some(sequence) = &set.sequence else { return };
    let head = format!("{:<34} clouds", set.name);
    let thinned = |points: &[[f64; 3]]| -> Vec<[f64; 3]> {
        let kept =
            (0..points.len()).filter(|at| (at / 640).is_multiple_of(STRIDE) && (at % 640).is_multiple_of(STRIDE));
        kept.map(|at| points[at]).collect()
    };
    let clouds: Vec<Cloud> =
        sequence.frames.iter().map(|frame| Cloud::from_frame(&thinned(&frame.points), None, None).unwrap()).collect();
    let options = StationRegistrationOptions::default();
    match register_stations(&clouds, Start::Poses(guesses), Datum::Station(0), &options, &|_, _| {}) {
        Ok(found) => {
            let poses: Vec<Option<Isometry3<f64>>> = found.world_from_station.iter().copied().map(Some).collect();
            let (mm, degrees) = worst(set, &poses, None);
            let doubtful: Vec<usize> = found.placements.doubtful().collect();
            println!(
                "{head} {mm:>8.1} {degrees:>7.2} settled {}, sigma0 {:.2}, undetermined {}, doubtful {doubtful:?}",
                found.settled,
                found.sigma0.unwrap_or(f64::NAN),
                found.undetermined.len(),
            );
            let sure = found.settled && found.undetermined.is_empty() && doubtful.is_empty();
            tally.add(clouds.len(), usize::from(sure) * clouds.len(), mm);
        }
        Err(error) => println!("{head} {error}"),
    }
}
