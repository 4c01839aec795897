//! Vectors side by side, so that one pass over a matrix serves all of them.

/// Vectors of `length` one after another, brought side by side: element i of all of them, then element i + 1. Vectors
/// side by side are brought back by their number in the place of `length`.
pub fn transposed(vectors: &[f64], length: usize) -> Vec<f64> {
    let count = vectors.len() / length.max(1);
    if count <= 1 || length <= 1 {
        return vectors.to_vec();
    }
    let element = |i: usize| vectors.iter().skip(i).step_by(length).take(count);
    (0..length).flat_map(element).copied().collect()
}
