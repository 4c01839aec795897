//! Vectors side by side.

use dense_matrices::transposed;

#[test]
fn twice_is_as_before() {
    let vectors = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    assert_eq!(transposed(&vectors, 3), [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    assert_eq!(transposed(&transposed(&vectors, 3), 2), vectors);
    assert_eq!(transposed(&vectors, 6), vectors);
    assert!(transposed(&[], 0).is_empty());
}
