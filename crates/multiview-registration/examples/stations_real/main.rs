//! Frames of real sensors as stations: how many are placed, how far off they are, and whether what does not belong is named.
//!
//! `cargo run --release -p multiview-registration --example stations_real [-- first|second|others ..] [--each] [--clouds] [set=NAME]`
//!
//! `--clouds`: the points of the frames as clouds, without their images, by `register_stations`. Of the 500 frames of a Kinect the first half was tuned on, the second judges.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::expect_used, missing_docs)]

mod clouds;
#[path = "../../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;
mod intruders;
mod sets;
#[path = "../../../projective-registration/tests/sr4000/mod.rs"]
mod sr4000;
mod tally;

use std::time::Instant;

use multiview_registration::{FrameRegistration, Start, register_frames};
use nalgebra::{Isometry3, Vector3};
use projective_registration::{FrameAlignmentOptions, OrganisedFrame};

use intruders::Intruder;
use sets::Set;
use tally::Tally;

/// Of the reference, a pair of neighbours.
const REFERENCE_M: f64 = 8e-3;
const REFERENCE_DEG: f64 = 0.3;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| words.iter().any(|w| w == word);
    let asked = words.iter().find_map(|word| word.strip_prefix("set="));
    let parts = ["first", "second", "others"];
    let all = !parts.iter().any(|part| has(part));
    println!(
        "{:<34} {:<9} {:<10} {:>9} {:>8} {:>7} {:>6} {:>7} {:>13}",
        "set", "start", "intruder", "placed", "worst mm", "deg", "s", "factor", "over variance"
    );
    let mut tally = Tally::default();
    for part in parts.into_iter().filter(|part| all || has(part)) {
        for set in sets::of(part).into_iter().filter(|set| asked.is_none_or(|name| set.name.contains(name))) {
            if has("--clouds") {
                clouds::measure(&set, &guesses(&set, true), &mut tally);
                continue;
            }
            for intruder in Intruder::ALL {
                for start in ["order", "guesses", "reference"] {
                    if intruder == Intruder::None || (start == "order" && set.frames.len() > 4) {
                        measure(&set, intruder, start, has("--each"), &mut tally);
                    }
                }
            }
        }
    }
    tally.print();
}

/// Registers the frames of a set and prints a line.
fn measure(set: &Set, intruder: Intruder, start: &str, each: bool, tally: &mut Tally) {
    let at = set.frames.len() / 2;
    let mut frames: Vec<OrganisedFrame> = set.frames.clone();
    let named = intruder.put(set, &mut frames, at);
    let poses = guesses(set, start == "guesses");
    let start_of = if start == "order" { Start::Order } else { Start::Poses(&poses) };
    let clock = Instant::now();
    let found = register_frames(&frames, start_of, &FrameAlignmentOptions::default(), &|_, _| {});
    let seconds = clock.elapsed().as_secs_f64();
    let head = format!("{:<34} {start:<9} {:<10}", set.name, intruder.name());
    let found = match found {
        Ok(found) => found,
        Err(error) => {
            println!("{head} {error}");
            return;
        }
    };
    let poses: Vec<_> = found.frames.iter().map(|frame| frame.map(|frame| frame.world_from_frame)).collect();
    let (mm, degrees) = worst(set, &poses, named);
    let others = frames.len() - usize::from(named.is_some());
    let placed = (0..frames.len()).filter(|k| Some(*k) != named && found.frames[*k].is_some()).count();
    let is_unchecked = |frame: usize| found.unchecked.iter().any(|pair| pair.frames.contains(&frame));
    match named {
        Some(frame) => {
            let is_named = is_unchecked(frame) || found.frames[frame].is_none();
            tally.intruders = [tally.intruders[0] + 1, tally.intruders[1] + usize::from(is_named)];
        }
        None => tally.add(others, placed, mm),
    }
    let verdict = match named {
        Some(frame) if is_unchecked(frame) => " named as not checked",
        Some(frame) if found.frames[frame].is_some() => " NOT NAMED",
        Some(_) => " named",
        None => "",
    };
    let [position, attitude] = over_variance(set, &found, named);
    println!(
        "{head} {:>9} {mm:>8.1} {degrees:>7.2} {seconds:>6.1} {:>7.1} {position:>6.1} {attitude:>6.1}{verdict} {}",
        format!("{placed} of {others}"),
        found.variance_factor,
        unchecked(&found)
    );
    if each {
        details(set, &found);
    }
}

/// Frames that a single pair joins with the others.
fn unchecked(found: &FrameRegistration) -> String {
    let frames: Vec<usize> = found.unchecked.iter().flat_map(|pair| pair.frames.iter().copied()).collect();
    if frames.is_empty() { String::new() } else { format!("not checked: {frames:?}") }
}

fn details(set: &Set, found: &FrameRegistration) {
    println!("  {} pairs, shared error {:.2?}", found.pairs.len(), found.shared_error.sigma().map(|s| 1e3 * s));
    for pair in &found.pairs {
        let (a, b) = (pair.target, pair.source);
        let truth = set.reference[a].inverse() * set.reference[b];
        let (mm, degrees) = apart(&pair.result.target_from_source, &truth);
        let (Some(x), Some(y)) = (found.frames[a], found.frames[b]) else { continue };
        let (of_graph, of_graph_degrees) = apart(&(x.world_from_frame.inverse() * y.world_from_frame), &truth);
        let sigma = 1e3 * pair.result.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
        println!(
            "  pair {a} {b}: {mm:.1} mm {degrees:.2} deg, sigma {sigma:.1} mm; adjusted {of_graph:.1} mm {of_graph_degrees:.2} deg"
        );
    }
    for out in &found.unplaced {
        println!("  out {}: {}", out.frame, out.reason);
    }
    for pair in &found.refused {
        println!("  refused {} {}: {}", pair.target, pair.source, pair.reason);
    }
    let first = found.datum;
    for (k, placed) in found.frames.iter().enumerate() {
        let (Some(placed), Some(datum)) = (placed, found.frames[first]) else { continue };
        let truth = set.reference[first].inverse() * set.reference[k];
        let pose = datum.world_from_frame.inverse() * placed.world_from_frame;
        let sigma = 1e3 * placed.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
        let (mm, degrees) = apart(&pose, &truth);
        println!("  {k}: {mm:.1} mm {degrees:.2} deg, sigma {sigma:.1} mm");
    }
}

/// Squared errors of position and attitude from the datum over what is stated of them and of the reference, mean of the frames.
fn over_variance(set: &Set, found: &FrameRegistration, named: Option<usize>) -> [f64; 2] {
    let Some(datum) = found.frames[found.datum].filter(|_| Some(found.datum) != named) else { return [f64::NAN; 2] };
    let (mut sums, mut count) = ([0.0; 2], 0.0_f64);
    for k in (0..set.reference.len()).filter(|k| *k != found.datum && Some(*k) != named) {
        let Some(placed) = found.frames[k] else { continue };
        let truth = set.reference[found.datum].inverse() * set.reference[k];
        let (mm, degrees) = apart(&(datum.world_from_frame.inverse() * placed.world_from_frame), &truth);
        let variance = |first: usize| placed.covariance.fixed_view::<3, 3>(first, first).trace();
        sums[0] += (1e-3 * mm).powi(2) / (variance(0) + REFERENCE_M.powi(2));
        sums[1] += degrees.to_radians().powi(2) / (variance(3) + REFERENCE_DEG.to_radians().powi(2));
        count += 1.0;
    }
    sums.map(|sum| sum / count)
}

/// The poses of the reference, or these but for the first 5 cm and 2 degrees off.
fn guesses(set: &Set, off: bool) -> Vec<Isometry3<f64>> {
    let one = |(k, pose): (usize, &Isometry3<f64>)| if off && k > 0 { pose * off_by(k) } else { *pose };
    set.reference.iter().enumerate().map(one).collect()
}

/// 5 cm and 2 degrees, in directions that differ from frame to frame.
fn off_by(k: usize) -> Isometry3<f64> {
    let direction =
        |phase: f64| Vector3::new((phase * 2.4).cos(), (phase * 2.4).sin(), (phase * 1.1).cos()).normalize();
    Isometry3::new(0.05 * direction(k as f64), 2.0_f64.to_radians() * direction(k as f64 + 0.7))
}

/// Largest errors after the best fit of the placed stations to the reference: millimetre, degree.
fn worst(set: &Set, found: &[Option<Isometry3<f64>>], named: Option<usize>) -> (f64, f64) {
    let known: Vec<(Isometry3<f64>, Isometry3<f64>)> = (0..set.reference.len())
        .filter(|k| Some(*k) != named)
        .filter_map(|k| Some((found[k]?, set.reference[k])))
        .collect();
    let fit = fit(&known);
    let off = known.iter().map(|(pose, truth)| apart(&(fit * pose), truth));
    off.fold((0.0, 0.0), |worst, off| (worst.0.max(off.0), worst.1.max(off.1)))
}

/// The motion that brings all poses nearest to the reference: mean rotation, then mean position.
fn fit(known: &[(Isometry3<f64>, Isometry3<f64>)]) -> Isometry3<f64> {
    let Some((pose, truth)) = known.first() else { return Isometry3::identity() };
    let mut motion = truth * pose.inverse();
    for _ in 0..10 {
        let count = known.len() as f64;
        let turn: Vector3<f64> =
            known.iter().map(|(p, t)| (t.rotation * (motion.rotation * p.rotation).inverse()).scaled_axis()).sum();
        motion = Isometry3::new(Vector3::zeros(), turn / count) * motion;
        let shift: Vector3<f64> =
            known.iter().map(|(p, t)| t.translation.vector - (motion * p).translation.vector).sum();
        motion.translation.vector += shift / count;
    }
    motion
}

fn apart(pose: &Isometry3<f64>, truth: &Isometry3<f64>) -> (f64, f64) {
    let mm = 1e3 * (pose.translation.vector - truth.translation.vector).norm();
    (mm, pose.rotation.angle_to(&truth.rotation).to_degrees())
}
