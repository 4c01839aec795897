//! Where two calibrated cameras see the same direction.

use camera_model::{Camera, LensDistortion};
use nalgebra::DMatrix;

use super::{deviation, estimated, require_covariance, require_level, simultaneous_factor};
use crate::{Error, Result};

/// Columns and rows of the grid that is compared.
const PLACES: usize = 9;

/// Derivatives are taken over this part of each parameter's standard deviation: small against what curves, and large
/// against rounding.
const STEP: f64 = 1e-2;

/// A camera with the covariance of its calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageSide<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// Covariance of xp, yp, c, k1, k2, k3, p1, p2, b1, b2.
    pub covariance: DMatrix<f64>,
}

/// How far apart two cameras see the same direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageComparison {
    /// Largest shift, pixels.
    pub largest_px: f64,
    /// Column and row where it is.
    pub pixel: [f64; 2],
    /// Half the width there of the band that holds over the whole image at once, pixels.
    pub band_px: f64,
    /// Root mean square of the shift over the image, pixels.
    pub rms_px: f64,
    /// Largest shift along a column or row in units of its band.
    pub clearest: f64,
    /// Whether that is above 1.
    pub significant: bool,
}

/// Compares interior orientation and lens by what they do: the shift of a pixel's direction from the first camera to the
/// second, over the whole image, the pose being the same: a principal point and a small turn of the camera that
/// stand for each other are not set off against each other.
///
/// # Errors
/// [`Error::NotComparable`] for cameras of different formats; [`Error::Camera`] where a direction is not in the second
/// image; [`Error::OutOfDomain`] for covariance and level.
pub fn compare_images(first: &ImageSide<'_>, second: &ImageSide<'_>, level: f64) -> Result<ImageComparison> {
    require_level(level)?;
    for side in [first, second] {
        require_covariance(&side.covariance, 10)?;
    }
    let (format, other) = (first.camera.format, second.camera.format);
    if format != other {
        let needs = format!(
            "cameras of one format; these have {} x {} and {} x {} pixels",
            format.width, format.height, other.width, other.height
        );
        return Err(Error::NotComparable { comparison: "comparison of cameras", needs });
    }
    let names: Vec<String> = (0..10).map(|parameter: u8| parameter.to_string()).collect();
    let factor = simultaneous_factor(estimated([(&names, &first.covariance), (&names, &second.covariance)]), level);
    let place = |k: usize, size: usize| size.saturating_sub(1) as f64 * k as f64 / (PLACES - 1) as f64;
    let (mut found, mut squares) = (None::<ImageComparison>, 0.0);
    for (i, j) in (0..PLACES).flat_map(|i| (0..PLACES).map(move |j| (i, j))) {
        let pixel = [place(i, format.width), place(j, format.height)];
        let shift = shift(first.camera, second.camera, pixel)?;
        let gradients = [
            gradient(first, |camera| self::shift(camera, second.camera, pixel))?,
            gradient(second, |camera| self::shift(first.camera, camera, pixel))?,
        ];
        let bands = [0, 1].map(|axis| {
            let deviation = |side: &ImageSide<'_>, rows: &[Vec<f64>; 2]| deviation(&side.covariance, &rows[axis]);
            factor * deviation(first, &gradients[0]).hypot(deviation(second, &gradients[1]))
        });
        let length = shift[0].hypot(shift[1]);
        squares += length * length;
        let clearest = clarity(shift[0], bands[0]).max(clarity(shift[1], bands[1]));
        let band_px = bands[0].hypot(bands[1]);
        let here = ImageComparison { largest_px: length, pixel, band_px, rms_px: 0.0, clearest, significant: false };
        let best = found.get_or_insert(here);
        let clearest = clearest.max(best.clearest);
        if length > best.largest_px {
            *best = here;
        }
        best.clearest = clearest;
    }
    let found = found.ok_or(Error::OutOfDomain { name: "pixels", value: 0.0, expected: "an image" })?;
    let rms_px = (squares / (PLACES * PLACES) as f64).sqrt();
    Ok(ImageComparison { rms_px, significant: found.clearest > 1.0, ..found })
}

fn clarity(shift_px: f64, band_px: f64) -> f64 {
    /// What rounding leaves of equal cameras, pixels.
    const ROUNDING_PX: f64 = 1e-9;
    if shift_px.abs() <= ROUNDING_PX { 0.0 } else { shift_px.abs() / band_px }
}

/// Where the second camera sees the direction of the first one's pixel, less that pixel.
fn shift(first: &Camera, second: &Camera, pixel: [f64; 2]) -> Result<[f64; 2]> {
    let seen = second.project(&first.point(pixel, 1.0))?;
    Ok([seen[0] - pixel[0], seen[1] - pixel[1]])
}

/// Derivatives of a shift along columns and rows by the parameters that have a variance.
fn gradient(side: &ImageSide<'_>, shift: impl Fn(&Camera) -> Result<[f64; 2]>) -> Result<[Vec<f64>; 2]> {
    let mut rows = [vec![0.0; 10], vec![0.0; 10]];
    for parameter in 0..10 {
        let step = STEP * side.covariance[(parameter, parameter)].sqrt();
        if step > 0.0 {
            let [up, down] = [step, -step].map(|step| shift(&moved(side.camera, parameter, step)));
            let (up, down) = (up?, down?);
            for (row, (up, down)) in rows.iter_mut().zip(up.into_iter().zip(down)) {
                row[parameter] = (up - down) / (2.0 * step);
            }
        }
    }
    Ok(rows)
}

/// The camera with one of its ten parameters changed.
fn moved(camera: &Camera, parameter: usize, step: f64) -> Camera {
    let mut camera = *camera;
    match parameter {
        0 | 1 => camera.interior.principal_point_mm[parameter] += step,
        2 => camera.interior.principal_distance_mm += step,
        _ => {
            let mut coefficients = camera.lens.coefficients();
            coefficients[parameter - 3] += step;
            camera.lens = LensDistortion::from_coefficients(coefficients);
        }
    }
    camera
}
