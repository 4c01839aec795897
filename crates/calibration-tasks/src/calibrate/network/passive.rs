//! The passive camera of a joint setup: the sub-folder `passive`.

use std::path::Path;

use pipeline::survey::{Purpose, compatible};
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use range_io::survey::Survey;
use range_io::tables::read_placed_observations;
use self_calibration::{PassiveCamera, PassiveImagePoint};

use crate::calibrate::network::network_files::{Tables, refuse_repeats, sigma_pixel};
use crate::calibrate::request::TableDefaults;

/// Reads the folder; `None` where there is none. Its stations must be those of the range camera.
pub(crate) fn read_passive(
    folder: &Path,
    tables: &mut Tables,
    defaults: &TableDefaults,
) -> Result<Option<PassiveCamera>> {
    if !folder.is_dir() {
        return Ok(None);
    }
    let survey = Survey::read(folder)?;
    let path = folder.join(Calibration::FILE_NAME);
    if !path.is_file() {
        let message = "is missing: the passive camera of a joint setup is calibrated beforehand".to_owned();
        return Err(Error::Survey { path, message });
    }
    let calibration = Calibration::read(&path)?;
    let camera = compatible(&survey, &calibration, Purpose::Camera)?.camera;
    let covariance = Some(calibration.camera_covariance()?).filter(|covariance| covariance.amax() > 0.0);
    let image_points = image_points(folder, tables, defaults)?;
    Ok(Some(PassiveCamera { camera, covariance, range_camera_from_passive: None, image_points }))
}

fn image_points(folder: &Path, tables: &mut Tables, defaults: &TableDefaults) -> Result<Vec<PassiveImagePoint>> {
    let rows = read_placed_observations(folder.join("observations.csv"))?;
    refuse_repeats(&rows)?;
    let mut points = Vec::with_capacity(rows.rows.len());
    for (index, row) in rows.rows.iter().enumerate() {
        let station = tables.stations.iter().position(|station| station.name == row.station).ok_or_else(|| {
            let reason = format!("`{}` is no station of the range camera's observations.csv", row.station);
            rows.error(index, "station", reason)
        })?;
        let Some(pixel) = row.pixel else {
            return Err(rows.error(index, "col", "is empty, expected the image point").into());
        };
        if row.range_m.is_some() {
            return Err(rows.error(index, "range", "is given, but a passive camera observes none").into());
        }
        let target = tables.target(&row.target);
        points.push(PassiveImagePoint { station, target, pixel, sigma_pixel: sigma_pixel(&rows, index, defaults)? });
    }
    Ok(points)
}
