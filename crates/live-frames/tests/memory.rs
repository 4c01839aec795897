//! Nothing is allocated once the buffers have their sizes.

use live_frames::{Limits, Processor, Stages};

use crate::common::{INTERVAL_S, Sequence, stages};

/// Allocations of this thread while a processor works on frames `from..`, on one thread.
fn allocations(sequence: &Sequence, mut stages: Stages, frames: usize, from: usize) -> u64 {
    let calibration = sequence.calibration();
    let raw: Vec<_> = (0..frames).map(|number| sequence.frame(number).raw).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        // The small image is solved by the tree, which takes scratch for its segments and gives it back.
        stages.unwrap.carry.check_frames = 1000;
        let mut processor = Processor::new(&sequence.camera(), &calibration, stages, Limits::default()).unwrap();
        let mut run = |numbers: std::ops::Range<usize>| {
            for number in numbers {
                let frame = processor.process(raw[number].samples(), number as f64 * INTERVAL_S).unwrap();
                assert!(!frame.counts.checked && (frame.counts.whole.is_none() || number == 0), "{:?}", frame.counts);
            }
        };
        run(0..from);
        allocation_counter::measure(|| run(from..frames)).count_total
    })
}

#[test]
fn frames_with_one_frequency_allocate_nothing() {
    // Where nothing moves, no frame has to be checked before its time.
    let sequence = Sequence { still: true, ..Sequence::default() };
    assert_eq!(allocations(&sequence, stages(1000), 10, 2), 0);
}

#[test]
fn frames_with_two_frequencies_allocate_nothing() {
    let sequence = Sequence { modulation_hz: vec![80e6, 60e6], ..Sequence::default() };
    assert_eq!(allocations(&sequence, stages(1000), 6, 2), 0);
}

#[cfg(feature = "tracking")]
#[test]
fn frames_with_poses_allocate_nothing() {
    let sequence = Sequence { still: true, rays: 1, ..Sequence::default() };
    let stages = Stages { tracking: Some(live_frames::tracking::TrackerOptions::default()), ..stages(1000) };
    assert_eq!(allocations(&sequence, stages, 10, 2), 0);
}
