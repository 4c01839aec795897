use std::path::Path;

use super::csv_table::{Columns, Row, Table, text, write};
use crate::Result;

/// One observed value after an adjustment: `residuals.csv`. `None` where a figure does not exist.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Residual {
    /// Station, or first end of a distance.
    pub station: String,
    /// Target, or second end of a distance.
    pub target: String,
    /// What was observed: `col`, `row` (pixel), `range`, `distance` (metre), ...
    pub component: String,
    /// Observed value in the unit of the component.
    pub observed: Option<f64>,
    /// A-priori standard deviation, same unit.
    pub sigma: Option<f64>,
    /// Observed minus model, same unit.
    pub residual: Option<f64>,
    /// Redundancy number, 0 to 1.
    pub redundancy_number: Option<f64>,
    /// Residual over its standard deviation.
    pub standardised_residual: Option<f64>,
    /// Smallest gross error that the test would find, same unit as the observation.
    pub smallest_detectable: Option<f64>,
    /// What the test says: `used`, `rejected`, `uncontrolled`, `left_out`.
    pub verdict: String,
}

const COLUMNS: Columns = Columns {
    required: &[
        "station",
        "target",
        "component",
        "observed",
        "sigma",
        "residual",
        "redundancy_number",
        "standardised_residual",
        "smallest_detectable",
        "verdict",
    ],
    optional: &[],
};

/// Reads `residuals.csv`.
pub fn read_residuals(path: impl AsRef<Path>) -> Result<Vec<Residual>> {
    Ok(Table::read(path.as_ref(), &COLUMNS)?.placed(residual)?.rows)
}

fn residual(row: &Row) -> Result<Residual> {
    // Control and terms have one of the two names, or none.
    let name = |column: &str| if row.words(column)?.is_some() { row.text(column) } else { Ok(String::new()) };
    Ok(Residual {
        station: name("station")?,
        target: name("target")?,
        component: row.text("component")?,
        observed: row.number("observed")?,
        sigma: row.number("sigma")?,
        residual: row.number("residual")?,
        redundancy_number: row.number("redundancy_number")?,
        standardised_residual: row.number("standardised_residual")?,
        smallest_detectable: row.number("smallest_detectable")?,
        verdict: row.text("verdict")?,
    })
}

/// Writes `residuals.csv`; figures that are not finite become empty fields.
pub fn write_residuals(path: impl AsRef<Path>, residuals: &[Residual]) -> Result<()> {
    let finite = |value: Option<f64>| text(value.filter(|value| value.is_finite()));
    let rows = residuals.iter().map(|residual| {
        vec![
            residual.station.clone(),
            residual.target.clone(),
            residual.component.clone(),
            finite(residual.observed),
            finite(residual.sigma),
            finite(residual.residual),
            finite(residual.redundancy_number),
            finite(residual.standardised_residual),
            finite(residual.smallest_detectable),
            residual.verdict.clone(),
        ]
    });
    write(path.as_ref(), COLUMNS.required, rows)
}
