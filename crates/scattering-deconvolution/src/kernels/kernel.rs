//! Sampled point spread functions.

use crate::kernels::blobs::{Blob, Kernel};
use crate::{Error, GaussianTerm, Psf, Result};

/// Half width, in standard deviations, at which sampled Gaussians end. What lies beyond, on either side of either
/// axis, is 1.3e-4 of the term's weight.
pub const GAUSSIAN_CUT_SIGMAS: f64 = 4.0;

/// A point spread function sampled at whole pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledKernel {
    /// Largest offset from the centre along a row and along a column.
    pub half_width: [usize; 2],
    /// `(2 half_width[0] + 1) * (2 half_width[1] + 1)` values, row by row.
    pub values: Vec<f64>,
}

impl SampledKernel {
    /// Offsets `(columns, rows)` and values, row by row.
    pub fn entries(&self) -> impl Iterator<Item = ([isize; 2], f64)> {
        let [half_cols, half_rows] = self.half_width.map(|half| half as isize);
        let offsets = (-half_rows..=half_rows).flat_map(move |row| (-half_cols..=half_cols).map(move |col| [col, row]));
        offsets.zip(self.values.iter().copied())
    }
}

impl Psf {
    /// Samples the point spread function out to `max_half_width` (along a row and along a column) at most: two pixels of
    /// an image of W columns are never farther apart than W - 1.
    ///
    /// A Gaussian term is `exp(-(dc^2 / 2 sc^2 + dr^2 / 2 sr^2))` at whole offsets, normalised so that its samples over
    /// the infinite plane sum to its weight, and ends at [`GAUSSIAN_CUT_SIGMAS`].
    ///
    /// # Errors
    /// A point spread function that changes over the field or has ghosts has no such kernel.
    pub fn sample(&self, max_half_width: [usize; 2]) -> Result<SampledKernel> {
        self.validate()?;
        Ok(match self {
            Self::Gaussians(terms) => sample_gaussians(terms, max_half_width),
            Self::Kernel { width, height, values } => crop([*width, *height], values, max_half_width),
            Self::Composite(composite) if composite.is_sum_of_gaussians() => {
                sample_gaussians(&composite.stationary, max_half_width)
            }
            Self::Composite(_) => return Err(Error::NotStationary { what: "a sampled kernel" }),
        })
    }
}

fn sample_gaussians(terms: &[GaussianTerm], max_half_width: [usize; 2]) -> SampledKernel {
    let blobs: Vec<Blob> = terms.iter().map(Blob::from).collect();
    let kernel = Kernel::of_blobs(&blobs, max_half_width);
    let half_width = kernel.first.map(isize::unsigned_abs);
    SampledKernel { half_width, values: kernel.values.iter().map(|value| value.re).collect() }
}

/// The middle of a kernel.
fn crop(size: [usize; 2], values: &[f64], max_half_width: [usize; 2]) -> SampledKernel {
    let half_width = [0, 1].map(|axis| (size[axis] / 2).min(max_half_width[axis]));
    let [skipped_cols, skipped_rows] = [0, 1].map(|axis| size[axis] / 2 - half_width[axis]);
    let rows = values.chunks_exact(size[0]).skip(skipped_rows).take(2 * half_width[1] + 1);
    let values = rows.flat_map(|row| &row[skipped_cols..=skipped_cols + 2 * half_width[0]]).copied().collect();
    SampledKernel { half_width, values }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn samples_of_gaussians_sum_to_the_weight() {
        for sigma_px in [[0.2, 0.9], [1.3, 2.0], [5.0, 1.9], [30.0, 11.0]] {
            let psf = Psf::Gaussians(vec![GaussianTerm { weight: 0.07, sigma_px }]);
            let kernel = psf.sample([1000, 1000]).unwrap();
            // Cut at four standard deviations: 1.3e-4 may be missing.
            let sum: f64 = kernel.values.iter().sum();
            assert!((sum / 0.07 - 1.0).abs() < 1.5e-4, "{sigma_px:?}: {sum}");
            let moment: f64 = kernel.entries().map(|([col, _], value)| (col * col) as f64 * value).sum::<f64>() / sum;
            // Sampling and cutting change the second moment by 1 % at sigma 0.9 and above.
            assert!(sigma_px[0] < 0.9 || (moment / sigma_px[0].powi(2) - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn kernels_are_cropped_about_their_centre() {
        let psf = Psf::Kernel { width: 5, height: 3, values: (0..15).map(f64::from).collect() };
        let kernel = psf.sample([1, 0]).unwrap();
        assert_eq!(kernel.half_width, [1, 0]);
        assert_eq!(kernel.values.iter().map(|v| *v as i32).collect::<Vec<_>>(), [6, 7, 8]);
        let all = psf.sample([9, 9]).unwrap();
        assert_eq!(all.half_width, [2, 1]);
        assert_eq!(all.entries().next().map(|(offset, _)| offset), Some([-2, -1]));
    }
}
