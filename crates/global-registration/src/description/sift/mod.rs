//! Keypoints of the amplitude image `[Lowe2004]`, lifted into space by the range.
//!
//! The amplitude falls with the square of the range; the logarithm of amplitude times squared range is what the surface
//! reflects up to its slant, so that the same mark looks the same from near and far.

mod describe;
mod extrema;
mod scale_space;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::description::features::Features;
use crate::error::Result;
use describe::{descriptor, orientations};
use extrema::{Keypoint, extrema};
use rigid_pose::{InputError, is_usable, require_count, require_length, require_positive};
use scale_space::{Image, SHORTEST_EDGE, ScaleSpace};

/// Options of [`amplitude_features`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeFeatureOptions {
    /// Smallest contrast of a keypoint: difference of the logarithms between two scales. Default 0.02: two percent.
    pub min_contrast: f64,
    /// Largest ratio of the curvatures across and along: edges are badly placed along themselves. Default 10.
    pub max_edge_ratio: f64,
    /// Most features, those of highest contrast. Default 1000.
    pub max_features: usize,
}

impl Default for AmplitudeFeatureOptions {
    fn default() -> Self {
        Self { min_contrast: 0.02, max_edge_ratio: 10.0, max_features: 1000 }
    }
}

impl AmplitudeFeatureOptions {
    fn validate(&self) -> Result<()> {
        require_positive("min_contrast", self.min_contrast)?;
        require_positive("max_edge_ratio", self.max_edge_ratio)?;
        Ok(require_count("max_features", self.max_features, 1)?)
    }
}

/// Scale-invariant features of a frame's amplitude with their points in the camera frame.
///
/// `amplitude` (any unit) and `points` (metre, perspective centre at the origin, NaN without range): `width · height`
/// values, row by row. Pixels without range or positive amplitude take the value of the pixel before them and carry no
/// feature. The descriptors have 128 values.
///
/// # Errors
/// [`InputError::LengthMismatch`] where a plane does not fill the frame, [`InputError::InvalidOption`], [`InputError::TooFewPoints`]
/// for frames under 16 pixels or without a usable pixel.
pub fn amplitude_features(
    amplitude: &[f32],
    points: &[[f64; 3]],
    width: usize,
    height: usize,
    options: &AmplitudeFeatureOptions,
) -> Result<Features> {
    options.validate()?;
    let expected = width.saturating_mul(height);
    require_length("amplitude", expected, amplitude.len())?;
    require_length("points of the frame", expected, points.len())?;
    let (found, needed) = (width.min(height), SHORTEST_EDGE);
    if found < needed {
        return Err(InputError::TooFewPoints { what: "edge of the frame", found, needed }.into());
    }
    let space = ScaleSpace::new(&reflectance(amplitude, points, width, height)?);
    let mut keypoints = extrema(&space, options.min_contrast as f32, options.max_edge_ratio as f32);
    keypoints.retain(|keypoint| lifted(keypoint, points, width, height).is_some());
    keypoints.sort_by(|a, b| b.contrast.total_cmp(&a.contrast));
    keypoints.truncate(options.max_features);
    let described: Vec<Vec<[f32; 128]>> = keypoints
        .par_iter()
        .map(|k| orientations(&space, k).into_iter().map(|angle| descriptor(&space, k, angle)).collect())
        .collect();
    let (mut places, mut values) = (Vec::new(), Vec::new());
    for (keypoint, rows) in keypoints.iter().zip(described) {
        let Some(point) = lifted(keypoint, points, width, height) else { continue };
        for row in rows {
            places.push(point);
            values.extend(row);
        }
    }
    Features::new(places, &values, 128)
}

/// Logarithm of amplitude times squared range.
fn reflectance(amplitude: &[f32], points: &[[f64; 3]], width: usize, height: usize) -> Result<Image> {
    let value = |i: usize| {
        let squared: f64 = points[i].iter().map(|c| c * c).sum();
        let value = (f64::from(amplitude[i]) * squared).ln();
        (value.is_finite() && is_usable(&Point3::from(points[i]))).then_some(value as f32)
    };
    let first = (0..amplitude.len()).find_map(value);
    let Some(mut last) = first else {
        return Err(InputError::TooFewPoints { what: "pixels with amplitude and range", found: 0, needed: 1 }.into());
    };
    let values = (0..amplitude.len()).map(|i| {
        last = value(i).unwrap_or(last);
        last
    });
    Ok(Image { width, height, values: values.collect() })
}

/// The point of the pixel that the keypoint lies on.
fn lifted(keypoint: &Keypoint, points: &[[f64; 3]], width: usize, height: usize) -> Option<Point3<f64>> {
    let [column, row] = keypoint.position_px().map(f32::round);
    let inside = column >= 0.0 && row >= 0.0 && column < width as f32 && row < height as f32;
    let point = Point3::from(*points.get(row as usize * width + column as usize).filter(|_| inside)?);
    is_usable(&point).then_some(point)
}
