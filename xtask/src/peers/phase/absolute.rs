//! Absolute counts at one frequency. No other program gives them.

use super::Stage;
use crate::peers::table::{Bars, head, row};
use crate::shell::Outcome;

const SEEDS: usize = 6;
const WAYS: [(&str, &str); 3] = [
    ("amplitude_1", "amplitude alone, one wrap at most"),
    ("amplitude_2", "amplitude alone, two wraps at most"),
    ("geometry_2", "amplitude and rays, two wraps at most"),
];

pub(super) fn run(stage: &Stage, bars: &mut Bars) -> Outcome {
    println!("── absolute counts");
    for (albedo, name) in [("plain", "albedo 0.3 to 0.9"), ("dark", "the same, a tenth of the patches at 0.05")] {
        let mut sums = [[0.0; 6]; WAYS.len()];
        for seed in 1..=SEEDS {
            let figures = stage.ours.call(&["absolute", albedo, "640", "480", &seed.to_string()])?;
            for (sums, (way, _)) in sums.iter_mut().zip(WAYS) {
                (0..5).for_each(|place| sums[place] += figures.get(way, place) / SEEDS as f64);
                sums[5] = figures.get(way, 3).max(sums[5]);
            }
        }
        head(&[
            &format!("absolute counts, {SEEDS} rooms of 640x480, {name}"),
            "right",
            "sure and right",
            "unknown",
            "wrong among the sure",
            "CPU ms",
            "wrong among the sure, worst room",
        ]);
        for (sums, (_, way)) in sums.iter().zip(WAYS) {
            row(way, sums);
        }
        bars.at_least(&format!("absolute counts with rays, right, {name}"), 0.92, sums[2][0]);
        bars.at_most(&format!("the same, wrong among the sure, {name}"), 0.03, sums[2][3]);
    }
    Ok(())
}
