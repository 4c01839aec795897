//! Pairs of frames of a Kinect aligned from nothing, half by half of the sequence: how many are found, refused, wrong.
//!
//! `coarse_real [first|second|both] [sensitivity] [--each]`; `sensitivity` refuses nothing and tells what each
//! threshold would decide.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::expect_used, missing_docs)]

mod coarse_sensitivity;
#[path = "../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;

use std::time::Instant;

use depth_frames::{Sequence, dense_kitchen};
use global_registration::{CoarseAlignment, CoarseOptions, FeatureCloud, align_without_guess};
use nalgebra::{Isometry3, Matrix6, Vector6};
use point_cloud::Cloud;
use projective_registration::{OrganisedFrame, frame_consistency};
use rigid_pose::pose_difference;

/// From one frame that pairs are looked for with to the next.
const STEP: usize = 7;
/// Shares of the surface in common, of pairs to be found and of those to be refused.
const SHARED: std::ops::Range<f64> = 0.4..0.9;
const APART: f64 = 0.12;
/// What counts as right.
const RIGHT_M: f64 = 0.1;
const RIGHT_DEG: f64 = 5.0;
/// What the reference is good to, frame by frame.
const REFERENCE_M: f64 = 0.008;
const REFERENCE_DEG: f64 = 0.3;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| words.iter().any(|w| w == word);
    let mut options = CoarseOptions::default();
    if has("sensitivity") {
        options = coarse_sensitivity::loose(&options);
    }
    for (name, range) in [("first half", 0..250), ("second half", 250..500), ("both halves", 0..500)] {
        if !["first", "second", "both"].iter().any(|word| has(word)) || name.split(' ').any(has) {
            match dense_kitchen(range) {
                Some(sequence) => {
                    let tables = pairs(name, &sequence, &options, has("--each"));
                    if has("sensitivity") {
                        for (class, table) in &tables {
                            coarse_sensitivity::print(class, &table.found);
                        }
                    }
                }
                None => println!("the frames are not there"),
            }
        }
    }
}

fn pairs(name: &str, sequence: &Sequence, options: &CoarseOptions, each: bool) -> [(String, Table); 3] {
    let numbers: Vec<usize> = (0..sequence.frames.len()).step_by(STEP).collect();
    let frame = |k: usize| OrganisedFrame::new(&sequence.projection, &sequence.frames[k].points, None).unwrap();
    let frames: Vec<OrganisedFrame> = numbers.iter().map(|k| frame(*k)).collect();
    let cloud = |k: &usize| {
        let cloud = Cloud::from_frame(&sequence.frames[*k].points, None, None).unwrap();
        FeatureCloud::new(&cloud, options).unwrap()
    };
    let clouds: Vec<FeatureCloud> = numbers.iter().map(cloud).collect();
    let (mut shared, mut apart, mut between) = (Table::default(), Table::default(), Table::default());
    for i in 0..numbers.len() {
        // Every pair once, those of a frame spread over the sequence.
        for j in (i + 1..numbers.len()).filter(|j| (i + j) % 5 == 0) {
            let truth =
                sequence.frames[numbers[i]].world_from_camera.inverse() * sequence.frames[numbers[j]].world_from_camera;
            let overlap = overlap(&frames[j], &frames[i], &truth);
            let table = match overlap {
                o if SHARED.contains(&o) => &mut shared,
                o if o < APART => &mut apart,
                _ => &mut between,
            };
            let start = Instant::now();
            let found = align_without_guess(&clouds[j], &clouds[i], options);
            let label = format!("{name} {} {} {overlap:.2}", numbers[i], numbers[j]);
            table.add(each.then_some(&label), &truth, found, 1e3 * start.elapsed().as_secs_f64());
        }
    }
    let classes = ["40 to 90 % in common", "otherwise", "below 12 % in common"].map(|class| format!("{name}, {class}"));
    let [a, b, c] = classes;
    let mut tables = [(a, shared), (b, between), (c, apart)];
    for (class, table) in &mut tables {
        table.print(class);
    }
    tables
}

/// Share of the surface of both frames that the other one sees, the smaller one.
fn overlap(source: &OrganisedFrame, target: &OrganisedFrame, target_from_source: &Isometry3<f64>) -> f64 {
    let of = |a: &OrganisedFrame, b: &OrganisedFrame, pose: &Isometry3<f64>| {
        let found = frame_consistency(a, b, pose, 4);
        found.compared() as f64 / found.all().max(1) as f64
    };
    of(source, target, target_from_source).min(of(target, source, &target_from_source.inverse()))
}

/// Squared error over its covariance, to which that of the reference is added.
fn normalised(found: &CoarseAlignment, truth: &Isometry3<f64>) -> f64 {
    let off = pose_difference(&found.target_from_source, truth);
    let reference =
        Vector6::from_fn(|k, _| if k < 3 { REFERENCE_M.powi(2) } else { REFERENCE_DEG.to_radians().powi(2) });
    let inverse = (found.covariance + Matrix6::from_diagonal(&reference)).try_inverse();
    inverse.map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)))
}

#[derive(Default)]
struct Table {
    right: usize,
    wrong: usize,
    refused: usize,
    milliseconds: Vec<f64>,
    /// Answers, and whether each is right.
    found: Vec<(CoarseAlignment, bool)>,
    /// Normalised squared errors of right answers.
    squares: Vec<f64>,
}

impl Table {
    fn add(
        &mut self,
        label: Option<&String>,
        truth: &Isometry3<f64>,
        found: Result<CoarseAlignment, global_registration::Error>,
        milliseconds: f64,
    ) {
        self.milliseconds.push(milliseconds);
        let words = match found {
            Err(error) => {
                self.refused += 1;
                error.to_string()
            }
            Ok(found) => {
                let off = (found.target_from_source.translation.vector - truth.translation.vector).norm();
                let turned = found.target_from_source.rotation.angle_to(&truth.rotation).to_degrees();
                let right = off < RIGHT_M && turned < RIGHT_DEG;
                self.right += usize::from(right);
                self.wrong += usize::from(!right);
                self.found.push((found.clone(), right));
                if right {
                    self.squares.push(normalised(&found, truth));
                }
                let word = if right { "right" } else { "WRONG" };
                format!(
                    "{word} {:.1} {turned:.2} inliers {} of {} overlap {:.3} agreement {:.3} consistency {:.4} inside {:.3} \
                     rival {:.2} determined {:.2} rms {:.1} voxel {:.1} shared {:.1} over {:.0} mm",
                    1e3 * off,
                    found.inliers,
                    found.correspondences,
                    found.overlap,
                    found.agreement,
                    found.consistency,
                    found.inside,
                    found.rival,
                    found.determined,
                    1e3 * found.rms_m,
                    1e3 * found.voxel_m,
                    1e3 * found.shared_error.sigma_m,
                    1e3 * found.shared_error.length_m
                )
            }
        };
        if let Some(label) = label {
            println!("{label} {words}");
        }
    }

    fn print(&mut self, name: &str) {
        self.milliseconds.sort_by(f64::total_cmp);
        let median = self.milliseconds.get(self.milliseconds.len() / 2).copied().unwrap_or(f64::NAN);
        println!(
            "{name}: {} pairs, {} right, {} wrong, {} refused, {median:.0} ms (median); normalised squared error {:.1} of 6",
            self.milliseconds.len(),
            self.right,
            self.wrong,
            self.refused,
            self.squares.iter().sum::<f64>() / self.squares.len() as f64
        );
    }
}
