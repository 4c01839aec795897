//! What each threshold of the verdict of alignments without a guess decides: right and wrong answers where it is moved.

use global_registration::{CoarseAlignment, CoarseOptions};

/// Options that refuse nothing, to see what verdicts rest on.
pub fn loose(options: &CoarseOptions) -> CoarseOptions {
    CoarseOptions {
        min_inside: 0.0,
        min_determined: 0.0,
        min_overlap: 0.0,
        // Nothing is less probable, and the quantiles stay finite.
        level: f64::MIN_POSITIVE,
        ..options.clone()
    }
}

/// A threshold by name: how far it is from letting everything pass, and how it is moved to a multiple of that.
type Threshold = (&'static str, fn(&mut CoarseOptions, f64));

const THRESHOLDS: &[Threshold] = &[
    ("min_overlap", |o, by| o.min_overlap *= by),
    ("level", |o, by| o.level *= by),
    ("min_inside", |o, by| o.min_inside *= by),
    ("1 - min_determined", |o, by| o.min_determined = 1.0 - (1.0 - o.min_determined) * by),
];

/// Prints right and wrong answers among alignments that nothing refused, with each threshold at multiples of its default.
pub fn print(name: &str, found: &[(CoarseAlignment, bool)]) {
    const MULTIPLES: [f64; 5] = [0.0, 0.5, 1.0, 1.5, 2.0];
    println!("{name}: right and wrong of {} answers where a threshold is multiplied", found.len());
    let head: Vec<String> = MULTIPLES.iter().map(|by| format!("{by:>10.1}")).collect();
    println!("{:20}{}", "", head.join(""));
    for (threshold, set) in THRESHOLDS {
        let cells: Vec<String> = MULTIPLES.iter().map(|by| cell(found, |options| set(options, *by))).collect();
        println!("{threshold:20}{}", cells.join(""));
    }
}

fn cell(found: &[(CoarseAlignment, bool)], change: impl Fn(&mut CoarseOptions)) -> String {
    let mut options = CoarseOptions::default();
    change(&mut options);
    let passes =
        |right: bool| found.iter().filter(|(pose, is)| *is == right && pose.clone().checked(&options).is_ok()).count();
    format!("{:>6}{:>4}", passes(true), passes(false))
}
