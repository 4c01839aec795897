use multiview_registration::StationRegistrationOptions;
use nalgebra::Isometry3;
use point_cloud::OrganisedNormalOptions;
use range_image::{Flags, RangeFrame};

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
    /// Its name, one of `RangeErrorModel::parameter_names`.
    pub name: String,
    /// Standard deviation of the value that the known model has, in the term's unit; infinite where it says nothing.
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
    /// A term whose effect on the ranges is known less well than this is refused, metre. Default 5 mm.
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

impl SurfaceCalibrationOptions<'_> {
    /// Positions of the terms among the model's parameters.
    pub(super) fn columns(&self, names: &[String]) -> Result<Vec<usize>> {
        if self.terms.is_empty() {
            return Err(Error::NothingToEstimate);
        }
        if !(self.largest_sigma_m > 0.0 && self.largest_sigma_m.is_finite()) {
            let (name, value) = ("largest_sigma_m", self.largest_sigma_m);
            return Err(Error::OutOfDomain { name, value, expected: "a positive length in metre" });
        }
        let mut columns = Vec::with_capacity(self.terms.len());
        for term in &self.terms {
            let Some(column) = names.iter().position(|name| *name == term.name) else {
                return Err(Error::UnknownName {
                    what: "the list of terms".to_owned(),
                    kind: "term",
                    name: term.name.clone(),
                    known: names.join(", "),
                });
            };
            if columns.contains(&column) {
                return Err(Error::DuplicateName { kind: "term", name: term.name.clone() });
            }
            if term.prior_sigma.is_nan() || term.prior_sigma <= 0.0 {
                let (name, value) = ("prior_sigma", term.prior_sigma);
                return Err(Error::OutOfDomain { name, value, expected: "positive; infinite where nothing is known" });
            }
            columns.push(column);
        }
        Ok(columns)
    }
}
