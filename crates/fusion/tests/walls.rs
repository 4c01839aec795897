//! Walls that are one, walls that are two, and who contradicts whom.

use std::collections::BTreeSet;

use fusion::nalgebra::{DMatrix, Matrix3, Vector3};
use fusion::point_uncertainty::{CommonError, CommonErrors, PointErrors, Source};
use fusion::{Fused, FusionOptions, Reason, fuse};

use crate::common::scene::THIN;
use crate::common::survey::{Plan, Survey};
use crate::common::wall::Wall;

#[test]
fn the_two_sides_of_a_thin_wall_stay_two() {
    let survey = Survey::new(&Plan::default(), 3);
    let fused = fuse(&survey.registered(), &survey, &survey.common, &FusionOptions::default()).unwrap();
    for face in THIN {
        let face = survey.scene.faces[face];
        // Inside of the wall's ends and above its foot.
        let on_side = fused.surfels.iter().filter(|s| {
            s.normal[face.axis] * face.side > 0.9
                && (s.position.x - face.at).abs() < 0.03
                && (2.0..2.9).contains(&s.position.y)
                && (0.2..1.6).contains(&s.position.z)
        });
        let off: Vec<f64> = on_side.map(|s| (s.position.x - face.at) / s.sigma_m()).collect();
        assert!(off.len() > 300, "{}", off.len());
        // Three deviations of what all have in common, and noise.
        assert!(off.iter().filter(|off| off.abs() > 4.0).count() * 50 < off.len());
    }
    assert!(fused.apart.is_empty(), "{:?}", fused.apart);
}

#[test]
fn walls_that_differ_by_what_is_stated_become_one() {
    let wall = Wall::new(6, 60, 0.004, 0.0, 0.006, 21);
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    // One fused point for each cell of a square metre.
    assert!((360..480).contains(&fused.surfels.len()), "{}", fused.surfels.len());
    let heights: Vec<f64> = fused.surfels.iter().map(|s| s.position.z).collect();
    let thickness = statistics::robust_standard_deviation(&heights);
    // Fifty-four points of 4 mm in a cell.
    assert!(thickness < 1.2 * 0.004 / 54_f64.sqrt(), "{thickness}");
    assert!(fused.apart.is_empty() && fused.contradictions.is_empty());
}

#[test]
fn a_station_beyond_what_is_stated_is_named_and_its_wall_stays_apart() {
    // Six deviations of the station, four of the difference of two.
    let mut wall = Wall::new(4, 60, 0.003, 0.0, 0.002, 4);
    for (point, _) in wall.points.iter_mut().zip(&wall.frames).filter(|(_, frame)| **frame == 2) {
        point.z += 0.012;
    }
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    assert_eq!(fused.apart.len(), 1, "{:?}", fused.apart);
    assert_eq!(fused.apart[0].frames, [2]);
    assert_eq!(fused.apart[0].others, [0, 1, 3]);
    assert!(fused.apart[0].shifts[0].0 == "S2 dz" && fused.apart[0].shifts[0].1 > 0.006);
    // Four deviations are too few to tell at each place that three saw through it: some of its wall stays.
    let (own, theirs): (Vec<_>, Vec<_>) = fused.surfels.iter().partition(|s| s.frames == [2]);
    assert!(theirs.len() > 350 && theirs.iter().all(|s| s.position.z < 0.004), "{}", theirs.len());
    assert!(own.len() + fused.outvoted > 350 && own.iter().all(|s| s.position.z > 0.004), "{}", own.len());
    let outvoted = fused.unfused.iter().filter(|unfused| unfused.reason == Reason::Outvoted);
    assert!(outvoted.map(|unfused| wall.frames[unfused.point]).all(|frame| frame == 2));
}

/// A wall of stations that each see it once, with those of some of them moved along its normal.
fn moved(stations: usize, by_m: f64, which: fn(u32) -> bool) -> (Wall, Fused) {
    let mut wall = Wall::new(stations, 60, 0.003, 0.0, 0.002, 4);
    for (point, _) in wall.points.iter_mut().zip(&wall.frames).filter(|(_, frame)| which(**frame)) {
        point.z += by_m;
    }
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    (wall, fused)
}

#[test]
fn of_as_many_for_as_against_both_stay() {
    let (_, fused) = moved(4, 0.12, |frame| frame < 2);
    let front = fused.surfels.iter().filter(|s| s.frames == [0, 1]).count();
    assert!(front > 330 && fused.seen_through > 300, "{front} {}", fused.seen_through);
    // At the walls' edges one frame alone sees past the other's.
    assert!(fused.outvoted < 60, "{}", fused.outvoted);
}

#[test]
fn what_one_saw_through_a_wall_of_many_is_outvoted() {
    let (wall, fused) = moved(4, -0.12, |frame| frame == 1);
    let behind = fused.surfels.iter().filter(|s| s.frames == [1]).count();
    // At its edges, 76 of 400, the one sees past the walls of the others.
    assert!(fused.outvoted > 290 && behind < 110, "{} {behind}", fused.outvoted);
    let outvoted = fused.unfused.iter().filter(|unfused| unfused.reason == Reason::Outvoted);
    assert!(outvoted.map(|unfused| wall.frames[unfused.point]).all(|frame| frame == 1));
}

#[test]
fn a_wall_far_beyond_what_is_stated_is_seen_through() {
    let (_, fused) = moved(3, 0.12, |frame| frame == 1);
    // What is left of it stands at its edges, where nothing was seen behind.
    let left = fused.surfels.iter().filter(|s| s.frames == [1]).count();
    assert!(fused.outvoted > 330 && left < 60, "{} {left}", fused.outvoted);
    let pairs: BTreeSet<(u32, u32)> = fused.contradictions.iter().map(|c| (c.front_frame, c.seen_through_by)).collect();
    assert_eq!(pairs, BTreeSet::from([(1, 0), (1, 2)]));
    let seen = &fused.contradictions[fused.contradictions.len() / 2];
    assert!((seen.distance_m - 0.12).abs() < 0.02 && seen.deviations > 10.0, "{seen:?}");
    assert!(seen.front.z > 0.1 && seen.behind.z < 0.02, "{seen:?}");
}

#[test]
fn outliers_are_named_and_not_averaged() {
    let mut wall = Wall::new(3, 60, 0.003, 0.0, 0.001, 10);
    // Of frame 0: in front of the wall, behind it, and far away.
    let middle = |row: usize, column: usize| row * 60 + column;
    wall.points[middle(30, 20)].z += 0.3;
    wall.points[middle(30, 40)].z -= 0.05;
    wall.points[middle(10, 10)].x += 30.0;
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    let reason = |at: usize| fused.unfused.iter().find(|unfused| unfused.point == at).unwrap().reason;
    assert!(reason(middle(30, 20)).is_contradiction(), "{:?}", reason(middle(30, 20)));
    assert!(reason(middle(30, 40)).is_contradiction(), "{:?}", reason(middle(30, 40)));
    assert_eq!(reason(middle(10, 10)), Reason::Alone);
    assert!(fused.apart.is_empty(), "{:?}", fused.apart);
    assert!(fused.surfels.iter().all(|s| s.position.z.abs() < 0.01));
    // One in ten thousand is left out by chance.
    assert!(fused.unfused.len() < 12, "{}", fused.unfused.len());
}

/// A wall whose frames may have slid along it, beside their shifts across.
struct Sliding<'a>(&'a Wall);

impl PointErrors for Sliding<'_> {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.0.noise(point)
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.0.sensor(point)
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.0.common(point, derivatives);
        derivatives.push((self.0.centres.len() + self.0.frames[point] as usize, Vector3::x()));
    }
}

#[test]
fn a_plane_does_not_tell_how_frames_slid_along_it() {
    let frames = 6;
    let wall = Wall::new(frames, 120, 0.008, 0.0, 0.004, 77);
    let errors = (0..2 * frames).map(|at| CommonError { name: format!("{at}"), source: Source::Pose }).collect();
    let common = CommonErrors::new(errors, DMatrix::identity(2 * frames, 2 * frames) * 0.02_f64.powi(2)).unwrap();
    let fused = fuse(&wall.registered(), &Sliding(&wall), &common, &FusionOptions::default()).unwrap();
    // Tilts of places by their noise seem to tell it where derivatives are taken along them: 0.42 would be left.
    for frame in 0..frames {
        let left = |column: usize| fused.common.covariance()[(column, column)].sqrt() / 0.02;
        assert!(left(frames + frame) > 0.65 && left(frame) < 0.6, "{} {}", left(frames + frame), left(frame));
    }
}

#[test]
fn a_wall_that_frames_see_ever_further_away_stands_once() {
    // From x = 0.6 m on each of eight frames sees it some millimetres behind where the one before does, which nothing states.
    let mut wall = Wall::new(8, 100, 0.004, 0.0, 1e-5, 31);
    for (point, frame) in wall.points.iter_mut().zip(&wall.frames) {
        if point.x > 0.6 {
            point.z -= 0.003 * f64::from(*frame);
        }
    }
    let fused = fuse(&wall.registered(), &wall, &wall.common, &FusionOptions::default()).unwrap();
    let there: Vec<_> = fused.surfels.iter().filter(|surfel| surfel.position.x > 0.7).collect();
    let heights: Vec<f64> = there.iter().map(|surfel| surfel.position.z).collect();
    let scatter = statistics::robust_standard_deviation(&heights);
    let sigma = statistics::quantile(&mut there.iter().map(|surfel| surfel.sigma_m()).collect::<Vec<_>>(), 0.5);
    // In layers there were 507, 8.3 mm apart and stated to 2.9 mm, and 77 contradictions.
    assert!(scatter < sigma && sigma < 0.005 && there.len() < 300, "{scatter}, {sigma}, {}", there.len());
    assert!(fused.contradictions.is_empty(), "{:?}", fused.contradictions);
}
