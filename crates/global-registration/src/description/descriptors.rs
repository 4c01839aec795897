//! Descriptors as rows of unit length: the larger the product of two, the more alike.

/// Rows of one length, each a unit vector or zero.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DescriptorTable {
    width: usize,
    values: Vec<f32>,
}

impl DescriptorTable {
    /// From histograms: the root of a histogram's bins as a vector has the length 1, and the distance of two such
    /// vectors is Hellinger's, which full bins dominate less than with the difference of counts.
    pub(crate) fn of_histograms(mut values: Vec<f32>, width: usize) -> Self {
        for row in values.chunks_exact_mut(width) {
            let sum: f32 = row.iter().sum();
            let scale = if sum > 0.0 && sum.is_finite() { 1.0 / sum } else { 0.0 };
            for value in row {
                *value = (*value * scale).sqrt();
            }
        }
        Self { width, values }
    }

    /// From vectors of any length.
    pub(crate) fn of_vectors(mut values: Vec<f32>, width: usize) -> Self {
        for row in values.chunks_exact_mut(width) {
            let length = row.iter().map(|v| v * v).sum::<f32>().sqrt();
            let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
            for value in row {
                *value *= scale;
            }
        }
        Self { width, values }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len() / self.width
    }

    pub(crate) fn row(&self, index: usize) -> &[f32] {
        &self.values[index * self.width..(index + 1) * self.width]
    }

    /// Whether the point has a descriptor.
    pub(crate) fn is_known(&self, index: usize) -> bool {
        self.row(index).iter().any(|v| *v != 0.0)
    }

    pub(crate) fn selected(&self, indices: &[u32]) -> Self {
        let values = indices.iter().flat_map(|&i| self.row(i as usize)).copied().collect();
        Self { width: self.width, values }
    }

    /// The rows that differ most from the mean of all, in their order; ties go to the lower index.
    pub(crate) fn most_distinctive(&self, count: usize) -> Vec<u32> {
        let mut mean = vec![0.0_f32; self.width];
        for row in self.values.chunks_exact(self.width) {
            for (total, value) in mean.iter_mut().zip(row) {
                *total += value;
            }
        }
        let mut ranked: Vec<(f32, u32)> = (0..self.len())
            .filter(|&i| self.is_known(i))
            .map(|i| (self.row(i).iter().zip(&mean).map(|(a, b)| a * b).sum(), i as u32))
            .collect();
        let by_rank = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if ranked.len() > count {
            ranked.select_nth_unstable_by(count, by_rank);
            ranked.truncate(count);
        }
        let mut indices: Vec<u32> = ranked.into_iter().map(|r| r.1).collect();
        indices.sort_unstable();
        indices
    }
}
