//! Boxes near each other, against trying all.

use super::*;

#[test]
fn pairs_are_those_that_trying_all_finds() {
    let number = |k: usize| 20.0 * ((k * 7919 + 5) as f64 * 0.618_034).fract();
    let of = |k: usize| Extent::about(&Vector3::new(number(3 * k), number(3 * k + 1), 0.2 * number(3 * k + 2)), 0.5);
    let mut boxes: Vec<Extent> = (0..300).map(of).collect();
    boxes[7] = Extent::of(std::iter::empty());
    boxes[9] = Extent::about(&Vector3::zeros(), 100.0);
    let found = Extent::pairs(&boxes, 0.7);
    let all = (0..300).flat_map(|a| (a + 1..300).map(move |b| (a, b)));
    let expected: Vec<(usize, usize)> = all.filter(|&(a, b)| boxes[a].meets(&boxes[b], 0.7)).collect();
    assert!(expected.len() > 500 && expected.len() < 10_000, "{}", expected.len());
    assert_eq!(found, expected);
    assert!(!found.iter().any(|&(a, b)| a == 7 || b == 7), "nothing lies nowhere");
    assert!(Extent::pairs(&[], 1.0).is_empty());
}

#[test]
fn the_distance_of_boxes_counts_and_not_that_of_their_sides() {
    let [a, b] = [0.0, 2.0].map(|x| Extent::about(&Vector3::new(x, x, 0.0), 0.5));
    // One metre apart along both axes.
    assert!(!a.meets(&b, 1.4) && a.meets(&b, 1.42));
    assert!(a.is_near(&Vector3::new(1.5, 0.0, 0.0), 1.0) && !a.is_near(&Vector3::new(1.6, 0.0, 0.0), 1.0));
}
