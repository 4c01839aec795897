//! Counts over moving sequences against the truth, beside those of the tree on every frame.

use crate::common::Sequence;
use crate::common::judge::{Wrong, wrong};

fn mean(values: &[Wrong], of: impl Fn(&Wrong) -> f64) -> f64 {
    values.iter().map(of).sum::<f64>() / values.len() as f64
}

#[test]
fn carried_counts_are_no_worse_than_those_of_the_tree() {
    let sequence = Sequence { rays: 1, ..Sequence::default() };
    let frames: Vec<_> = (0..60).map(|number| sequence.frame(number)).collect();
    let (tree, carried) = (wrong(&sequence, &frames, 1), wrong(&sequence, &frames, 30));
    let (of_tree, of_carried) = (mean(&tree, |wrong| wrong.all), mean(&carried, |wrong| wrong.all));
    // A pixel in a thousand is what single frames differ by.
    assert!(of_carried <= of_tree + 1e-3, "{of_carried} carried, {of_tree} by the tree");
    let (of_tree, of_carried) = (mean(&tree, |wrong| wrong.sure), mean(&carried, |wrong| wrong.sure));
    assert!(of_carried <= of_tree + 1e-3, "{of_carried} carried and sure, {of_tree} by the tree");
    assert!(carried.iter().filter(|wrong| wrong.whole).count() <= 3, "counts are carried");
}
