use std::path::Path;

use super::csv_table::{Columns, PlacedRows, Row, Table, text, texts, write};
use crate::Result;

/// A plane in front of a station: `planes.csv`. Points `r` of the plane fulfil `nᵀ r = d`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ObservedPlane {
    /// Name of the plane; several stations may see the same one.
    pub plane: String,
    /// The station whose frames show it.
    pub station: String,
    /// Normal `n` in world axes, of any length but zero, and `d` in metres for that normal; `None` where the plane is not known.
    pub known: Option<([f64; 3], f64)>,
}

const NUMBERS: [&str; 4] = ["nx", "ny", "nz", "d"];
const COLUMNS: Columns = Columns { required: &["plane", "station", "nx", "ny", "nz", "d"], optional: &[] };

/// Reads `planes.csv`. The four numbers of a row are given all or none.
pub fn read_planes(path: impl AsRef<Path>) -> Result<Vec<ObservedPlane>> {
    Ok(read_placed_planes(path)?.rows)
}

/// Reads `planes.csv` and keeps the place of each row.
pub fn read_placed_planes(path: impl AsRef<Path>) -> Result<PlacedRows<ObservedPlane>> {
    Table::read(path.as_ref(), &COLUMNS)?.placed(plane)
}

fn plane(row: &Row) -> Result<ObservedPlane> {
    let numbers = row.all_or_none(NUMBERS, Row::number)?;
    if numbers.is_some_and(|[nx, ny, nz, _]| nx == 0.0 && ny == 0.0 && nz == 0.0) {
        return Err(row.error("nx", "is 0 like `ny` and `nz`, expected a direction"));
    }
    let known = numbers.map(|[nx, ny, nz, d]| ([nx, ny, nz], d));
    Ok(ObservedPlane { plane: row.text("plane")?, station: row.text("station")?, known })
}

/// Writes `planes.csv`.
pub fn write_planes(path: impl AsRef<Path>, planes: &[ObservedPlane]) -> Result<()> {
    let rows = planes.iter().map(|plane| {
        let names = [plane.plane.clone(), plane.station.clone()];
        let numbers = texts(plane.known.map(|(normal, _)| normal));
        names.into_iter().chain(numbers).chain([text(plane.known.map(|(_, d)| d))]).collect()
    });
    write(path.as_ref(), COLUMNS.required, rows)
}
