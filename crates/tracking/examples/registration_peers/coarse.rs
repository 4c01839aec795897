//! Pairs without a guess.

use std::path::Path;

use global_registration::{CoarseOptions, FeatureCloud, align_without_guess};

use crate::Outcome;
use crate::files::Frames;
use crate::pairs::{cloud, compare};

/// What counts as a good pair: degrees and millimetres.
const LIMITS: [f64; 2] = [5.0, 100.0];

pub fn run(folder: &Path) -> Outcome {
    let frames = Frames::open(folder)?;
    let pairs: Vec<[usize; 2]> = frames.pairs(2).collect();
    let options = CoarseOptions::default();
    compare("coarse", &frames, &pairs, LIMITS, |target, source| {
        let [target, source] = [target, source].map(|points| FeatureCloud::new(&cloud(points), &options));
        Ok(align_without_guess(&source?, &target?, &options)?.target_from_source)
    })
}
