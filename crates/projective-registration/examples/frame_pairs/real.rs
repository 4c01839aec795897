//! Real frames of structured-light cameras: robustness, as their poses are good to millimetres only.

use nalgebra::Isometry3;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame};

use super::common::pose_error;
use super::depth_frames::{Sequence, kitchen, living_room};
use super::{measure, median};

pub fn print() {
    for (name, sequence) in [("kitchen", kitchen(25)), ("living room", living_room())] {
        match sequence {
            Some(sequence) => pairs(name, &sequence),
            None => println!("{name}: the frames are not there"),
        }
    }
}

fn pairs(name: &str, sequence: &Sequence) {
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let (mut good, mut times, mut distances) = (0, vec![], vec![]);
    for (k, pair) in sequence.frames.windows(2).enumerate() {
        let truth = pair[0].world_from_camera.inverse() * pair[1].world_from_camera;
        let (result, time) = measure::measured(|| {
            let target = OrganisedFrame::new(&sequence.projection, &pair[0].points, None).unwrap();
            let source = OrganisedFrame::new(&sequence.projection, &pair[1].points, None).unwrap();
            aligner.align(&source, &target, &Isometry3::identity())
        });
        times.push(time);
        let Ok(result) = result else {
            println!("{name} {k:2}: {result:?}");
            continue;
        };
        let (mm, degrees) = pose_error(&result.target_from_source, &truth);
        let moved = pose_error(&Isometry3::identity(), &truth);
        println!(
            "{name} {k:2}: {mm:6.1} mm {degrees:.2} deg of {:.0} mm {:.1} deg, {time:.1} ms, overlap {:.2}, rms {:.2} mm, \
             {} iterations, {:?}, undetermined {}",
            moved.0,
            moved.1,
            result.overlap,
            result.rms_m * 1e3,
            result.iterations,
            result.stop,
            result.degenerate.len()
        );
        distances.push(mm);
        good += u32::from(mm < 30.0 && degrees < 1.0);
    }
    println!(
        "{name}: {good} of {} within 30 mm and 1 deg, median {:.1} mm, {:.1} ms",
        sequence.frames.len() - 1,
        median(&mut distances),
        median(&mut times)
    );
}
