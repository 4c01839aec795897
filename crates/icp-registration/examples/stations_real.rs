//! Frames of a real structured-light camera as stations, held against the poses that come with them.
//!
//! ```text
//! cargo run --release -p icp-registration --features multiview --example stations_real -- START ODD FIRST STEP COUNT ...
//! ```
//!
//! START: `order`, `off` (poses 50 mm and 2 degrees off), `known`. ODD: what the station in the middle is, `none`,
//! `foreign` (another scene), `mirrored`, `scaled` (5 % larger), `moved` (0.3 m). Then sets of frames: the first, the step, their
//! number. Errors are those of positions and attitudes against the first station; *steps* those between stations that
//! follow each other, and over the deviations stated and those of the reference, 8 mm and 0.3 degrees. *Contradicting*: part
//! of the pixels whose depth is off by more than 3 % where one station sees what the next three saw, by the reference and
//! by the poses found: told by outlines, which depths do not move.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/depth_frames/mod.rs"]
mod depth_frames;

use std::time::Instant;

use common::disturbance;
use depth_frames::{DepthFrame, dense_kitchen, living_room};
use icp_registration::{
    Cloud, Datum, OrganisedNormalOptions, Start, StationRegistration, StationRegistrationOptions, organised_normals,
    register_stations,
};
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

/// Half the side of the windows that normals come from, and the widest.
const HALF_WIDTH_PX: usize = 3;
const WIDEST_PX: usize = 12;
/// Deviations of the reference between two frames: of each axis, metre, and about each, radian.
const REFERENCE: [f64; 2] = [0.008 / 1.732, 0.3 / 57.296 / 1.732];
const FOCAL: f64 = 585.0;

fn cloud(points: &[[f64; 3]], widest: Option<usize>) -> Cloud {
    let options = OrganisedNormalOptions {
        half_width_px: HALF_WIDTH_PX,
        widest_half_width_px: widest,
        ..OrganisedNormalOptions::default()
    };
    let normals = organised_normals(points, 640, 480, &options).unwrap();
    Cloud::from_frame(points, Some(&normals), None).unwrap()
}

/// The points of the odd station.
fn odd(what: &str, points: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
    match what {
        "foreign" => Some(living_room()?.frames.swap_remove(0).points),
        // Pixels in their rows and columns, what was left is right.
        "mirrored" => {
            Some((0..points.len()).map(|k| points[k / 640 * 640 + 639 - k % 640]).map(|[x, y, z]| [-x, y, z]).collect())
        }
        "scaled" => Some(points.iter().map(|p| p.map(|c| 1.05 * c)).collect()),
        _ => Some(points.to_vec()),
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    for set in words[2..].chunks_exact(3) {
        let set = [0, 1, 2].map(|k| set[k].parse::<usize>().unwrap());
        if run(&words[0], &words[1], set).is_none() {
            println!("skipped: the frames are not there");
        }
    }
}

fn run(start: &str, what: &str, [first, step, count]: [usize; 3]) -> Option<()> {
    let sequence = dense_kitchen((0..count).map(|k| first + k * step))?;
    let middle = (what != "none").then_some(count / 2);
    let known: Vec<Isometry3<f64>> = sequence.frames.iter().map(|frame| frame.world_from_camera).collect();
    let poses: Vec<Isometry3<f64>> = (0..count)
        .map(|k| match (start, what) {
            (_, "moved") if Some(k) == middle => known[k] * disturbance(0.3, 0.0, 7),
            ("off", _) => known[k] * disturbance(0.05, 2.0, (1000 * first + k) as u64),
            _ => known[k],
        })
        .collect();
    let widest = (start != "order").then_some(WIDEST_PX);
    let mut clouds = Vec::new();
    for (k, frame) in sequence.frames.iter().enumerate() {
        clouds.push(if Some(k) == middle {
            cloud(&odd(what, &frame.points)?, widest)
        } else {
            cloud(&frame.points, widest)
        });
    }
    let begun = Instant::now();
    let start = if start == "order" { Start::Order } else { Start::Poses(&poses) };
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, start, Datum::Station(0), &options, &|_, _| {});
    let seconds = begun.elapsed().as_secs_f64();
    match found {
        Ok(found) => told(&found, &sequence.frames, middle, ([first, step, count], seconds)),
        Err(error) => println!("{first} {step} {count}: {seconds:.1} s, refused: {error}"),
    }
    Some(())
}

fn told(found: &StationRegistration, frames: &[DepthFrame], middle: Option<usize>, (set, seconds): ([usize; 3], f64)) {
    let known: Vec<Isometry3<f64>> = frames.iter().map(|frame| frame.world_from_camera).collect();
    let sound: Vec<usize> = (0..known.len()).filter(|k| Some(*k) != middle).collect();
    let error = |a: usize, b: usize| {
        let (pose, covariance) = found.relative_pose(a, b).unwrap();
        let truth = known[a].inverse() * known[b];
        let (apart, turn) = (
            pose.translation.vector - truth.translation.vector,
            (truth.rotation.inverse() * pose.rotation).scaled_axis(),
        );
        (Vector6::new(apart.x, apart.y, apart.z, turn.x, turn.y, turn.z), covariance)
    };
    let mm = |error: &Vector6<f64>| 1e3 * error.fixed_rows::<3>(0).norm();
    let degrees = |error: &Vector6<f64>| error.fixed_rows::<3>(3).norm().to_degrees();
    let largest = |of: &dyn Fn(&Vector6<f64>) -> f64, all: &[(Vector6<f64>, Matrix6<f64>)]| {
        all.iter().map(|e| of(&e.0)).fold(0.0, f64::max)
    };
    let all: Vec<_> = sound.iter().skip(1).map(|&k| error(sound[0], k)).collect();
    let steps: Vec<_> = sound.windows(2).map(|pair| error(pair[0], pair[1])).collect();
    let reference = Matrix6::from_diagonal(&Vector6::from_fn(|k, _| REFERENCE[k / 3].powi(2)));
    let square = |(error, covariance): &(Vector6<f64>, Matrix6<f64>), more: &Matrix6<f64>| {
        (covariance + more).cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(error)) / 6.0)
    };
    let over = |all: &[(Vector6<f64>, Matrix6<f64>)], more: &Matrix6<f64>| {
        (all.iter().map(|e| square(e, more)).sum::<f64>() / all.len() as f64).sqrt()
    };
    let sigma = all.iter().map(|e| 1e3 * e.1.fixed_view::<3, 3>(0, 0).trace().sqrt()).fold(0.0, f64::max);
    println!(
        "{set:?}: {seconds:.1} s, worst {:.0} mm {:.2} deg, sigma up to {sigma:.0} mm, over deviations {:.1}; steps worst {:.0} mm {:.2} deg, \
         over deviations {:.1}; settled {} in {}, sigma0 {:.1}, open {:?}, doubtful {:?}",
        largest(&mm, &all),
        largest(&degrees, &all),
        over(&all, &reference),
        largest(&mm, &steps),
        largest(&degrees, &steps),
        over(&steps, &reference),
        found.settled,
        found.rounds,
        found.sigma0.unwrap_or(f64::NAN),
        found.undetermined.iter().map(|open| (open.station, open.motions.len())).collect::<Vec<_>>(),
        found.placements.doubtful().collect::<Vec<_>>(),
    );
    let sigmas = |k: usize| found.surfaces.iter().filter(move |p| p.target == k || p.source == k).map(|p| p.rms_sigma);
    let sigmas: Vec<f64> = (0..known.len()).map(|k| sigmas(k).fold(0.0, f64::max)).collect();
    println!("    largest difference of a pair over what is expected: {sigmas:.1?}");
    let (mut reference, mut ours) = (0.0, 0.0);
    for gap in 1..=3 {
        for pair in sound.windows(gap + 1) {
            let (a, b) = (pair[0], pair[gap]);
            reference += contradicting(&frames[a], &frames[b], &(known[a].inverse() * known[b]));
            ours += contradicting(&frames[a], &frames[b], &found.relative_pose(a, b).unwrap().0);
        }
    }
    let times = found.placements.stations.iter().map(|s| s.times_usual.map_or("-".into(), |t| format!("{t:.1}")));
    let pairs = (3 * sound.len() - 6).max(1) as f64;
    println!(
        "    mm: {:.0?}\n    contradicting: reference {:.1} %, here {:.1} %; times usual: {}",
        all.iter().map(|e| mm(&e.0)).collect::<Vec<f64>>(),
        1e2 * reference / pairs,
        1e2 * ours / pairs,
        times.collect::<Vec<String>>().join(" ")
    );
}

/// Part of the pixels of a frame whose depth differs by more than 3 % from what the other one saw there.
fn contradicting(target: &DepthFrame, source: &DepthFrame, target_from_source: &Isometry3<f64>) -> f64 {
    let (mut all, mut wrong) = (0.0_f64, 0.0);
    for point in source.points.iter().step_by(7).filter(|point| point[2].is_finite()) {
        let at = target_from_source * Point3::from(*point);
        let (column, row) = ((320.0 - at.x / at.z * FOCAL).round(), (240.0 + at.y / at.z * FOCAL).round());
        if at.z < 0.0 && (0.0..640.0).contains(&column) && (0.0..480.0).contains(&row) {
            let seen = target.points[row as usize * 640 + column as usize][2];
            if seen.is_finite() {
                all += 1.0;
                wrong += f64::from(u8::from((seen / at.z - 1.0).abs() > 0.03));
            }
        }
    }
    wrong / all.max(1.0)
}
