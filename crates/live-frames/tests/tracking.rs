//! The pose beside the points.

use live_frames::tracking::{TrackerOptions, TrackingState};
use live_frames::{Limits, Processor, Stages};

use crate::common::{INTERVAL_S, Sequence, stages};

#[test]
fn poses_follow_the_camera() {
    let sequence = Sequence { rays: 1, ..Sequence::default() };
    let frames: Vec<_> = (0..12).map(|number| sequence.frame(number)).collect();
    let options = TrackerOptions::default();
    let stages = Stages { tracking: Some(options), ..stages(100) };
    let mut processor = Processor::new(sequence.camera(), &sequence.calibration(), stages, Limits::default()).unwrap();
    let world_from_first = frames[0].truth.world_from_camera;
    for (number, frame) in frames.iter().enumerate() {
        let found = processor.process(frame.raw.samples(), number as f64 * INTERVAL_S).unwrap();
        let pose = found.pose.as_ref().unwrap();
        if number == 0 {
            assert_eq!(pose.state, TrackingState::Started);
            continue;
        }
        assert!(pose.state.has_pose(), "{number}: {:?}", pose.state);
        let truth = world_from_first.inverse() * frame.truth.world_from_camera;
        let off_m = (truth.inverse() * pose.world_from_camera).translation.vector.norm();
        // Noise of a centimetre a pixel at 128 x 96 pixels.
        assert!(off_m < 0.03, "frame {number}: {off_m} m");
    }
}
