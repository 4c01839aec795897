//! Stations in the wrong place, and in the right one.
use crate::common::stations::{round, turned};
use crate::common::{disturbance, pose_error};
use multiview_registration::Error;
use multiview_registration::{
    Datum, Placement, Placements, Start, StationRegistrationOptions, judge_placements, register_stations,
};
use nalgebra::{Isometry3, Translation3};
use rigid_pose::InputError;

fn doubtful(found: &Placements) -> Vec<usize> {
    found.doubtful().collect()
}

fn times_usual(found: &Placements) -> Vec<f64> {
    found.stations.iter().map(|station| station.times_usual.unwrap_or(f64::NAN)).collect()
}

#[test]
fn what_no_residual_shows_is_doubted() {
    let (clouds, truth) = round(8, 0.01, 3);
    let mut start = truth.clone();
    start[1] = turned(&start[1]);
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, Start::Poses(&start), Datum::Station(0), &options, &|_, _| {}).unwrap();
    let (mm, degrees) = pose_error(&found.world_from_station[1], &truth[1]);
    println!("off {mm:.0} mm, {degrees:.0} deg, sigma0 {:?}, {:.1?}", found.sigma0, times_usual(&found.placements));
    // It found walls that it fits, in the other half of the room.
    assert!(found.settled && mm > 1000.0 && found.undetermined.is_empty());
    assert!((0.9..1.1).contains(&found.sigma0.unwrap()));
    assert_eq!(doubtful(&found.placements), [1]);
    for (station, placed) in found.placements.stations.iter().enumerate() {
        assert_eq!(placed.verdict, if station == 1 { Placement::Doubtful } else { Placement::Placed });
    }
}

#[test]
fn stations_turned_or_shifted_are_told_from_the_others() {
    let (clouds, truth) = round(8, 0.01, 5);
    for station in [1, 3, 4, 6] {
        let shifted = |x: f64, y: f64| Translation3::new(x, y, 0.0) * truth[station];
        for wrong in [turned(&truth[station]), shifted(0.3, 0.0), shifted(0.0, 0.3)] {
            let mut poses = truth.clone();
            poses[station] = wrong;
            let found = judge_placements(&clouds, &poses).unwrap();
            println!("station {station}: {:.1?}", times_usual(&found));
            assert_eq!(doubtful(&found), [station]);
        }
        // Two that hide each other, because they agree.
        let mut poses = truth.clone();
        let pair = [station, (station + 1) % 8];
        for k in pair {
            poses[k] = turned(&poses[k]);
        }
        let found = judge_placements(&clouds, &poses).unwrap();
        println!("stations {pair:?}: {:.1?}", times_usual(&found));
        assert_eq!(doubtful(&found), pair);
    }
    // Of two halves, which one is wrong is not known; that one is, is.
    let halves: Vec<Isometry3<f64>> =
        truth.iter().enumerate().map(|(k, pose)| if k < 4 { turned(pose) } else { *pose }).collect();
    let found = doubtful(&judge_placements(&clouds, &halves).unwrap());
    assert!(found == [0, 1, 2, 3] || found == [4, 5, 6, 7], "{found:?}");
}

#[test]
fn right_surveys_have_no_doubtful_station() {
    let mut largest: f64 = 0.0;
    for (count, seeds) in [(8, 0..4), (16, 4..6)] {
        for (gross, seed) in seeds.flat_map(|seed| [(0.0, seed), (0.01, seed)]) {
            let (clouds, truth) = round(count, gross, seed);
            // As well as an adjustment finds them.
            let poses: Vec<Isometry3<f64>> =
                truth.iter().zip(0..).map(|(pose, k)| pose * disturbance(0.001, 0.01, 100 * seed + k)).collect();
            let found = judge_placements(&clouds, &poses).unwrap();
            assert_eq!(doubtful(&found), [0_usize; 0], "{count} stations, seed {seed}: {:.1?}", times_usual(&found));
            assert!(found.stations.iter().all(|station| station.verdict == Placement::Placed));
            largest = times_usual(&found).into_iter().fold(largest, f64::max);
        }
    }
    println!("at most {largest:.2} times what is usual");
    // Half of what is doubted.
    assert!(largest < 2.0, "{largest}");
}

#[test]
fn few_stations_are_not_judged() {
    let (clouds, mut poses) = round(4, 0.0, 9);
    poses[1] = turned(&poses[1]);
    let found = judge_placements(&clouds, &poses).unwrap();
    assert!(found.stations.iter().all(|station| station.verdict == Placement::Unjudged));
    assert!(found.pairs.iter().all(|pair| pair.target < pair.source));
    let short = judge_placements(&clouds, &poses[..3]).unwrap_err();
    assert!(matches!(short, Error::Input(InputError::LengthMismatch { .. })));
    poses[2].translation.vector.x = f64::NAN;
    assert!(matches!(
        judge_placements(&clouds, &poses).unwrap_err(),
        Error::Input(InputError::NonFinite { index: 2, .. })
    ));
}
