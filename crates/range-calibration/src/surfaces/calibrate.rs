use camera_model::Camera;
use error_models::RangeErrorModel;
use multiview_registration::{Datum, SharedParameters, Start, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;

use super::pixels::StationPixels;
use super::point_model::RangeTermModel;
use super::{SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture};
use crate::{Error, Result};

/// Estimates range terms of one modulation frequency together with the poses of all stations, from the surfaces that
/// they see in common.
///
/// `camera` is held, and of `known` the terms that are not named in the options; those named start from its values. The
/// stations are registered twice: first with the known model, then, from there, with the terms as unknowns.
/// `progress(done, total)` is told the steps of each.
///
/// # Errors
/// [`Error::SurfacesNotDetermined`] where the surfaces leave a term open: the poses take its place, as with a single
/// wall. [`Error::SurfacesNotSettled`] where the stations still slide at the end. [`Error::UnknownName`] for a term that
/// `known` does not have; [`Error::Registration`] where the stations do not come together; [`Error::OutOfDomain`], [`Error::Image`] for the input; [`Error::Model`] if the estimated terms are no
/// usable model.
pub fn calibrate_surfaces(
    captures: &[SurfaceCapture<'_>],
    camera: &Camera,
    known: &RangeErrorModel,
    datum: Datum,
    options: &SurfaceCalibrationOptions<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<SurfaceCalibration> {
    known.validate()?;
    camera.validate()?;
    let columns = options.columns(&known.parameter_names())?;
    let (mut stations, mut clouds) = (Vec::new(), Vec::new());
    for capture in captures {
        let (pixels, cloud) = StationPixels::new(capture, camera, known, &columns, options)?;
        stations.push(pixels);
        clouds.push(cloud);
    }
    let values = known.parameter_values();
    let start = columns.iter().map(|&column| values[column]).collect();
    let model = RangeTermModel { terms: &options.terms, start, stations };
    let all = |error| Error::registration("all stations", error);
    let without = StationRegistrationOptions { model: None, ..options.registration.clone() };
    let approximate: Option<Vec<Isometry3<f64>>> = captures.iter().map(|capture| capture.world_from_camera).collect();
    let first = approximate.as_ref().map_or(Start::Order, |poses| Start::Poses(poses));
    let before = register_stations(&clouds, first, datum, &without, progress).map_err(all)?;
    let with = StationRegistrationOptions { model: Some(&model), ..options.registration.clone() };
    let poses = Start::Poses(&before.world_from_station);
    let after = register_stations(&clouds, poses, datum, &with, progress).map_err(all)?;
    let Some(shared) = &after.parameters else { return Err(Error::NothingToEstimate) };
    require_determined(shared, &model, options)?;
    if !(before.settled && after.settled) {
        return Err(Error::SurfacesNotSettled { rounds: [before.rounds, after.rounds] });
    }
    let mut adjusted = known.clone();
    let mut adjusted_values = values;
    for (&column, value) in columns.iter().zip(&shared.values) {
        adjusted_values[column] = *value;
    }
    adjusted.set_parameter_values(&adjusted_values)?;
    adjusted.validate()?;
    SurfaceCalibration::new(adjusted, before, after)
}

/// Refuses a term whose effect on the ranges the surfaces leave open.
fn require_determined(
    shared: &SharedParameters,
    model: &RangeTermModel<'_>,
    options: &SurfaceCalibrationOptions<'_>,
) -> Result<()> {
    let sigma_m = shared.sigma().into_iter().zip(model.effects()).map(|(sigma, effect)| sigma * effect);
    let worst = sigma_m.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    match worst {
        // NaN is not determined either.
        Some((index, sigma_m)) if sigma_m.is_nan() || sigma_m > options.largest_sigma_m => {
            let (station, component, correlation) = shared.largest_pose_correlation[index];
            Err(Error::SurfacesNotDetermined {
                term: shared.names[index].clone(),
                sigma_m,
                limit_m: options.largest_sigma_m,
                station,
                motion: if component < 3 { "position" } else { "attitude" },
                correlation,
            })
        }
        _ => Ok(()),
    }
}
