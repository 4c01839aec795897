//! Vectors side by side, so that one pass over a matrix serves all of them.

/// Vectors of `length` one after another, brought side by side: element i of all of them, then element i + 1. Vectors
/// side by side are brought back by their number in the place of `length`.
pub(crate) fn transposed(vectors: &[f64], length: usize) -> Vec<f64> {
    let count = vectors.len() / length.max(1);
    if count <= 1 || length <= 1 {
        return vectors.to_vec();
    }
    let element = |i: usize| vectors.iter().skip(i).step_by(length).take(count);
    (0..length).flat_map(element).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::transposed;

    #[test]
    fn twice_is_as_before() {
        let vectors = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(transposed(&vectors, 3), [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
        assert_eq!(transposed(&transposed(&vectors, 3), 2), vectors);
        assert_eq!(transposed(&vectors, 6), vectors);
        assert!(transposed(&[], 0).is_empty());
    }
}
