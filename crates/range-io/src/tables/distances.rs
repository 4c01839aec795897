use std::path::Path;

use super::csv_table::{Columns, PlacedRows, Row, Table, text, write};
use crate::Result;

/// A distance known from outside: `distances.csv`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Distance {
    /// One end: a station's perspective centre or a target.
    pub from: String,
    /// The other end.
    pub to: String,
    /// Distance in metres.
    pub distance_m: f64,
    /// Its standard deviation in metres.
    pub sigma_m: f64,
}

const COLUMNS: Columns = Columns { required: &["from", "to", "distance", "sigma_distance"], optional: &[] };

/// Reads `distances.csv`. Distance and standard deviation are positive, and an end is not its own other end.
pub fn read_distances(path: impl AsRef<Path>) -> Result<Vec<Distance>> {
    Ok(read_placed_distances(path)?.rows)
}

/// Reads `distances.csv` and keeps the place of each row.
pub fn read_placed_distances(path: impl AsRef<Path>) -> Result<PlacedRows<Distance>> {
    Table::read(path.as_ref(), &COLUMNS)?.placed(distance)
}

fn distance(row: &Row) -> Result<Distance> {
    let needed = |column: &str| {
        let value = row.positive(column)?;
        value.ok_or_else(|| row.error(column, "is empty, expected a positive number"))
    };
    let distance = Distance {
        from: row.text("from")?,
        to: row.text("to")?,
        distance_m: needed("distance")?,
        sigma_m: needed("sigma_distance")?,
    };
    if distance.from == distance.to {
        return Err(row.error("to", format!("is `{}` like `from`, expected another end", distance.to)));
    }
    Ok(distance)
}

/// Writes `distances.csv`.
pub fn write_distances(path: impl AsRef<Path>, distances: &[Distance]) -> Result<()> {
    let rows = distances.iter().map(|distance| {
        let Distance { from, to, distance_m, sigma_m } = distance;
        vec![from.clone(), to.clone(), text(Some(*distance_m)), text(Some(*sigma_m))]
    });
    write(path.as_ref(), COLUMNS.required, rows)
}
