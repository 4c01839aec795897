//! Images blurred step by step, octave by octave.

/// Scales an octave is divided into.
pub(super) const SCALES: usize = 3;
/// Blur of the first image of an octave, pixels.
const FIRST_SIGMA: f32 = 1.6;
/// Blur that the camera itself is taken to have, pixels.
const CAMERA_SIGMA: f32 = 0.5;
/// Octaves end before an edge gets shorter than this, pixels.
pub(super) const SHORTEST_EDGE: usize = 16;

/// An image, row by row.
#[derive(Debug, Clone)]
pub(super) struct Image {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Image {
    pub fn at(&self, column: usize, row: usize) -> f32 {
        self.values[row * self.width + column]
    }

    /// Difference quotients along columns and rows; the pixel must not lie on the border.
    pub(super) fn gradient(&self, column: usize, row: usize) -> [f32; 2] {
        [
            0.5 * (self.at(column + 1, row) - self.at(column - 1, row)),
            0.5 * (self.at(column, row + 1) - self.at(column, row - 1)),
        ]
    }

    fn blurred(&self, sigma: f32) -> Self {
        let reach = (3.0 * sigma).ceil() as usize;
        let mut kernel: Vec<f32> = (0..=reach).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp()).collect();
        let sum = 2.0 * kernel.iter().sum::<f32>() - kernel[0];
        for value in &mut kernel {
            *value /= sum;
        }
        self.along_rows(&kernel).along_columns(&kernel)
    }

    fn along_rows(&self, kernel: &[f32]) -> Self {
        let reach = kernel.len() - 1;
        let mut values = Vec::with_capacity(self.values.len());
        let mut padded = vec![0.0; self.width + 2 * reach];
        for row in self.values.chunks_exact(self.width) {
            // The border's value goes on outside.
            padded[..reach].fill(row[0]);
            padded[reach..reach + self.width].copy_from_slice(row);
            padded[reach + self.width..].fill(row[self.width - 1]);
            values.extend((reach..reach + self.width).map(|c| {
                let pairs = kernel.iter().enumerate().skip(1);
                pairs.fold(kernel[0] * padded[c], |sum, (k, weight)| sum + weight * (padded[c - k] + padded[c + k]))
            }));
        }
        Self { values, ..*self }
    }

    fn along_columns(&self, kernel: &[f32]) -> Self {
        let mut values = vec![0.0_f32; self.values.len()];
        for (row, out) in values.chunks_exact_mut(self.width).enumerate() {
            for (k, weight) in kernel.iter().enumerate() {
                let rows = [row.saturating_sub(k), (row + k).min(self.height - 1)];
                for &source in &rows[..if k == 0 { 1 } else { 2 }] {
                    let source = &self.values[source * self.width..(source + 1) * self.width];
                    for (total, value) in out.iter_mut().zip(source) {
                        *total += weight * value;
                    }
                }
            }
        }
        Self { values, ..*self }
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let values = (0..width * height).map(|i| self.at(2 * (i % width), 2 * (i / width))).collect();
        Self { width, height, values }
    }

    fn minus(&self, other: &Self) -> Self {
        let values = self.values.iter().zip(&other.values).map(|(a, b)| a - b).collect();
        Self { values, ..*self }
    }
}

/// Images of all octaves and the differences of neighbours in scale.
pub(super) struct ScaleSpace {
    /// Per octave `SCALES + 3` images.
    pub(super) blurred: Vec<Vec<Image>>,
    /// Per octave `SCALES + 2` differences.
    pub(super) differences: Vec<Vec<Image>>,
}

impl ScaleSpace {
    pub(super) fn new(image: &Image) -> Self {
        let mut first = image.blurred((FIRST_SIGMA * FIRST_SIGMA - CAMERA_SIGMA * CAMERA_SIGMA).sqrt());
        let (mut blurred, mut differences) = (Vec::new(), Vec::new());
        while first.width.min(first.height) >= SHORTEST_EDGE {
            let mut octave = vec![first];
            for scale in 1..SCALES + 3 {
                // Blurs add as squares.
                let step = (sigma_of(scale as f32).powi(2) - sigma_of(scale as f32 - 1.0).powi(2)).sqrt();
                octave.push(octave[scale - 1].blurred(step));
            }
            differences.push(octave.windows(2).map(|pair| pair[1].minus(&pair[0])).collect());
            first = octave[SCALES].halved();
            blurred.push(octave);
        }
        Self { blurred, differences }
    }
}

/// Blur at a scale of an octave, in its pixels.
pub(super) fn sigma_of(scale: f32) -> f32 {
    FIRST_SIGMA * (scale / SCALES as f32).exp2()
}
