//! Counts over moving sequences against the truth, beside those of the tree on every frame.

use live_frames::{Limits, Processor};
use simulation::SimulatedFrame;

use crate::common::{INTERVAL_S, Sequence, stages};

/// Shares of wrong counts, frame by frame: of all pixels with a true range, and of those that are not flagged.
#[derive(Debug, Default, Clone, Copy)]
struct Wrong {
    all: f64,
    sure: f64,
    unsure: f64,
    whole: bool,
    failed: f64,
}

fn wrong(sequence: &Sequence, frames: &[SimulatedFrame], refresh: u32) -> Vec<Wrong> {
    let calibration = sequence.calibration();
    let mut processor = Processor::new(sequence.camera(), &calibration, stages(refresh), Limits::default()).unwrap();
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
            let unsure = flags.contains(live_frames::range_image::Flags::UNWRAP_UNSURE);
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

fn mean(values: &[Wrong], of: impl Fn(&Wrong) -> f64) -> f64 {
    values.iter().map(of).sum::<f64>() / values.len() as f64
}

#[test]
fn carried_counts_are_no_worse_than_those_of_the_tree() {
    let sequence = Sequence { rays: 1, ..Sequence::default() };
    let frames: Vec<_> = (0..60).map(|number| sequence.frame(number)).collect();
    let (tree, carried) = (wrong(&sequence, &frames, 1), wrong(&sequence, &frames, 30));
    for (number, (tree, carried)) in tree.iter().zip(&carried).enumerate() {
        println!("{number} tree {:.4} {:.4} {:.3} carried {:.4} {:.4} {:.3} {} failed {:.4}", tree.all, tree.sure, tree.unsure, carried.all, carried.sure, carried.unsure, carried.whole, carried.failed);
    }
    let (of_tree, of_carried) = (mean(&tree, |wrong| wrong.all), mean(&carried, |wrong| wrong.all));
    // A pixel in a thousand is what single frames differ by.
    assert!(of_carried <= of_tree + 1e-3, "{of_carried} carried, {of_tree} by the tree");
    let (of_tree, of_carried) = (mean(&tree, |wrong| wrong.sure), mean(&carried, |wrong| wrong.sure));
    assert!(of_carried <= of_tree + 1e-3, "{of_carried} carried and sure, {of_tree} by the tree");
    assert!(carried.iter().filter(|wrong| wrong.whole).count() <= 3, "counts are carried");
}
