use multiview_registration::StationRegistrationOptions;
use nalgebra::Isometry3;
use point_cloud::OrganisedNormalOptions;
use range_image::{Flags, RangeFrame};

use error_models::AmplitudeHyperbola;

use super::sensor_model::CAMERA_NAMES;
use crate::{Error, Result};

/// One frame of the scene.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceCapture<'a> {
    /// Name of the station, for messages.
    pub name: &'a str,
    /// Observed, unwrapped ranges: no term that is to be estimated has been taken off.
    pub frame: &'a RangeFrame,
    /// Approximate pose. Where one of them is missing, all are sought: neighbours in the list overlap.
    pub world_from_camera: Option<Isometry3<f64>>,
}

/// A term to estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceTerm {
    /// Its name: one of `RangeErrorModel::parameter_names`; `h1`, `h2` or `h3`, which are estimated together; or `xp`, `yp`, `c`,
    /// `k1`, `k2`, `k3`, `p1`, `p2`, `b1`, `b2`.
    pub name: String,
    /// Standard deviation of the value that the known model or camera has, in the term's unit; infinite where it says nothing.
    /// That of a hyperbola is not used.
    pub prior_sigma: f64,
}

impl SurfaceTerm {
    /// A term of which nothing is known beforehand.
    pub fn free(name: &str) -> Self {
        Self { name: name.to_owned(), prior_sigma: f64::INFINITY }
    }
}

/// Options of [`calibrate_surfaces`](super::calibrate_surfaces).
#[derive(Debug, Clone)]
pub struct SurfaceCalibrationOptions<'a> {
    /// Terms to estimate with the poses. Default: d0.
    pub terms: Vec<SurfaceTerm>,
    /// Pixels with one of these flags take no part. Default: all flags.
    pub exclude: Flags,
    /// How normals are found in a frame. Default: windows of seven pixels.
    pub normals: OrganisedNormalOptions,
    /// A combination of terms that moves points by more than this for a standard deviation is not determined, metre, and one of
    /// its terms is held. Default 5 mm: half of what cameras leave uncorrected, so that a calibration is worth more than none.
    pub largest_sigma_m: f64,
    /// How the stations are registered; a point model in it is not asked. Default: that of
    /// [`StationRegistrationOptions`].
    pub registration: StationRegistrationOptions<'a>,
}

impl Default for SurfaceCalibrationOptions<'_> {
    fn default() -> Self {
        Self {
            terms: vec![SurfaceTerm::free("d0")],
            exclude: Flags::all(),
            normals: OrganisedNormalOptions { half_width_px: 3, ..OrganisedNormalOptions::default() },
            largest_sigma_m: 5e-3,
            registration: StationRegistrationOptions::default(),
        }
    }
}

/// The terms asked for, by kind.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Asked<'a> {
    /// Terms of the range model and their positions among its parameters.
    pub(super) range: Vec<(usize, &'a SurfaceTerm)>,
    /// Whether the hyperbola is.
    pub(super) amplitude: bool,
    /// Parameters of the camera and their positions.
    pub(super) lens: Vec<(usize, &'a SurfaceTerm)>,
}

impl SurfaceCalibrationOptions<'_> {
    /// The terms by kind; `names`: those of the range model.
    pub(super) fn asked(&self, names: &[String]) -> Result<Asked<'_>> {
        if self.terms.is_empty() {
            return Err(Error::NothingToEstimate);
        }
        if !(self.largest_sigma_m > 0.0 && self.largest_sigma_m.is_finite()) {
            let (name, value) = ("largest_sigma_m", self.largest_sigma_m);
            return Err(Error::OutOfDomain { name, value, expected: "a positive length in metre" });
        }
        let mut asked = Asked { range: Vec::new(), amplitude: false, lens: Vec::new() };
        for (index, term) in self.terms.iter().enumerate() {
            if self.terms[..index].iter().any(|other| other.name == term.name) {
                return Err(Error::DuplicateName { kind: "term", name: term.name.clone() });
            }
            if term.prior_sigma.is_nan() || term.prior_sigma <= 0.0 {
                let (name, value) = ("prior_sigma", term.prior_sigma);
                return Err(Error::OutOfDomain { name, value, expected: "positive; infinite where nothing is known" });
            }
            if let Some(position) = names.iter().position(|name| *name == term.name) {
                asked.range.push((position, term));
            } else if let Some(position) = CAMERA_NAMES.iter().position(|name| *name == term.name) {
                asked.lens.push((position, term));
            } else if AmplitudeHyperbola::NAMES.contains(&term.name.as_str()) {
                asked.amplitude = true;
            } else {
                return Err(Error::UnknownName {
                    what: "the list of terms".to_owned(),
                    kind: "term",
                    name: term.name.clone(),
                    known: format!("{}, h1, h2, h3, {}", names.join(", "), CAMERA_NAMES.join(", ")),
                });
            }
        }
        Ok(asked)
    }
}
