//! What comes too fast is dropped as whole frames.

use live_tasks::commands::{DoubtKind, Judged, Verdict};
use live_tasks::{FrameError, FrameSource, LiveFrame, LiveRequest, LiveSource, LiveStatus, LiveWatch, Next, live_from};

use crate::common::World;

/// A camera that waits for nobody.
struct Swift {
    frame: LiveFrame,
    left: u64,
}

impl FrameSource for Swift {
    fn next(&mut self, used: Option<LiveFrame>) -> Result<Next, FrameError> {
        if self.left == 0 {
            return Ok(Next::End);
        }
        self.left -= 1;
        self.frame.header.timestamp_s += 0.01;
        drop(used);
        Ok(Next::Frame(LiveFrame { arrived: std::time::Instant::now(), ..self.frame.clone() }))
    }
}

struct Last(Option<LiveStatus>);

impl LiveWatch for Last {
    fn status(&mut self, status: &LiveStatus) {
        self.0 = Some(status.clone());
    }
}

#[test]
fn frames_that_come_too_fast_are_dropped_and_counted() {
    const SENT: u64 = 3000;
    let world = World::new();
    let frame = world.frames().remove(0);
    let swift = || Box::new(Swift { frame: frame.clone(), left: SENT });
    let request = world.request(LiveSource::StandardInput);
    let mut last = Last(None);
    let summary = live_from(swift(), &LiveRequest { every_frame: false, ..request.clone() }, &mut last).unwrap();
    assert!(summary.dropped > 0, "{summary}");
    assert_eq!(summary.frames + summary.dropped, SENT, "{summary}");
    assert!(summary.refused.is_empty(), "{summary}");
    assert_eq!((summary.verdict(), summary.doubts()[0].kind), (Verdict::Doubtful, DoubtKind::DroppedFrames));
    let status = last.0.unwrap();
    assert_eq!((status.frames, status.dropped), (summary.frames, summary.dropped));
    assert!(status.to_string().contains(" dropped, 0 refused"), "{status}");

    // A source that has to wait loses nothing.
    let summary = live_from(swift(), &LiveRequest { frames: Some(50), ..request }, &mut ()).unwrap();
    assert_eq!((summary.frames, summary.dropped), (50, 0));
}
