use std::path::Path;

use super::csv_table::{Columns, PlacedRows, Row, Table, text, texts, write};
use crate::{Error, Result};

/// One target seen from one station: `observations.csv`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TargetObservation {
    /// Station.
    pub station: String,
    /// Target.
    pub target: String,
    /// Image point `(col, row)` in pixels, `None` where it was not observed.
    pub pixel: Option<[f64; 2]>,
    /// Range in metres, `None` where it was not observed.
    pub range_m: Option<f64>,
    /// Standard deviations of column and row in pixels, `None` where they are not known.
    pub sigma_pixel: Option<[f64; 2]>,
    /// Standard deviation of the range in metres, `None` where it is not known.
    pub sigma_range_m: Option<f64>,
    /// Amplitude at the target in the camera's unit.
    pub amplitude: Option<f64>,
    /// Integration time in seconds.
    pub integration_time_s: Option<f64>,
}

const COLUMNS: Columns = Columns {
    required: &["station", "target", "col", "row", "range", "sigma_col", "sigma_row", "sigma_range"],
    optional: &["amplitude", "integration_time_s"],
};

/// Reads `observations.csv`. A row must observe an image point or a range.
pub fn read_observations(path: impl AsRef<Path>) -> Result<Vec<TargetObservation>> {
    Ok(read_placed_observations(path)?.rows)
}

/// Reads `observations.csv` and keeps the place of each row.
pub fn read_placed_observations(path: impl AsRef<Path>) -> Result<PlacedRows<TargetObservation>> {
    Table::read(path.as_ref(), &COLUMNS)?.placed(observation)
}

fn observation(row: &Row) -> Result<TargetObservation> {
    let observation = TargetObservation {
        station: row.text("station")?,
        target: row.text("target")?,
        pixel: row.all_or_none(["col", "row"], Row::number)?,
        range_m: row.positive("range")?,
        sigma_pixel: row.all_or_none(["sigma_col", "sigma_row"], Row::positive)?,
        sigma_range_m: row.positive("sigma_range")?,
        amplitude: row.number("amplitude")?,
        integration_time_s: row.positive("integration_time_s")?,
    };
    if observation.pixel.is_none() && observation.range_m.is_none() {
        return Err(row.error("col", "is empty and so is `range`: the row observes nothing"));
    }
    Ok(observation)
}

/// Writes `observations.csv` with all columns.
pub fn write_observations(path: impl AsRef<Path>, observations: &[TargetObservation]) -> Result<()> {
    let header = [COLUMNS.required, COLUMNS.optional].concat();
    if let Some(index) = observations.iter().position(|o| o.pixel.is_none() && o.range_m.is_none()) {
        let field = format!("[{index}]");
        return Err(Error::Value { what: "observations", field, reason: "observes nothing".into() });
    }
    let rows = observations.iter().map(|observation| {
        let TargetObservation { station, target, pixel, range_m, sigma_pixel, sigma_range_m, .. } = observation;
        let [col, row] = texts(*pixel);
        let [sigma_col, sigma_row] = texts(*sigma_pixel);
        let names = [station.clone(), target.clone()];
        let measured = [col, row, text(*range_m), sigma_col, sigma_row, text(*sigma_range_m)];
        let further = [text(observation.amplitude), text(observation.integration_time_s)];
        names.into_iter().chain(measured).chain(further).collect()
    });
    write(path.as_ref(), &header, rows)
}
