//! From how many contradictions stations of many rooms are doubted.

use super::*;

#[test]
fn stations_of_many_rooms_are_doubted_beyond_their_scatter() {
    // Two stations each, of odds 0.02 and one thousandth of a square more.
    let pair = |j: usize| PairAgreement { target: 2 * j, source: 2 * j + 1, agreeing: 1000, contradicting: 20 + j * j };
    let from = |count: usize| {
        let pairs: Vec<PairAgreement> = (0..count / 2).map(pair).collect();
        doubtful_from(&Judges::new(vec![true; count], &pairs), count)
    };
    // Median 0.245, four fifths below 0.596: 1.702 standard deviations, 3.588 of which one in sixty leaves with 1 %.
    assert!((from(60) - 7.107).abs() < 0.01, "{}", from(60));
    assert!((from(40) - DOUBTED).abs() < 1e-12, "one room");
}
