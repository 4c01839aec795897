//! Counts of a sequence held against the truth.

use live_frames::range_image::Flags;
use live_frames::{Limits, Processor};
use simulation::SimulatedFrame;

use super::{INTERVAL_S, Sequence, stages};

/// Shares of wrong counts, frame by frame: of all pixels with a true range, and of those that are not flagged.
#[derive(Debug, Default, Clone, Copy)]
pub struct Wrong {
    pub all: f64,
    pub sure: f64,
    pub unsure: f64,
    pub whole: bool,
    pub failed: f64,
}

/// A processor's counts, the whole frame solved every so many frames.
pub fn wrong(sequence: &Sequence, frames: &[SimulatedFrame], refresh: u32) -> Vec<Wrong> {
    let calibration = sequence.calibration();
    let mut processor = Processor::new(&sequence.camera(), &calibration, stages(refresh), Limits::default()).unwrap();
    let interval_m = sequence.camera().modulations[0].ambiguity_interval_m();
    let of_frame = |(number, frame): (usize, &SimulatedFrame)| {
        let found = processor.process(frame.raw.samples(), number as f64 * INTERVAL_S).unwrap();
        let (mut used, mut all, mut sure, mut bad) = (0, 0, 0, 0);
        let truth = frame.truth.range.as_slice().iter().zip(frame.truth.mixed.as_slice());
        for ((range, flags), (truth, mixed)) in found.range.as_slice().iter().zip(found.flags.as_slice()).zip(truth) {
            if truth.is_nan() || range.is_nan() || *mixed {
                continue;
            }
            let off = (f64::from(*range) - f64::from(*truth)).abs() > 0.5 * interval_m;
            let unsure = flags.contains(Flags::UNWRAP_UNSURE);
            used += 1;
            all += usize::from(off);
            sure += usize::from(!unsure);
            bad += usize::from(off && !unsure);
        }
        Wrong {
            all: all as f64 / f64::from(used),
            sure: bad as f64 / sure.max(1) as f64,
            unsure: 1.0 - sure as f64 / f64::from(used),
            whole: found.counts.whole.is_some(),
            failed: found.counts.failed as f64 / found.counts.used.max(1) as f64,
        }
    };
    frames.iter().enumerate().map(of_frame).collect()
}
