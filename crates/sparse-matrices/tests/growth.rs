//! How the work grows with the network.

use crate::networks::corridors;

#[test]
fn the_work_grows_with_the_number_of_stations() {
    let of = |count: usize| {
        let matrix = corridors(count, 20);
        let factor = matrix.factor().unwrap();
        (factor.filled() as f64, matrix.multiplications(), (matrix.order() as f64).powi(3) / 6.0)
    };
    let (small, large) = (of(400), of(1600));
    // Four times as many stations: four times the fill and the work of corridors of one length, half as much again for the
    // logarithm of an order that is found greedily. A dense factor would be filled 16 times as much, at 64 times the work.
    assert!(large.0 < 6.0 * small.0, "{} {}", small.0, large.0);
    assert!(large.1 < 8.0 * small.1, "{} {}", small.1, large.1);
    assert!(large.1 < 1e-2 * large.2, "{} {}", large.1, large.2);
}
