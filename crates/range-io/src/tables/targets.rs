use std::path::Path;

use super::csv_table::{Columns, PlacedRows, Row, Table, texts, write};
use crate::Result;

/// One target: `targets.csv`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Target {
    /// Name.
    pub target: String,
    /// Position in metres.
    pub position_m: [f64; 3],
    /// Standard deviations in metres where the position is weighted control; `None` where it is an approximation.
    pub sigma_m: Option<[f64; 3]>,
}

const POSITION: [&str; 3] = ["x", "y", "z"];
const SIGMA: [&str; 3] = ["sigma_x", "sigma_y", "sigma_z"];
const COLUMNS: Columns =
    Columns { required: &["target", "x", "y", "z", "sigma_x", "sigma_y", "sigma_z"], optional: &[] };

/// Reads `targets.csv`. A target may stand in one row only.
pub fn read_targets(path: impl AsRef<Path>) -> Result<Vec<Target>> {
    Ok(read_placed_targets(path)?.rows)
}

/// Reads `targets.csv` and keeps the place of each row.
pub fn read_placed_targets(path: impl AsRef<Path>) -> Result<PlacedRows<Target>> {
    let table = Table::read(path.as_ref(), &COLUMNS)?;
    table.require_unique("target")?;
    table.placed(|row| {
        Ok(Target {
            target: row.text("target")?,
            position_m: row.all(POSITION)?,
            sigma_m: row.all_or_none(SIGMA, Row::positive)?,
        })
    })
}

/// Writes `targets.csv`.
pub fn write_targets(path: impl AsRef<Path>, targets: &[Target]) -> Result<()> {
    let rows = targets.iter().map(|target| {
        let name = [target.target.clone()];
        name.into_iter().chain(texts(Some(target.position_m))).chain(texts(target.sigma_m)).collect()
    });
    write(path.as_ref(), COLUMNS.required, rows)
}
