//! What is right, what is trusted and what is trusted but wrong, without times: for `cargo xtask sensitivity`.

use icp_registration::IcpResult;
use nalgebra::Isometry3;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame};

use super::common::{Pinhole, disturbance, pose_error};
use super::depth_frames::dense_kitchen;
use super::projection;
use super::success::Pair;

/// Frames between the two of a real pair, and from one pair to the next.
const GAPS: [usize; 4] = [10, 20, 30, 60];
const STEP: usize = 13;
/// What counts as right on real frames: within this, or this share of the motion.
const RIGHT_M: f64 = 0.04;
const RIGHT_SHARE: f64 = 0.25;
/// Simulated pairs, and where they start.
const PAIRS: u64 = 60;
const START: (f64, f64) = (0.3, 20.0);

#[derive(Default)]
struct Counts {
    pairs: u32,
    right: u32,
    right_and_trusted: u32,
    wrong_and_trusted: u32,
}

impl Counts {
    fn add(
        &mut self,
        found: &Result<IcpResult, projective_registration::Error>,
        is_right: impl Fn(&Isometry3<f64>) -> bool,
    ) {
        let right = found.as_ref().is_ok_and(|found| is_right(&found.target_from_source));
        let trusted = found.as_ref().is_ok_and(IcpResult::is_trustworthy);
        self.pairs += 1;
        self.right += u32::from(right);
        self.right_and_trusted += u32::from(right && trusted);
        self.wrong_and_trusted += u32::from(!right && trusted);
    }

    fn print(&self, name: &str) {
        let Self { pairs, right, right_and_trusted, wrong_and_trusted } = self;
        println!(
            "{name}: {right} of {pairs} right, {right_and_trusted} of them trusted; {wrong_and_trusted} wrong trusted"
        );
    }
}

pub fn print() {
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    for (name, range) in [("real, first half", 0..250), ("real, second half", 250..500)] {
        match dense_kitchen(range) {
            Some(sequence) => real(&sequence, &mut aligner).print(name),
            None => println!("{name}: the frames are not there"),
        }
    }
    for (name, camera) in [("simulated 176x144", Pinhole::small()), ("simulated 224x172", Pinhole::medium())] {
        let projection = projection(&camera);
        let mut counts = Counts::default();
        for k in 0..PAIRS {
            let pair = Pair::new(&camera, &projection, k);
            let guess = pair.truth * disturbance(START.0, START.1, 40_000 + k);
            let found = aligner.align(&pair.source, &pair.target, &guess);
            counts.add(&found, |pose| {
                let (mm, degrees) = pose_error(pose, &pair.truth);
                mm < 30.0 && degrees < 1.0
            });
        }
        counts.print(name);
    }
}

fn real(sequence: &super::depth_frames::Sequence, aligner: &mut FrameAligner) -> Counts {
    let prepare = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap();
    let frames: Vec<OrganisedFrame> = sequence.frames.iter().map(|f| prepare(&f.points)).collect();
    let mut counts = Counts::default();
    for gap in GAPS {
        for a in (0..frames.len() - gap).step_by(STEP) {
            let truth = sequence.frames[a].world_from_camera.inverse() * sequence.frames[a + gap].world_from_camera;
            let found = aligner.align(&frames[a + gap], &frames[a], &Isometry3::identity());
            let moved = truth.translation.vector.norm();
            counts.add(&found, |pose| {
                let off = (pose.translation.vector - truth.translation.vector).norm();
                off < RIGHT_M.max(RIGHT_SHARE * moved)
            });
        }
    }
    counts
}
