//! Pairs of frames with and without a fifth of invalid pixels: frames of a Kinect 10, 20 and 30 apart, half of the
//! sequence at a time, and simulated ones. `invalid simulated 1000 5`: those from seed 1000 on, five times as many.

use std::sync::Arc;

use icp_registration::IcpResult;
use nalgebra::Isometry3;
use projective_registration::Error;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection};

use super::common::invalid::{LOSSES, lose};
use super::common::{Pinhole, frame_pair, pose_error};
use super::depth_frames::dense_kitchen;
use super::{measure, median, projection};

/// Share of pixels that are lost.
const SHARE: f64 = 0.2;
/// Every how many frames a pair begins.
const EVERY: usize = 6;

/// What became of some pairs.
#[derive(Default)]
struct Tally {
    pairs: usize,
    right: usize,
    trusted: usize,
    both: usize,
    distances: Vec<f64>,
    angles: Vec<f64>,
    times: Vec<f64>,
}

impl Tally {
    fn add(
        &mut self,
        (result, time): (Result<IcpResult, Error>, f64),
        truth: &Isometry3<f64>,
        (most_mm, most_degrees): (f64, f64),
    ) {
        self.pairs += 1;
        self.times.push(time);
        let Ok(result) = result else { return };
        let (mm, degrees) = pose_error(&result.target_from_source, truth);
        let (right, trusted) = (mm < most_mm && degrees < most_degrees, result.is_trustworthy());
        if right {
            self.distances.push(mm);
            self.angles.push(degrees);
        }
        self.right += usize::from(right);
        self.trusted += usize::from(trusted);
        self.both += usize::from(right && trusted);
    }

    fn print(mut self, name: &str) {
        let mean = self.times.iter().sum::<f64>() / self.times.len() as f64;
        println!(
            "{name}: {} pairs, right {}, trusted {}, both {}; median {:.3} mm {:.4} deg; {:.2} ms, mean {mean:.2}, most {:.1}",
            self.pairs,
            self.right,
            self.trusted,
            self.both,
            median(&mut self.distances),
            median(&mut self.angles),
            median(&mut self.times),
            self.times.last().unwrap()
        );
    }
}

pub fn print() {
    let wanted = std::env::args().nth(2);
    if wanted.as_deref() != Some("real") {
        let number = |at: usize, usual: u64| std::env::args().nth(at).map_or(usual, |number| number.parse().unwrap());
        let (first, times) = (number(3, 0), number(4, 1));
        simulated("176x144", &Pinhole::small(), first..first + 60 * times);
        simulated("224x172", &Pinhole::medium(), first..first + 60 * times);
        simulated("640x480", &Pinhole::large(), first..first + 10 * times);
    }
    if wanted.as_deref() != Some("simulated") {
        real("frames 0 to 249", 0);
        real("frames 250 to 499", 250);
    }
}

/// Points and sigma.
type Frame<'a> = (&'a [[f64; 3]], Option<&'a [f32]>);

/// From raw points to the pose.
fn run(
    projection: &Arc<Projection>,
    [target, source]: [Frame<'_>; 2],
    aligner: &mut FrameAligner,
) -> (Result<IcpResult, Error>, f64) {
    measure::measured(|| {
        let target = OrganisedFrame::new(projection, target.0, target.1)?;
        let source = OrganisedFrame::new(projection, source.0, source.1)?;
        aligner.align(&source, &target, &Isometry3::identity())
    })
}

fn simulated(name: &str, camera: &Pinhole, pairs: std::ops::Range<u64>) {
    let projection = projection(camera);
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let mut tallies: [Tally; LOSSES.len()] = Default::default();
    for k in pairs {
        let pair = frame_pair(camera, k);
        for (loss, tally) in LOSSES.into_iter().zip(&mut tallies) {
            let [target, source] = [(&pair.target, 2 * k), (&pair.source, 2 * k + 1)].map(|(frame, seed)| {
                let mut points = frame.0.clone();
                lose(&mut points, camera.width, loss, SHARE, seed);
                points
            });
            let frames = [(&target[..], Some(&pair.target.1[..])), (&source[..], Some(&pair.source.1[..]))];
            tally.add(run(&projection, frames, &mut aligner), &pair.target_from_source, (30.0, 1.0));
        }
    }
    for (loss, tally) in LOSSES.into_iter().zip(tallies) {
        tally.print(&format!("{name} {loss:?}"));
    }
}

fn real(name: &str, first: usize) {
    let Some(sequence) = dense_kitchen(first..first + 250) else {
        println!("{name}: the frames are not there");
        return;
    };
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    for gap in [10, 20, 30] {
        let mut tallies: [Tally; LOSSES.len()] = Default::default();
        for k in (0..250 - gap).step_by(EVERY) {
            let pair = [&sequence.frames[k], &sequence.frames[k + gap]];
            let truth = pair[0].world_from_camera.inverse() * pair[1].world_from_camera;
            for (loss, tally) in LOSSES.into_iter().zip(&mut tallies) {
                let with_loss = |index: usize| {
                    let mut points = pair[index].points.clone();
                    lose(&mut points, 640, loss, SHARE, (2 * (first + k) + index) as u64);
                    points
                };
                let [target, source] = [0, 1].map(with_loss);
                let found = run(&sequence.projection, [(&target, None), (&source, None)], &mut aligner);
                tally.add(found, &truth, (50.0, 3.0));
            }
        }
        for (loss, tally) in LOSSES.into_iter().zip(tallies) {
            tally.print(&format!("{name}, {gap} apart, {loss:?}"));
        }
    }
}
