use std::path::Path;

use super::csv_table::{Columns, Row, Table, texts, write};
use crate::read_text;
use crate::{Error, Result};

/// One inertial sample in body axes: `imu.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImuSample {
    /// Time in seconds.
    pub timestamp_s: f64,
    /// Angular rate in radian per second.
    pub angular_rate: [f64; 3],
    /// Specific force in metres per second squared.
    pub acceleration: [f64; 3],
}

const RATE: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
const ACCELERATION: [&str; 3] = ["accel_x", "accel_y", "accel_z"];
const COLUMNS: Columns = Columns {
    required: &["timestamp_s", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"],
    optional: &[],
};

/// The same columns as `EuRoC` files name them, times in nanoseconds.
const EUROC: Columns = Columns {
    required: &[
        "#timestamp [ns]",
        "w_RS_S_x [rad s^-1]",
        "w_RS_S_y [rad s^-1]",
        "w_RS_S_z [rad s^-1]",
        "a_RS_S_x [m s^-2]",
        "a_RS_S_y [m s^-2]",
        "a_RS_S_z [m s^-2]",
    ],
    optional: &[],
};

/// Reads `imu.csv`, or an `EuRoC` data file, or a folder of one (`mav0/imu0` or its parents); times must ascend.
pub fn read_imu(path: impl AsRef<Path>) -> Result<Vec<ImuSample>> {
    let path = path.as_ref();
    let inside = ["data.csv", "imu0/data.csv", "mav0/imu0/data.csv"].map(|name| path.join(name));
    let file = inside.iter().find(|file| file.is_file()).map_or(path, |file| file.as_path());
    let text = read_text(file)?;
    let euroc = text.trim_start().starts_with('#');
    let table = Table::parse(file, &text, if euroc { &EUROC } else { &COLUMNS })?;
    let mut samples: Vec<ImuSample> = Vec::new();
    for row in table.rows() {
        let sample = if euroc { euroc_sample(&row)? } else { sample(&row)? };
        if let Some(last) = samples.last().filter(|last| last.timestamp_s >= sample.timestamp_s) {
            let (time, last) = (sample.timestamp_s, last.timestamp_s);
            let column = if euroc { EUROC.required[0] } else { "timestamp_s" };
            return Err(row.error(column, format!("is {time} s, expected more than the {last} s before it")));
        }
        samples.push(sample);
    }
    Ok(samples)
}

fn sample(row: &Row) -> Result<ImuSample> {
    Ok(ImuSample {
        timestamp_s: row.needed("timestamp_s")?,
        angular_rate: row.all(RATE)?,
        acceleration: row.all(ACCELERATION)?,
    })
}

fn euroc_sample(row: &Row) -> Result<ImuSample> {
    let name = |index: usize| EUROC.required[index];
    Ok(ImuSample {
        timestamp_s: row.needed(name(0))? * 1e-9,
        angular_rate: row.all([name(1), name(2), name(3)])?,
        acceleration: row.all([name(4), name(5), name(6)])?,
    })
}

/// Writes `imu.csv`.
pub fn write_imu(path: impl AsRef<Path>, samples: &[ImuSample]) -> Result<()> {
    if let Some(index) = samples.windows(2).position(|pair| pair[0].timestamp_s >= pair[1].timestamp_s) {
        let field = format!("[{}].timestamp_s", index + 1);
        return Err(Error::Value { what: "inertial samples", field, reason: "is not after the one before".into() });
    }
    let rows = samples.iter().map(|sample| {
        let ImuSample { timestamp_s, angular_rate, acceleration } = *sample;
        let time = texts(Some([timestamp_s]));
        time.into_iter().chain(texts(Some(angular_rate))).chain(texts(Some(acceleration))).collect()
    });
    write(path.as_ref(), COLUMNS.required, rows)
}
